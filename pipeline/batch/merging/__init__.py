"""From the tables of all cells to what inventories use.

============ =====================================================================
file         what
============ =====================================================================
`finished`   the cells that are done, and their trees in order
`fieldlist`  stems measured in the field: columns found by their usual names
`genera`     leaf types of genera
`stems`      each measured stem joined to the nearest tree
`areas`      polygons that statistics are asked for, or the cells
`shelf`      figures of all trees, on the disk until they are needed
`statistics` numbers, means and spreads by area and species
`geopackage` layers for QGIS
`postgis`    rows into a table that may hold other runs
`database`   connections, and errors that never show a password
`maps`       the picture and the page
`packages`   what the extra brings, or its remedy
============ =====================================================================
"""
