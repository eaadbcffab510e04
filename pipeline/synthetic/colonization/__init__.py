"""Trees that grow into free space: a generator with twenty parameters and five examples.

| file | what |
|---|---|
| `options` | all parameters: of growth, of geometry, of appearance |
| `envelope` | the points of the crown |
| `schedule` | how far a tip sees, and how near it uses points up |
| `growth` | stem, growth, tree |
| `shape` | radii, axes, branches that hang |
| `leaves` | where leaves are |
| `dressing` | triangles of bark and leaves |
| `painting` | pictures of bark and leaves |
| `colours`, `presets` | what there is to choose from |
"""

from pipeline.synthetic.colonization.dressing import dressed
from pipeline.synthetic.colonization.growth import grow, grow_colonization, shaped
from pipeline.synthetic.colonization.leaves import Leaves, leaves_of
from pipeline.synthetic.colonization.options import ColonizationOptions
from pipeline.synthetic.colonization.painting import look_of
from pipeline.synthetic.colonization.presets import PRESETS

__all__ = [
    "PRESETS",
    "ColonizationOptions",
    "Leaves",
    "dressed",
    "grow",
    "grow_colonization",
    "leaves_of",
    "look_of",
    "shaped",
]
