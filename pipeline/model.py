"""The three values that travel through the pipeline: points, a rooted graph, a measured tree.

All are frozen dataclasses of arrays in metres relative to a local `origin`, so that national
coordinates of 400 km keep their millimetres in float64. Facts that follow from the arrays are
cached properties; nothing is changed in place.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.errors import ModelError

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

RadiusSource = Literal["measured", "propagated", "allometric"]
RADIUS_SOURCES: tuple[RadiusSource, ...] = ("measured", "propagated", "allometric")
MEASURED, PROPAGATED, ALLOMETRIC = 0, 1, 2


def _view(values: ArrayLike, dtype: Any, shape: tuple[int | None, ...], name: str) -> NDArray[Any]:
    """Return a read-only view (or converted copy) of `values`, checked for shape."""
    array = np.asarray(values, dtype=dtype).view()
    if array.ndim != len(shape) or any(
        want is not None and want != have for want, have in zip(shape, array.shape, strict=True)
    ):
        msg = f"{name} has shape {array.shape}, expected {shape} (None: any length)"
        raise ModelError(msg)
    array.flags.writeable = False
    return array


def _finite(array: NDArray[Any], name: str) -> None:
    if not np.isfinite(array).all():
        msg = f"{name} holds values that are not finite; clean the points first"
        raise ModelError(msg)


@dataclass(frozen=True, eq=False)
class PointCloud:
    """Laser points in metres relative to a local origin.

    Parameters
    ----------
    xyz : (P, 3) array of float64
        Coordinates relative to `origin`, in metres.
    origin : (3,) array of float64
        National (or scanner) coordinates of the local zero.
    crs : str or None
        ``"EPSG:28992"`` and the like, or None where unknown.
    attributes : mapping of str to (P, ...) array
        Whatever else each point carries (classification, intensity, ...).
    metadata : mapping
        What is known of the cloud as a whole: where it came from, what was dropped, the ground.
    """

    xyz: Floats
    origin: Floats = field(default_factory=lambda: np.zeros(3))
    crs: str | None = None
    attributes: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    metadata: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        xyz = _view(self.xyz, np.float64, (None, 3), "xyz")
        held = {
            name: _view(values, None, (len(xyz), *np.shape(values)[1:]), name)
            for name, values in self.attributes.items()
        }
        object.__setattr__(self, "xyz", xyz)
        object.__setattr__(self, "origin", _view(self.origin, np.float64, (3,), "origin"))
        object.__setattr__(self, "attributes", MappingProxyType(held))
        object.__setattr__(self, "metadata", MappingProxyType(dict(self.metadata)))

    def __reduce__(self) -> tuple[Any, ...]:
        held, known = dict(self.attributes), dict(self.metadata)
        return PointCloud, (self.xyz, self.origin, self.crs, held, known)

    def __len__(self) -> int:
        return len(self.xyz)

    def take(self, index: NDArray[Any], **metadata: Any) -> PointCloud:
        """Return the points at `index` (a mask or positions), with `metadata` added or replaced."""
        held = {name: values[index] for name, values in self.attributes.items()}
        return PointCloud(self.xyz[index], self.origin, self.crs, held, {**self.metadata, **metadata})

    @cached_property
    def world(self) -> Floats:
        """(P, 3) coordinates in the cloud's own reference system."""
        return np.asarray(self.xyz + self.origin)


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A rooted graph of nodes in which every parent comes before its children.

    Our stages number the nodes *path by path*: a node continues its parent's branch when it is the
    very next node, and starts a branch of its own otherwise. The branch structure is so carried by
    the numbers alone and survives every file format that keeps the order of its nodes.

    Parameters
    ----------
    xyz : (N, 3) array of float64
        Node positions relative to `origin`, in metres.
    parent : (N,) array of int32
        Index of each node's parent; ``parent[0] == -1`` and ``parent[i] < i``.
    origin : (3,) array of float64
        Coordinates of the local zero.
    crs : str or None
        As in `PointCloud`.
    metadata : mapping
        How the skeleton was made (method and its reason, noise, flags).

    Raises
    ------
    ModelError
        If the arrays do not make one rooted tree of finite nodes.
    """

    xyz: Floats
    parent: Ints
    origin: Floats = field(default_factory=lambda: np.zeros(3))
    crs: str | None = None
    metadata: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        xyz = _view(self.xyz, np.float64, (None, 3), "xyz")
        parent = _view(self.parent, np.int32, (len(xyz),), "parent")
        _finite(xyz, "xyz")
        if not len(xyz):
            msg = "a skeleton needs at least one node"
            raise ModelError(msg)
        if parent[0] != -1 or (parent[1:] < 0).any():
            msg = "parent[0] must be -1 and no other node may be a root"
            raise ModelError(msg)
        late = np.flatnonzero(parent >= np.arange(len(parent)))
        if len(late):
            msg = f"node {late[0]} comes before its parent {parent[late[0]]}; number parents first"
            raise ModelError(msg)
        object.__setattr__(self, "xyz", xyz)
        object.__setattr__(self, "parent", parent)
        object.__setattr__(self, "origin", _view(self.origin, np.float64, (3,), "origin"))
        object.__setattr__(self, "metadata", MappingProxyType(dict(self.metadata)))

    def __reduce__(self) -> tuple[Any, ...]:
        return Skeleton, (self.xyz, self.parent, self.origin, self.crs, dict(self.metadata))

    def __len__(self) -> int:
        return len(self.xyz)

    @cached_property
    def world(self) -> Floats:
        """(N, 3) coordinates in the skeleton's own reference system."""
        return np.asarray(self.xyz + self.origin)

    @cached_property
    def length(self) -> Floats:
        """(N,) length of the segment from the parent to each node; 0 at the root."""
        step = self.xyz - self.xyz[np.maximum(self.parent, 0)]
        return np.asarray(np.linalg.norm(step, axis=1))

    @cached_property
    def subtree_length(self) -> Floats:
        """(N,) summed length of all segments below each node."""
        total = [0.0] * len(self)
        length, parent = self.length.tolist(), self.parent.tolist()
        for i in range(len(self) - 1, 0, -1):
            total[parent[i]] += total[i] + length[i]
        return np.array(total)

    @cached_property
    def children(self) -> tuple[tuple[int, ...], ...]:
        """Children of every node, in the order of their numbers."""
        below: list[list[int]] = [[] for _ in range(len(self))]
        for i, p in enumerate(self.parent.tolist()[1:], 1):
            below[p].append(i)
        return tuple(map(tuple, below))

    @cached_property
    def tips(self) -> Ints:
        """Nodes without children (never the root, unless it is alone)."""
        count = np.bincount(self.parent[1:], minlength=len(self))
        return np.flatnonzero(count == 0).astype(np.int32)

    @cached_property
    def forks(self) -> Ints:
        """Nodes with two or more children."""
        count = np.bincount(self.parent[1:], minlength=len(self))
        return np.flatnonzero(count > 1).astype(np.int32)

    @cached_property
    def continuation(self) -> Ints:
        """(N,) the child that continues each node's branch, -1 at tips.

        It is the next node where that is a child, else the child that carries the most length.
        """
        carried = (self.subtree_length + self.length).tolist()
        next_ = np.full(len(self), -1, dtype=np.int32)
        for i, below in enumerate(self.children):
            if below:
                next_[i] = below[0] if below[0] == i + 1 else max(below, key=lambda c: (carried[c], -c))
        return next_

    @cached_property
    def branch_start(self) -> NDArray[np.bool_]:
        """(N,) True where a node begins a side branch; the stem is the path that starts at the root."""
        start = np.zeros(len(self), dtype=bool)
        start[1:] = self.continuation[self.parent[1:]] != np.arange(1, len(self))
        return start

    @cached_property
    def branch(self) -> Ints:
        """(N,) branch number of the segment that ends at each node; 0 is the stem (root included)."""
        number, parent = [0] * len(self), self.parent.tolist()
        count = 0
        for i, is_new in enumerate(self.branch_start.tolist()):
            if is_new:
                count += 1
                number[i] = count
            elif i:
                number[i] = number[parent[i]]
        return np.array(number, dtype=np.int32)

    @cached_property
    def paths(self) -> tuple[Ints, ...]:
        """Nodes of every branch from its foot on the parent's axis to its tip, by branch number."""
        members: list[list[int]] = [[] for _ in range(int(self.branch.max()) + 1)]
        for i, b in enumerate(self.branch.tolist()):
            if not members[b] and i:
                members[b].append(int(self.parent[i]))
            members[b].append(i)
        return tuple(np.array(m, dtype=np.int32) for m in members)

    @cached_property
    def branch_parent(self) -> Ints:
        """(B,) the branch that each branch grows from; -1 for the stem."""
        feet = [int(self.branch[path[0]]) for path in self.paths]
        feet[0] = -1
        return np.array(feet, dtype=np.int32)

    @cached_property
    def order(self) -> Ints:
        """(N,) branch order of the segment that ends at each node: 0 on the stem."""
        rank = [0] * len(self.branch_parent)
        for b, p in enumerate(self.branch_parent.tolist()):
            rank[b] = 0 if p < 0 else rank[p] + 1
        return np.array(rank, dtype=np.int32)[self.branch]


