"""The report of one tree: every figure of report.json, None where a thing is not known."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from types import ModuleType
from typing import Any, Literal

import numpy as np

from pipeline.model import RADIUS_SOURCES, Floats, TreeModel, Trunk
from pipeline.version import __version__

CROWN_SHARE = 0.1
"""Share of all branches' length below which branches are stray shoots, not yet the crown."""

SIGNIFICANT = 7
"""Digits of a figure in report.json: more than any is good for, fewer than float noise."""

DROPPED = ("duplicate", "invalid", "outlier", "clump", "ground", "leaf", "voxel")
SECONDS = ("read", "clean", "skeleton", "fit", "write", "total")


@dataclass(frozen=True)
class Report:
    """What is known of one tree. Lengths in the unit of the name; intervals are 90 %.

    The attributes are the keys of report.json, in its order; docs tell each.
    """

    name: str | None
    source: dict[str, Any]
    status: Literal["ok", "failed"]
    crs: str | None
    crs_assumed: bool | None
    method: str | None
    method_reason: str | None
    points_in: int | None
    points_used: int | None
    dropped: dict[str, int | None]
    leaf_share: float | None
    noise_mm: float | None
    ground_z: float | None
    nodes: int
    edges: int
    branches: int
    max_order: int
    height_m: float | None
    crown_diameter_m: float | None
    crown_base_m: float | None
    dbh_cm: float | None
    dbh_lo_cm: float | None
    dbh_hi_cm: float | None
    dbh_arc_deg: float | None
    dbh_source: str | None
    volume_l: float
    volume_lo_l: float | None
    volume_hi_l: float | None
    stem_volume_l: float
    branch_volume_l: float
    length_m: float
    length_lo_m: float | None
    length_hi_m: float | None
    radius_share: dict[str, float | None]
    surface_mm: dict[str, float | None]
    lsystem: dict[str, float | None]
    flags: list[str]
    seconds: dict[str, float | None]
    peak_rss_mb: float | None
    version: str
    config_hash: str | None

    @property
    def headline(self) -> str:
        """Two lines for people: the name, and height, diameter with its interval, volume, length."""
        breast = "DBH unknown"
        if self.dbh_cm is not None:
            breast = f"DBH {self.dbh_cm:.1f} cm"
            if self.dbh_lo_cm is not None and self.dbh_hi_cm is not None:
                breast += f" ({self.dbh_lo_cm:.1f} to {self.dbh_hi_cm:.1f})"
        height = "height unknown" if self.height_m is None else f"height {self.height_m:.1f} m"
        digits = 0 if self.volume_l >= 100 else 1
        volume, length = f"volume {self.volume_l:,.{digits}f} L", f"length {self.length_m:,.0f} m"
        return f"{self.name or ''}\n{height},  {breast},  {volume},  {length}"

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON: keys in order, None for whatever is not finite."""
        plain: dict[str, Any] = _plain(asdict(self))
        return plain

    def to_json(self) -> str:
        """Return the text of report.json."""
        return json.dumps(self.to_dict(), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def report(
    tree: TreeModel,
    *,
    name: str | None = None,
    lsystem: Mapping[str, float] | None = None,
    seconds: Mapping[str, float] | None = None,
    config_hash: str | None = None,
) -> Report:
    """Report on a tree, as far as the model and its metadata tell.

    Parameters
    ----------
    tree : TreeModel
    name : str, optional
    lsystem : mapping, optional
        ``bytes`` and ``max_error_mm`` of the written L-system.
    seconds : mapping, optional
        Seconds of `SECONDS`; the total is their sum.
    config_hash : str, optional

    Returns
    -------
    Report
    """
    known, graph = tree.metadata, tree.skeleton
    ground = ground_height(tree)
    litres = 1000.0 * tree.volume
    stem = float(litres[graph.order == 0].sum())
    volume, length = _interval(known, "volume_interval_l"), _interval(known, "length_interval_m")
    dropped = dict(known.get("dropped") or {})
    return Report(
        name=name if name is not None else known.get("name"),
        source={key: dict(known.get("source") or {}).get(key) for key in ("path", "sha256", "points")},
        status="ok",
        crs=graph.crs,
        crs_assumed=known.get("crs_assumed"),
        method=known.get("method"),
        method_reason=known.get("method_reason"),
        points_in=known.get("points_in"),
        points_used=known.get("points_used"),
        dropped={key: dropped.get(key) for key in DROPPED},
        leaf_share=_leaf_share(known),
        noise_mm=known.get("noise_mm"),
        ground_z=ground + float(graph.origin[2]),
        nodes=len(graph),
        edges=len(graph) - 1,
        branches=len(graph.paths),
        max_order=int(graph.order.max()),
        height_m=float(known.get("top_z", graph.xyz[:, 2].max())) - ground,
        crown_diameter_m=_diameter(known.get("crown_area_m2")),
        crown_base_m=crown_base(tree),
        **_breast_height(tree.trunk),
        volume_l=float(litres.sum()),
        volume_lo_l=volume[0],
        volume_hi_l=volume[1],
        stem_volume_l=stem,
        branch_volume_l=float(litres.sum()) - stem,
        length_m=float(graph.length.sum()),
        length_lo_m=length[0],
        length_hi_m=length[1],
        radius_share=_radius_share(tree),
        surface_mm={key: dict(known.get("surface_mm") or {}).get(key) for key in ("mean", "median", "p95")},
        lsystem={key: dict(lsystem or {}).get(key) for key in ("bytes", "max_error_mm")},
        flags=sorted(known.get("flags", ())),
        seconds=_seconds(seconds or {}),
        peak_rss_mb=peak_rss_mb(),
        version=__version__,
        config_hash=config_hash,
    )


def ground_height(tree: TreeModel) -> float:
    """Height of the ground relative to the origin: as cleaning found it, else the model's foot."""
    for value in (tree.metadata.get("ground_z"), tree.trunk.ground_z if tree.trunk else None):
        if value is not None and math.isfinite(value):
            return float(value)
    return float(tree.skeleton.xyz[:, 2].min())


