"""From parameters to a drawn tree; a change makes anew only what depends on it."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from functools import partial
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from pipeline.geometry.colonization import Colony, Progress
from pipeline.mesh import Mesh, TubeOptions, tubes
from pipeline.model import Floats, TreeModel
from pipeline.studio.modeller.parameters import values_of
from pipeline.studio.modeller.pictures import Pixels, picture
from pipeline.synthetic.colonization import ColonizationOptions, dressed, grow, leaves_of, shaped
from pipeline.synthetic.colonization.colours import LEAF_COLOURS, STEM_COLOURS
from pipeline.synthetic.colonization.dressing import TILE_M, leaf_mesh
from pipeline.synthetic.colonization.envelope import crown_points
from pipeline.synthetic.colonization.growth import POINTS_STREAM, STEM_STREAM, stem_nodes

T = TypeVar("T")
RGB = tuple[float, float, float]
Step = Progress | str
"""An iteration of a growth, or in words what is done after it."""
Listener = Callable[[Step], None]
Clock = Callable[[], float]

KEPT = 12  # results of each kind that are kept, so that undo is quick
MOST_SHOWN = 4000  # points of the crown that are shown while it is being shaped

ENDED = {
    "max_iter": "all iterations are done; more make an older tree",
    "exhausted": "the crown is full; give it more room or a lower branch density",
    "out_of_reach": "no twig sees free space any more; raise the branch density at the beginning",
    "stalled": "twigs would only grow where they have grown; raise the branch density at the beginning",
}
"""Why growth ends, and what helps."""


class Modelled(NamedTuple):
    """A tree, drawn.

    Attributes
    ----------
    options : ColonizationOptions
        Those that it is of.
    tree : TreeModel
    wood, foliage : Mesh
        Triangles of bark and of leaves; the bark with places in a picture only where it bears one.
    bark, leaf : (float, float, float)
        Colours, red, green and blue from 0 to 1.
    skin, spray : (H, W, 4) arrays of uint8, or None
        Pictures of bark and of leaves, where the options name some.
    milliseconds : float
        What the making took.
    """

    options: ColonizationOptions
    tree: TreeModel
    wood: Mesh
    foliage: Mesh
    bark: RGB
    leaf: RGB
    skin: Pixels | None
    spray: Pixels | None
    milliseconds: float

    @property
    def vertices(self) -> int:
        """Vertices of bark and leaves."""
        return len(self.wood.vertices) + len(self.foliage.vertices)

    @property
    def triangles(self) -> int:
        """Triangles of bark and leaves."""
        return len(self.wood.faces) + len(self.foliage.faces)

    def mesh(self) -> Mesh:
        """Return bark and leaves in one, as files hold them."""
        return dressed(self.tree, self.options)

    @property
    def reason(self) -> str:
        """Why growth ended: a key of `ENDED`."""
        return str(self.tree.metadata["stop_reason"])


class Modeller:
    """Makes trees of parameters and keeps the latest of every class.

    Parameters
    ----------
    clock : callable
        Tells seconds.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._grown = _Kept[tuple[Colony, int]]()
        self._shaped = _Kept[TreeModel]()
        self._wood = _Kept[Mesh]()
        self._foliage = _Kept[Mesh]()
        self._pictures = _Kept[Pixels | None]()

    def model(self, options: ColonizationOptions, progress: Listener | None = None) -> Modelled:
        """Make a tree.

        Parameters
        ----------
        options : ColonizationOptions
        progress : callable, optional
            Is told after every iteration of a growth and between what follows it; what it raises ends the
            making.
        """
        tell: Listener = progress or (lambda _step: None)
        begun = self._clock()
        key = values_of(options, "growth")
        colony, stem = self._grown.get(key, lambda: grow(options, progress))
        tell(f"shaping {len(colony.xyz):,} nodes")
        key = values_of(options, "growth", "shape")
        tree = self._shaped.get(key, lambda: shaped(colony, stem, options))
        tell(f"drawing the bark of {len(tree):,} nodes")
        look = options.ring_sides, bool(options.bark_picture)
        wood = self._wood.get((key, look), lambda: _wood(tree, *look))
        tell(f"drawing the leaves of {len(tree):,} nodes")
        leafy = values_of(options, "leaves")
        foliage = self._foliage.get((key, leafy), lambda: leaf_mesh(leaves_of(tree, options), tree))
        named = options.bark_picture, options.leaf_picture
        skin, spray = (self._pictures.get(path, partial(picture, path)) for path in named)
        took = 1000.0 * (self._clock() - begun)
        return Modelled(options, tree, wood, foliage, *colours(options), skin, spray, took)


def colours(options: ColonizationOptions) -> tuple[RGB, RGB]:
    """Return the colours of bark and leaves, from 0 to 1."""
    bark, leaf = STEM_COLOURS[options.stem_colour], LEAF_COLOURS[options.leaf_colour]
    return (bark[0] / 255, bark[1] / 255, bark[2] / 255), (leaf[0] / 255, leaf[1] / 255, leaf[2] / 255)


def envelope(options: ColonizationOptions) -> Floats:
    """(P, 3) points of the crown that growth would fill, at most `MOST_SHOWN` of them, metres."""
    straight, entered = stem_nodes(options, np.random.default_rng([options.seed, STEM_STREAM]))
    points = crown_points(options, straight[entered], np.random.default_rng([options.seed, POINTS_STREAM]))
    return np.asarray(points[:: -(-len(points) // MOST_SHOWN)])


def _wood(tree: TreeModel, sides: int, has_picture: bool) -> Mesh:
    """Draw the bark; with places in a picture only where there is one."""
    options = TubeOptions(min_sides=sides, max_sides=sides)
    return tubes(tree, options=options, tile_m=TILE_M if has_picture else None)


class _Kept(Generic[T]):
    """The latest results by what they were made of."""

    def __init__(self) -> None:
        self._results: OrderedDict[Hashable, T] = OrderedDict()

    def get(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return what is kept, or make it."""
        if key not in self._results:
            self._results[key] = make()
        self._results.move_to_end(key)
        while len(self._results) > KEPT:
            self._results.popitem(last=False)
        return self._results[key]
