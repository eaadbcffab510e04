"""CityJSON 2.0: trees as city objects, back again, and the checking of files.

`to_cityjson` writes one closed solid per branch and the skeleton beside it, `from_cityjson` reads
the tree back, `check` finds what a validator would refuse.
"""

from pipeline.cityjson.check import Finding, check
from pipeline.cityjson.document import to_cityjson, write_cityjson
from pipeline.cityjson.options import CityjsonOptions
from pipeline.cityjson.read import from_cityjson, read_cityjson

__all__ = [
    "CityjsonOptions",
    "Finding",
    "check",
    "from_cityjson",
    "read_cityjson",
    "to_cityjson",
    "write_cityjson",
]
