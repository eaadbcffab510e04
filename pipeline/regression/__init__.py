"""Today's output against references that were accepted: the nightly guard.

| file | what |
|---|---|
| `reference` | what is kept of an accepted tree, and reading and writing it |
| `tolerance` | how far each figure may be off, in a file of the references |
| `check` | one tree against its reference |
| `nightly` | all trees: from clouds or from models, and what came of each |
| `page`, `drawing` | report.html, report.json, junit.xml, history.jsonl |
"""

from pipeline.regression.nightly import Night, TreeNight, guard
from pipeline.regression.reference import Reference, accept, read_references
from pipeline.regression.tolerance import Tolerances

__all__ = [
    "Night",
    "Reference",
    "Tolerances",
    "TreeNight",
    "accept",
    "guard",
    "read_references",
]
