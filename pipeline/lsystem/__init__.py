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

`docs/lsystem.md` is the specification.
"""

from pipeline.lsystem.decode import decode, max_error
from pipeline.lsystem.document import read_lsjson, write_lsjson
from pipeline.lsystem.encode import LsystemOptions, encode
from pipeline.lsystem.grammar import expand
from pipeline.lsystem.numbering import canonical

__all__ = [
    "LsystemOptions",
    "canonical",
    "decode",
    "encode",
    "expand",
    "max_error",
    "read_lsjson",
    "write_lsjson",
]