def crown_base(tree: TreeModel) -> float | None:
    """Height above ground at which the crown begins; None for a tree without branches.

    From below, the foot of the first-order branch with which the branches so far carry a tenth of
    the length of all wood off the stem: a stray shoot near the ground is not yet the crown.
    """
    graph = tree.skeleton
    starts = np.flatnonzero(graph.branch_start & (graph.order == 1))
    if not len(starts):
        return None
    carried = graph.subtree_length[starts] + graph.length[starts]
    foot = graph.xyz[graph.parent[starts], 2]
    upward = np.argsort(foot, kind="stable")
    reached = np.cumsum(carried[upward]) >= CROWN_SHARE * carried.sum()
    return float(foot[upward[int(np.argmax(reached))]]) - ground_height(tree)


def peak_rss_mb() -> float | None:
    """Return the most memory that this process has held, megabytes; None where the system does not say."""
    if sys.platform == "win32":
        return None
    import resource  # noqa: PLC0415  absent on Windows

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1024.0**2 if sys.platform == "darwin" else 1024.0)


def _breast_height(trunk: Trunk | None) -> dict[str, Any]:
    if trunk is None:
        return dict.fromkeys(("dbh_cm", "dbh_lo_cm", "dbh_hi_cm", "dbh_arc_deg", "dbh_source"))
    metres = {"dbh_cm": trunk.dbh_m, "dbh_lo_cm": trunk.lo_m, "dbh_hi_cm": trunk.hi_m}
    centimetres = {key: None if value is None else 100.0 * value for key, value in metres.items()}
    return {**centimetres, "dbh_arc_deg": trunk.arc_deg, "dbh_source": trunk.source}


def _radius_share(tree: TreeModel) -> dict[str, float | None]:
    """Share of the length whose end radius has each source."""
    length: Floats = tree.skeleton.length
    total = float(length.sum())
    per_source = np.bincount(tree.radius_source, weights=length, minlength=len(RADIUS_SOURCES))
    return {
        source: float(part) / total if total else None
        for source, part in zip(RADIUS_SOURCES, per_source, strict=True)
    }


def _leaf_share(known: Mapping[str, Any]) -> float | None:
    """Share of leaves among the points: as cleaning says, else leaf points of all points."""
    if known.get("leaf_share") is not None:
        return float(known["leaf_share"])
    leaf, points = dict(known.get("dropped") or {}).get("leaf"), known.get("points_in")
    return leaf / points if leaf is not None and points else None


def _diameter(area: float | None) -> float | None:
    """Diameter of the circle with this area."""
    return None if area is None else 2.0 * math.sqrt(area / math.pi)


def _interval(known: Mapping[str, Any], key: str) -> tuple[float | None, float | None]:
    low, high = known.get(key) or (None, None)
    return low, high


def _seconds(seconds: Mapping[str, float]) -> dict[str, float | None]:
    total = seconds.get("total", sum(seconds.values()) if seconds else None)
    return {key: total if key == "total" else seconds.get(key) for key in SECONDS}


def _plain(value: Any) -> Any:
    """Make a value fit for JSON: NumPy scalars to Python's, figures to `SIGNIFICANT` digits."""
    if isinstance(value, Mapping):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float):
        return float(f"{value:.{SIGNIFICANT}g}") if math.isfinite(value) else None
    return value


class _CallableModule(ModuleType):
    """Lets ``pipeline.report(tree)`` work: importing this file binds that name to the module."""

    def __call__(self, tree: TreeModel, **known: Any) -> Report:
        return report(tree, **known)


sys.modules[__name__].__class__ = _CallableModule
