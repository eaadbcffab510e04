"""How accurate a model is: beside another model, beside known truth, beside its points.

| file | what |
|---|---|
| `against` | the three comparisons |
| `wood` | models and truths as tapered segments |
| `placing` | whether two things can be compared where they stand |
| `nodes` | pairs of nodes |
| `bark`, `surfaces` | exact distances to tapered tubes |
| `topology` | recall, precision, orders, branches and their parents |
| `amounts` | volumes, lengths, diameter, height |
| `clouds` | points without a model, and a model without points |
| `comparison`, `spread` | what comes out |
| `page`, `plots`, `viewer` | the same as one self-contained page |
"""

from pipeline.accuracy.against import compare, compare_cloud, compare_truth
from pipeline.accuracy.comparison import Comparison
from pipeline.accuracy.placing import Align, NotComparableError
from pipeline.accuracy.spread import Spread

__all__ = ["Align", "Comparison", "NotComparableError", "Spread", "compare", "compare_cloud", "compare_truth"]