@dataclass(frozen=True)
class Trunk:
    """The diameter at breast height and how well it is known.

    Parameters
    ----------
    dbh_m, lo_m, hi_m : float or None
        Diameter 1.3 m above the ground and its 90 % interval, in metres; None where unknown.
    arc_deg : float
        How much of the bark the points cover, in degrees (0 to 360).
    source : {"measured", "propagated", "allometric"} or None
        Where the number comes from.
    ground_z : float
        Height of the ground at the stem, relative to the origin.
    """

    dbh_m: float | None
    lo_m: float | None
    hi_m: float | None
    arc_deg: float
    source: RadiusSource | None
    ground_z: float


@dataclass(frozen=True, eq=False)
class TreeModel:
    """A skeleton with a radius at every node that says where it comes from.

    Node i > 0 is the tapered segment from ``parent[i]`` to ``i``. A branch starts on its parent's
    axis with its own radius, never with the parent's.

    Parameters
    ----------
    skeleton : Skeleton
    radius : (N,) array of float64
        Metres, >= 0.
    radius_source : (N,) array of uint8
        Index into `RADIUS_SOURCES`.
    radius_rmse : (N,) array of float64
        Standard error of the radius in metres; NaN where unknown.
    trunk : Trunk or None
    metadata : mapping
        Everything the report needs that the arrays do not say.
    """

    skeleton: Skeleton
    radius: Floats
    radius_source: NDArray[np.uint8]
    radius_rmse: Floats
    trunk: Trunk | None = None
    metadata: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        count = len(self.skeleton)
        radius = _view(self.radius, np.float64, (count,), "radius")
        _finite(radius, "radius")
        if (radius < 0).any():
            msg = f"radius of node {int(np.argmin(radius))} is negative"
            raise ModelError(msg)
        source = _view(self.radius_source, np.uint8, (count,), "radius_source")
        if (source >= len(RADIUS_SOURCES)).any():
            msg = f"radius_source must be below {len(RADIUS_SOURCES)}"
            raise ModelError(msg)
        object.__setattr__(self, "radius", radius)
        object.__setattr__(self, "radius_source", source)
        object.__setattr__(self, "radius_rmse", _view(self.radius_rmse, np.float64, (count,), "radius_rmse"))
        object.__setattr__(self, "metadata", MappingProxyType(dict(self.metadata)))

    def __reduce__(self) -> tuple[Any, ...]:
        held = (self.skeleton, self.radius, self.radius_source, self.radius_rmse)
        return TreeModel, (*held, self.trunk, dict(self.metadata))

    def __len__(self) -> int:
        return len(self.skeleton)

    @cached_property
    def start_radius(self) -> Floats:
        """(N,) radius at the start of each node's segment: its own where a branch starts."""
        parent = np.maximum(self.skeleton.parent, 0)
        return np.asarray(np.where(self.skeleton.branch_start, self.radius, self.radius[parent]))

    @cached_property
    def volume(self) -> Floats:
        """(N,) volume of each tapered segment in cubic metres; 0 at the root."""
        a, b = self.start_radius, self.radius
        return np.asarray(np.pi / 3 * (a * a + a * b + b * b) * self.skeleton.length)
