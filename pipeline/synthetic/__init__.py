"""Trees whose truth is known, and clouds of them.

| file | what |
|---|---|
| `kinds` | the generators by name |
| `tubes` | a leafless tree of tapered tubes from a seed |
| `truth` | the cylinders beside a cloud, and a tree of them |
| `sample` | points spread evenly on the bark: quick, nothing hides anything |
| `scan` | what a scanner sees, beam by beam (extra `scan`) |
| `scene`, `ground` | what stands before the scanner |
| `terrestrial`, `flight`, `beams` | where beams start and go |
| `silhouette` | which beams can hit anything |
| `raycaster`, `returns` | where they end, and what comes back |
| `samples` | the trees in data/samples |
"""

from pipeline.synthetic.flight import AlsOptions
from pipeline.synthetic.kinds import KINDS, Kind, kind_named
from pipeline.synthetic.returns import Returns
from pipeline.synthetic.sample import SampleOptions, sample
from pipeline.synthetic.scan import SCANNERS, Scan, scan, scan_files, write_scan
from pipeline.synthetic.scene import SURFACES
from pipeline.synthetic.terrestrial import TlsOptions, step_for
from pipeline.synthetic.truth import Truth, holds_truth, read_truth, tree_of, truth_of, write_truth
from pipeline.synthetic.tubes import TubeTreeOptions, grow_tubes

__all__ = [
    "KINDS",
    "SCANNERS",
    "SURFACES",
    "AlsOptions",
    "Kind",
    "Returns",
    "SampleOptions",
    "Scan",
    "TlsOptions",
    "Truth",
    "TubeTreeOptions",
    "grow_tubes",
    "holds_truth",
    "kind_named",
    "read_truth",
    "sample",
    "scan",
    "scan_files",
    "step_for",
    "tree_of",
    "truth_of",
    "write_scan",
    "write_truth",
]
