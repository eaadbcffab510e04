"""Files of trees: one module a format, each with ``write(value, path)`` and, where it can, ``read(path)``.

=====================  ====================  =============================================
module                 suffix                holds
=====================  ====================  =============================================
`skeleton_ply`         ``.skeleton.ply``     nodes, edges, radii; opens in point cloud tools
`mesh_ply`             ``.mesh.ply``         the surface, closed tubes (write only)
`qsm`                  ``.qsm.csv``          a table of tapered cylinders
`model_npz`            ``.npz``              everything, to the last bit
`swc`                  ``.swc``              nodes with radii, for neuron tools
`treefile`             ``.treefile.txt``     raycloudtools' and treetools' table
`treeqsm`              ``.treeqsm.txt``      TreeQSM's cylinders as text
`simpleforest`         ``.simpleforest.csv`` SimpleForest's cylinders
`mtg`                  ``.mtg``              OpenAlea's multiscale graph
`gpkg`                 ``.gpkg``             lines and points for GIS
`adtree_ply`           ``.ply``              AdTree's skeletons (read only)
`treeqsm_mat`          ``.mat``              TreeQSM's models (read only)
=====================  ====================  =============================================
"""
