"""CityJSON 2.0: trees as city objects, back again, and the checking of files.

`to_cityjson` writes one closed solid per branch and the skeleton beside it, `from_cityjson` reads
the tree back from any profile, `check` finds what a validator would refuse. `SeqWriter` and `read_seq`
do the same for many trees in one file.
"""

from pipeline.cityjson.check import Finding, check
from pipeline.cityjson.document import to_cityjson, write_cityjson
from pipeline.cityjson.extension import extension
from pipeline.cityjson.member import describe_seq, read_feature
from pipeline.cityjson.options import CityjsonOptions
from pipeline.cityjson.read import from_cityjson, read_cityjson
from pipeline.cityjson.seq import SeqWriter, check_seq, read_seq

__all__ = [
    "CityjsonOptions",
    "Finding",
    "SeqWriter",
    "check",
    "check_seq",
    "describe_seq",
    "extension",
    "from_cityjson",
    "read_cityjson",
    "read_feature",
    "read_seq",
    "to_cityjson",
    "write_cityjson",
]
