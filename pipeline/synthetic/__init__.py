"""Trees whose truth is known, and points on them.

| file | what |
|---|---|
| `tubes` | a leafless tree of tapered tubes from a seed |
| `sample` | points on its bark |
| `truth` | the cylinders beside a cloud |
| `samples` | the trees in data/samples |
"""

from pipeline.synthetic.sample import SampleOptions, sample
from pipeline.synthetic.truth import Truth, read_truth, truth_of, write_truth
from pipeline.synthetic.tubes import TubeTreeOptions, grow_tubes

__all__ = [
    "SampleOptions",
    "Truth",
    "TubeTreeOptions",
    "grow_tubes",
    "read_truth",
    "sample",
    "truth_of",
    "write_truth",
]
