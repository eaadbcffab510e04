"""Files of trees: one module a format, each with ``write(value, path)`` and, where it can, ``read(path)``.

=====================  ====================  =============================================
module                 suffix                holds
=====================  ====================  =============================================
`skeleton_ply`         ``.skeleton.ply``     nodes, edges, radii; opens in point cloud tools
`mesh_ply`             ``.mesh.ply``         the surface, closed tubes (write only)
`qsm`                  ``.qsm.csv``          a table of tapered cylinders
`model_npz`            ``.npz``              everything, to the last bit
=====================  ====================  =============================================
"""
