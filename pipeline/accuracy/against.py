"""The three comparisons: a model with another, with known truth, with the points it was made from."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.accuracy.amounts import amounts_of, differences
from pipeline.accuracy.bark import nearest_bark
from pipeline.accuracy.clouds import points_of_tree, unexplained, unsupported
from pipeline.accuracy.comparison import Along, Comparison, Layer, View
from pipeline.accuracy.nodes import Pairs, pairs_of_nodes
from pipeline.accuracy.placing import (
    FAR_M,
    Align,
    NotComparableError,
    check_wood,
    gap,
    placing_notes,
    same_system,
    shift_of,
)
from pipeline.accuracy.spread import spread_of
from pipeline.accuracy.surfaces import bark_distances, mean_by_segment
from pipeline.accuracy.topology import path_statistics, topology
from pipeline.accuracy.wood import Marks, Wood, wood_of, wood_of_truth
from pipeline.model import PointCloud, Skeleton, TreeModel
from pipeline.synthetic.truth import Truth

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


POINTS = "points from the bark"


def compare(a: TreeModel | Skeleton, b: TreeModel | Skeleton, *, align: Align = "none") -> Comparison:
    """Compare a model with a reference.

    Parameters
    ----------
    a : TreeModel or Skeleton
        What is judged.
    b : TreeModel or Skeleton
        What it is held against. Errors are those of A; without radii on both sides there are none of
        surfaces, radii, volumes and diameters.
    align : {"root", "none"}
        Whether A is moved first so that its root is that of B.

    Returns
    -------
    Comparison

    Raises
    ------
    NotComparableError
        If one is empty, or, unless they are aligned, they are in different reference systems or
        kilometres apart.
    """
    mine, theirs = wood_of(a), wood_of(b)
    check_wood(mine, "A")
    check_wood(theirs, "B")
    shift = shift_of(mine, theirs, align)
    pairs = pairs_of_nodes(_graph(a), _graph(b), shift)
    return _compared(mine.moved(shift), theirs, shift, pairs)


def compare_truth(model: TreeModel | Skeleton, truth: Truth) -> Comparison:
    """Compare a model with known truth.

    Parameters
    ----------
    model : TreeModel or Skeleton
    truth : Truth
        As `pipeline.synthetic.read_truth` gives it.

    Returns
    -------
    Comparison
        As of `compare`, but nodes have no partners in a chain of cylinders.

    Raises
    ------
    NotComparableError
        If one is empty, or they are kilometres apart.
    """
    mine, theirs = wood_of(model), wood_of_truth(truth)
    check_wood(mine, "the model")
    check_wood(theirs, "the truth")
    _check_near(gap(mine.box, theirs.box), "the truth", FAR_M)
    return _compared(mine, theirs, None, None)


def compare_cloud(model: TreeModel | Skeleton, cloud: PointCloud, truth: Truth | None = None) -> Comparison:
    """Compare a model with points.

    Parameters
    ----------
    model : TreeModel or Skeleton
        Without radii only its axis is compared.
    cloud : PointCloud
        All points count that are not of the classes ground, water and noise.
    truth : Truth, optional
        Adds what `compare_truth` says, and what the truth itself deviates from the points.

    Returns
    -------
    Comparison

    Raises
    ------
    NotComparableError
        If one is empty, or they do not overlap.
    """
    wood, points = wood_of(model), points_of_tree(cloud)
    check_wood(wood, "the model")
    if not same_system(wood.crs, cloud.crs):
        msg = f"the model is in {wood.crs} and the cloud in {cloud.crs}; convert one of them"
        raise NotComparableError(msg)
    _check_near(gap(wood.box, (points.min(axis=0), points.max(axis=0))), "the cloud", _thickness(wood))
    base = np.floor(wood.root)
    against = _against_points(wood.moved(-base), points - base, base)
    if truth is None:
        return against
    bark = wood_of_truth(truth).moved(-base).tubes()
    floor = None
    if bark is not None and len(bark.start):
        floor = float(1000.0 * np.abs(nearest_bark(points - base, bark).surface).mean())
    return against.joined(Comparison(surface_floor_mm=floor)).joined(compare_truth(model, truth))


def _against_points(wood: Wood, points: Floats, base: Floats) -> Comparison:
    """Compare a tree with points, both relative to `base`; what is shown is in world coordinates."""
    amounts, paths = {"a": amounts_of(wood)}, {"a": path_statistics(wood)}
    tubes = wood.tubes()
    shown = wood.moved(base)
    if tubes is None:
        axis = spread_of(nearest_bark(points, wood.bare()).axial)
        view = View(shown, points=points + base)
        return Comparison(axis=axis, amounts=amounts, paths=paths, view=view)
    nearest = nearest_bark(points, tubes)
    off = np.abs(nearest.surface)
    lost = unexplained(points, nearest, base)
    without, bare = unsupported(wood, tubes, points)
    per_segment = 1000.0 * mean_by_segment(off, nearest.segment, len(wood))
    view = View(
        shown,
        layers=(Layer(POINTS, np.where(bare, np.nan, per_segment)),),
        points=points + base,
        point_mm=1000.0 * off,
        histograms={POINTS: 1000.0 * off},
        along=(Along(POINTS, _path_to(wood, nearest.segment, nearest.share), 1000.0 * off),),
    )
    return Comparison(
        surface=spread_of(off),
        amounts=amounts,
        paths=paths,
        coverage=1.0 - lost.share,
        unexplained=lost,
        unsupported=without,
        view=view,
    )


def _compared(mine: Wood, theirs: Wood, shift: Floats | None, pairs: Pairs | None) -> Comparison:
    """Compare two trees where they stand."""
    notes = placing_notes(mine, theirs, movable=shift is not None)
    base = np.floor(theirs.root)
    a, b = mine.moved(-base), theirs.moved(-base)
    axis = nearest_bark(a.marks.xyz, b.bare()).axial
    bark, segment = bark_distances(a.tubes(), b.tubes())
    found = topology(a, b, pairs)
    amounts = {"a": amounts_of(a), "b": amounts_of(b)}
    figures: dict[str, Any] = {key: getattr(found, key) for key in found.__dataclass_fields__}
    return Comparison(
        nodes=None if pairs is None else spread_of(pairs.distance, anchored=True),
        matched_by=None if pairs is None else pairs.by,
        axis=spread_of(axis),
        surface=spread_of(bark),
        surface_back=spread_of(bark_distances(b.tubes(), a.tubes())[0]),
        **figures,
        **asdict(differences(amounts["a"], amounts["b"])),
        amounts=amounts,
        paths={"a": path_statistics(a), "b": path_statistics(b)},
        shift_m=None if shift is None else float(np.linalg.norm(shift)),
        shift_xyz_m=None if shift is None else (float(shift[0]), float(shift[1]), float(shift[2])),
        notes=notes,
        view=_view(mine, theirs, a.marks, (pairs, axis, bark, mean_by_segment(bark, segment, len(a)))),
    )


def _view(
    mine: Wood, theirs: Wood, marks: Marks, measured: tuple[Pairs | None, Floats, Floats, Floats]
) -> View:
    """Return what can be drawn of two trees; `marks` are those that the axes were measured at."""
    pairs, axis, bark, per_segment = measured
    held: dict[str, tuple[Floats, Floats, Floats]] = {}
    if pairs is not None:
        name = "nodes" if pairs.by != "nearest" else "nodes from the nearest node"
        held[name] = (pairs.distance[1:], pairs.distance[1:], mine.path)
    held["axes"] = (
        mean_by_segment(axis, marks.segment, len(mine)),
        axis,
        _path_to(mine, marks.segment, marks.share),
    )
    if len(bark):
        known = np.isfinite(per_segment)
        held["surfaces"] = (
            per_segment,
            bark,
            mine.path[known].repeat(len(bark) // known.sum()),
        )
    return View(
        mine,
        layers=tuple(Layer(name, 1000.0 * values) for name, (values, _, _) in held.items()),
        reference=theirs,
        histograms={name: 1000.0 * all_ for name, (_, all_, _) in held.items()},
        along=tuple(Along(name, path, 1000.0 * all_) for name, (_, all_, path) in held.items()),
    )


def _path_to(wood: Wood, segment: Ints, share: Floats) -> Floats:
    """Return how long the way from the root is to places on segments."""
    return np.asarray(wood.path[segment] - (1 - share) * wood.length[segment])


def _graph(model: TreeModel | Skeleton) -> Skeleton:
    return model.skeleton if isinstance(model, TreeModel) else model


def _thickness(wood: Wood) -> float:
    """Return how far points may lie outside the box of the axes: the largest radius, and a bit."""
    return 1.0 if wood.end_radius is None else 1.0 + float(wood.end_radius.max())


def _check_near(apart: float, what: str, most: float) -> None:
    if apart > most:
        far = f"{apart / 1000:.1f} km" if apart > FAR_M else f"{apart:.1f} m"
        msg = f"the model and {what} do not overlap, {far} lie between them; give {what} of this very tree"
        raise NotComparableError(msg)
