"""L-systems: a tree as a string that a turtle draws, in the LsJSON format of 2021, made exact.

| file | what |
|---|---|
| `encode` | tree model to document: options, texts, nesting |
| `loop` | the closed loop that keeps every node within 0.6 mm |
| `decode` | document to tree model, and the error between the two |
| `turtle` | symbols to nodes, the convention of 2021 |
| `tokens` | text to symbols and values |
| `grammar` | rules |
| `numbering` | the order of nodes in the string and in the model |
| `radii` | the pipe rule, its exceptions, where radii come from |
| `document` | the keys of the file, reading and writing |
| `storage` | compressed files, and archives of many trees |
| `transforms` | generalising, repeats, growing by scale |
| `dialects` | the L-strings of other programs, written and read |

`docs/lsystem.md` is the specification.
"""

from pipeline.lsystem.decode import FLAT, decode, max_error
from pipeline.lsystem.dialects.conventions import PROFILES, LstringOptions, Profile
from pipeline.lsystem.dialects.reading import from_lstring
from pipeline.lsystem.dialects.writing import to_lstring
from pipeline.lsystem.document import read_lsjson, write_lsjson
from pipeline.lsystem.encode import LsystemOptions, encode
from pipeline.lsystem.grammar import expand
from pipeline.lsystem.numbering import canonical
from pipeline.lsystem.storage.archive import Archive, ArchiveWriter, split_member
from pipeline.lsystem.transforms.generalise import GeneraliseOptions, deviation, generalise
from pipeline.lsystem.transforms.growing import ScaleOptions, grow
from pipeline.lsystem.transforms.repeats import RepeatsOptions, repeats

__all__ = [
    "FLAT",
    "PROFILES",
    "Archive",
    "ArchiveWriter",
    "GeneraliseOptions",
    "LstringOptions",
    "LsystemOptions",
    "Profile",
    "RepeatsOptions",
    "ScaleOptions",
    "canonical",
    "decode",
    "deviation",
    "encode",
    "expand",
    "from_lstring",
    "generalise",
    "grow",
    "max_error",
    "read_lsjson",
    "repeats",
    "split_member",
    "to_lstring",
    "write_lsjson",
]
