"""A tree model becomes an LsJSON document; every node comes back within 0.6 mm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from pydantic import Field

from pipeline.lsystem.document import EXPONENT, FORMAT, GROWN, RULE, VERSION, BreastHeight, Dimensions
from pipeline.lsystem.loop import close_loop
from pipeline.lsystem.numbering import canonical, carried, told
from pipeline.lsystem.radii import exceptions, shares, sources_text
from pipeline.lsystem.tokens import number
from pipeline.model import Floats, Skeleton, TreeModel
from pipeline.options import Options

ANCHOR_DECIMALS = 4
RADIUS_DECIMALS = 4


class LsystemOptions(Options):
    """How a tree is written as an L-system."""

    length_decimals: int = Field(default=3, ge=1, le=4, description="decimals of a length in metres")
    angle_decimals: int = Field(
        default=0, ge=0, le=4, description="least decimals of an angle in degrees; lengths ask for more"
    )
    radii: Literal["none", "exceptions", "all"] = Field(
        default="exceptions", description="radii to write: none, those that the pipe rule misses, or all"
    )
    radius_exponent: float = Field(
        default=EXPONENT, ge=0, le=3, description="exponent of the pipe rule for radii"
    )
    radius_tolerance_m: float = Field(
        default=0.001, ge=0, description="a radius is written if the rule misses it by more metres"
    )
    radius_source: bool = Field(default=True, description="write where each radius comes from")


def encode(tree: TreeModel, *, options: LsystemOptions | None = None) -> dict[str, Any]:
    """Write a tree as an L-system in the convention of 2021, by a closed loop.

    Parameters
    ----------
    tree : TreeModel
        In any numbering; the document brings it back in that of `canonical`.
    options : LsystemOptions, optional

    Returns
    -------
    dict
        An LsJSON document (docs/lsystem.md). With lengths of 3 decimals every node comes back
        within 0.6 mm, the anchor within 0.1 mm and every radius within its tolerance.

    References
    ----------
    The synthesis project report of 2021 (Delft), section 3.2. Changed: the loop is closed, atan2
    stands for acos, the axis goes on outside brackets, radii may be written.
    """
    options = options or LsystemOptions()
    tree = canonical(tree)
    skeleton = tree.skeleton
    anchor = np.round(skeleton.world[0], ANCHOR_DECIMALS) + 0.0  # no minus zero
    turns, length = _turns(skeleton, anchor, options)
    radius = np.round(tree.radius, RADIUS_DECIMALS)
    widths = _widths(skeleton, length, radius, options)
    steps = [f"F({number(step)})" for step in length.tolist()]
    name = {"id": str(tree.metadata["id"])} if "id" in tree.metadata else {}
    return {
        "format": {"name": FORMAT, "version": VERSION},
        **name,
        "crs": skeleton.crs,
        **_growth(tree),
        "degrees": True,
        "dimensions": Dimensions().model_dump(),
        "trunk": {"anchor": anchor.tolist(), "radius": float(radius[0]), **_breast_height(tree)},
        "radius": {**_rule(options), **_sources(tree, options)},
        "recursions": 0,
        "rules": {},
        "axiom": nested(skeleton, ["".join(parts) for parts in zip(turns, widths, steps, strict=True)]),
    }


def _growth(tree: TreeModel) -> dict[str, Any]:
    """Tell how a tree has grown, if it has, so that nobody takes the file for one of a scan."""
    if GROWN not in tree.metadata.get("flags", ()):
        return {}
    return {"growth": _plain(tree.metadata.get("growth", {}))}


def _plain(known: Any) -> Any:
    """Return metadata as JSON has them."""
    if isinstance(known, Mapping):
        return {str(key): _plain(value) for key, value in known.items()}
    return [_plain(value) for value in known] if isinstance(known, list | tuple) else known


def _turns(skeleton: Skeleton, anchor: Floats, options: LsystemOptions) -> tuple[list[str], Floats]:
    """Return the turns of each node as text, and the (N,) rounded lengths in metres."""
    local = skeleton.xyz + (skeleton.origin - anchor)
    scale = 10**options.length_decimals
    steps, rotations, rolls, angle_scale = close_loop(local, skeleton.parent, scale, options.angle_decimals)
    angles = zip((rotations / angle_scale).tolist(), (rolls / angle_scale).tolist(), strict=True)
    return [_turn(rotation, "+-") + _turn(roll, "><") for rotation, roll in angles], steps / scale


def _turn(angle: float, signs: str) -> str:
    return f"{signs[angle < 0]}({number(abs(angle))})" if angle else ""


def _widths(skeleton: Skeleton, length: Floats, radius: Floats, options: LsystemOptions) -> list[str]:
    """Return ``!(r)`` for each node whose radius is written, else nothing."""
    if options.radii == "none":
        return [""] * len(radius)
    written = np.ones(len(radius), dtype=bool)
    if options.radii == "exceptions":
        parent = skeleton.parent
        share = shares(parent, carried(parent, length), options.radius_exponent)
        written = exceptions(parent, share, radius, options.radius_tolerance_m)
    pairs = zip(written.tolist(), radius.tolist(), strict=True)
    return [f"!({number(r)})" if is_written else "" for is_written, r in pairs]


def nested(skeleton: Skeleton, texts: list[str]) -> str:
    """Join the texts of all nodes but the root, side branches in brackets before the axis goes on."""
    order = told(skeleton.parent, skeleton.continuation)
    starts, depths = skeleton.branch_start.tolist(), skeleton.order.tolist()
    pieces, open_ = [], 0
    for node in order[1:].tolist():
        depth = depths[node]
        if starts[node]:
            pieces.append("]" * (open_ - depth + 1) + "[")
        elif open_ > depth:
            pieces.append("]" * (open_ - depth))
        pieces.append(texts[node])
        open_ = depth
    return "".join(pieces) + "]" * open_


def _rule(options: LsystemOptions) -> dict[str, Any]:
    return {
        "rule": RULE,
        "exponent": options.radius_exponent,
        "written": options.radii,
        "tolerance": options.radius_tolerance_m,
    }


def _sources(tree: TreeModel, options: LsystemOptions) -> dict[str, str]:
    """Say where radii come from, if they are written: those of the rule are all propagated."""
    wanted = options.radius_source and options.radii != "none"
    return {"source": sources_text(tree.radius_source)} if wanted else {}


def _breast_height(tree: TreeModel) -> dict[str, Any]:
    trunk = tree.trunk
    if trunk is None:
        return {}
    sizes = {"diameter": trunk.dbh_m, "low": trunk.lo_m, "high": trunk.hi_m}
    known = BreastHeight(
        **{key: None if size is None else round(size, RADIUS_DECIMALS) for key, size in sizes.items()},
        arc=round(trunk.arc_deg, 1),
        source=trunk.source,
        ground=round(float(tree.skeleton.origin[2]) + trunk.ground_z, ANCHOR_DECIMALS),
    )
    return {"breast_height": known.model_dump()}
