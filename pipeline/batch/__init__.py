"""Whole tiles on Dask: cells planned, exploded, worked on by many processes, and resumed where they stopped.

============= ====================================================================
file          what
============= ====================================================================
`plan`        which tiles, which cells, in which reference system; refusals
`explode`     the points of a tile, streamed once into the cells that need them
`gather`      the points of one cell, from parts and COPC tiles, each point once
`cell`        all that is done for one cell
`tasks`       what a worker does with one task; errors are values
`cluster`     a Dask cluster of our own, or one that is there
`engine`      a run, from its plan to its summary
`dispatch`    a window of tasks in flight, and what follows from each
`ledger`      which cells are done, split, quarantined or open; on disk first
`quarantine`  cells that failed for good, and cells that were split
`folder`      whose folder it is, and who works in it
`manifests`   the file that says that a cell is done
`status`      what a folder of results holds
`progress`    how far a run is
`merge`       one table, GeoPackage, database and map of all cells
============= ====================================================================
"""
