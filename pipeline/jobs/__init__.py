"""Many trees in one run: which files, on how many processes, and what became of each.

================ =====================================================================
file             what
================ =====================================================================
`inputs`         files and folders to named trees
`crew`           worker processes; one that dies takes only its own tree along
`reconstruction` all that is done for one tree, with whatever went wrong as a value
`summary`        the outcomes, and summary.json
================ =====================================================================
"""
