"""Growing by scale, as in 2021: new shoots near the tips, longer segments, thicker wood."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError, field_validator

from pipeline.errors import InputFormatError, UsageError
from pipeline.geometry.compiled import compiled
from pipeline.lsystem.decode import decode, numbering, walked
from pipeline.lsystem.document import GROWN, checked
from pipeline.lsystem.encode import LsystemOptions, encode
from pipeline.lsystem.grammar import LONGEST, expand
from pipeline.lsystem.numbering import carried, continued
from pipeline.lsystem.radii import grow_radii, shares
from pipeline.lsystem.transforms.sprouting import positions, shoots
from pipeline.model import MEASURED, PROPAGATED, Floats, Ints, Skeleton, TreeModel, Trunk
from pipeline.options import Options

NEAR_TIPS = 4
"""Segments that start fewer nodes than this from the tip of their branch grow by the ratio."""
MOST_YEARS = 1000
"""Years that a tree may grow by."""
MOST_NODES = LONGEST // 20
"""Nodes that a grown tree may have: the longest string at some 20 characters a node."""
LARGEST_M = 10_000
"""Metres that a grown tree may reach: far past all trees, and well short of losing millimetres."""


class ScaleOptions(Options):
    """How a tree grows in a year; 0 switches a parameter off, and all are off unless given.

    References
    ----------
    The synthesis project report of 2021 (Delft), section 4.7: the ranges, and 0 as the default.
    """

    sprout_position: int = Field(
        default=0,
        ge=0,
        le=5,
        description="nodes from the tip of a branch to where it sprouts, 1 to 5; 0: none",
    )
    speed: float = Field(
        default=0.0, ge=0, le=1, description="share by which every segment lengthens, 0.1 to 1; 0: none"
    )
    ratio: float = Field(
        default=0.0, ge=0, le=5, description="factor on lengths near tips instead, 1.5 to 5; 0: the speed's"
    )
    thickness: float = Field(
        default=0.0, ge=0, le=0.8, description="share by which every radius grows, 0.1 to 0.8; 0: none"
    )

    @field_validator("speed", "ratio", "thickness")
    @classmethod
    def _off_or_in_range(cls, value: float, info: Any) -> float:
        least = {"speed": 0.1, "ratio": 1.5, "thickness": 0.1}[info.field_name]
        if 0 < value < least:
            msg = f"must be 0 (off) or at least {least}"
            raise ValueError(msg)
        return value


class _Tree(NamedTuple):
    """A tree on its way; nodes are only ever added at the end."""

    xyz: Floats
    parent: Ints
    onward: Ints
    radius: Floats
    source: NDArray[np.uint8]


def grow(document: Mapping[str, Any], *, years: int, options: ScaleOptions | None = None) -> dict[str, Any]:
    """Grow a tree by some years, as the report of 2021 does.

    In a year, every node at the sprout position puts out a shoot, the average tip of its kind;
    every segment lengthens; all wood thickens. Headings stay, and so does what no option names.

    Parameters
    ----------
    document : mapping
        An LsJSON, ours or of 2021, with rules or without.
    years : int
        How often the growth is applied, 0 to `MOST_YEARS`.
    options : ScaleOptions, optional
        Without them nothing grows.

    Returns
    -------
    dict
        An LsJSON document with the input's `id`, `crs` and way of writing radii, and without rules.
        Every node is within 0.6 mm of the exactly grown tree, however many the years, while no
        segment passes 200 m.

    Raises
    ------
    InputFormatError
        If the document cannot be read.
    UsageError
        If `years` is out of range, or the tree would reach past `MOST_NODES` or `LARGEST_M`.

    Notes
    -----
    Shoots are one segment, carry nothing in the year in which they come, and take their radius by
    the pipe rule. A node that has sprouted forks, and branches gain no nodes: so all shoots come in
    the first year, and later ones lengthen and thicken them.

    A branch goes on with the child outside brackets. Where there is none, as in 2021, positions are
    counted along the child that is told first, which gives the counts of the report's table 4.5; the
    file that is written has its axes outside brackets.

    Thickness scales the radius of the trunk and so, by the pipe rule, all; written radii are scaled
    alike. Radii so grown are no longer measured but propagated. The diameter at breast height and its
    interval grow with them, and it is propagated as soon as anything lengthens or thickens. A document
    that writes no radii but the trunk's cannot hold the others where they were: they follow the rule.

    References
    ----------
    The synthesis project report of 2021 (Delft), section 3.3.2. Changed: directions are averaged as
    vectors in the frame of the twig and each of the four kinds has its own mean length; angles of
    2021 wrap, and turn upright twigs otherwise than level ones.
    """
    options = options or ScaleOptions()
    if not 0 <= years <= MOST_YEARS:
        msg = f"a tree cannot grow by {years} years; give 0 to {MOST_YEARS}"
        raise UsageError(msg)
    tree, exponent = decode(document), checked(document).radius.exponent
    skeleton = tree.skeleton
    grown = _Tree(skeleton.xyz, skeleton.parent, _onward(document), tree.radius, tree.radius_source)
    for year in range(1, years + 1):
        grown = _a_year_older(grown, options, exponent, year)
    return encode(
        TreeModel(
            Skeleton(grown.xyz, grown.parent, skeleton.origin, skeleton.crs),
            grown.radius,
            grown.source,
            np.full(len(grown.parent), np.nan),
            _older(tree.trunk, options, years),
            _told(tree.metadata, options, years),
        ),
        options=_as_written(document),
    )


def _a_year_older(tree: _Tree, options: ScaleOptions, exponent: float, year: int) -> _Tree:
    """Apply the growth once; positions, rules and lengths of shoots are those before it."""
    xyz = _longer(tree, options)
    for reached in (float(np.abs(xyz).max()), float(tree.radius.max()) * (1 + options.thickness)):
        _hold(reached <= LARGEST_M, f"{reached:.3g} m", year)
    foot, step = np.empty(0, dtype=np.int32), np.empty((0, 3))
    if options.sprout_position:
        foot, step = shoots(tree.xyz, tree.parent, tree.onward, options.sprout_position)
    count = len(tree.parent) + len(foot)
    _hold(count <= MOST_NODES, f"{count:,} nodes", year)
    source = np.where(tree.source == MEASURED, PROPAGATED, tree.source) if options.thickness else tree.source
    older = _Tree(
        np.concatenate([xyz, xyz[foot] + step]),
        np.concatenate([tree.parent, foot]),
        np.concatenate([tree.onward, np.full(len(foot), -1, dtype=np.int32)]),
        np.concatenate([tree.radius * (1 + options.thickness), np.full(len(foot), np.nan)]),
        np.concatenate([source, np.full(len(foot), PROPAGATED)]).astype(np.uint8),
    )
    return older._replace(radius=_by_rule(older, exponent))


def _longer(tree: _Tree, options: ScaleOptions) -> Floats:
    """Return the (N, 3) nodes after their segments have lengthened."""
    if not (options.speed or options.ratio):
        return tree.xyz
    position, _ = positions(tree.parent, tree.onward)
    far = 1 + options.speed
    return _scaled(tree.xyz, tree.parent, np.where(position < NEAR_TIPS, options.ratio or far, far))


@compiled
def _scaled(xyz: Floats, parent: Ints, factor: Floats) -> Floats:
    """Scale every segment by the factor of the node it starts from."""
    grown = xyz.copy()
    for i in range(1, len(xyz)):
        p = parent[i]
        grown[i] = grown[p] + (xyz[i] - xyz[p]) * factor[p]
    return grown


def _by_rule(tree: _Tree, exponent: float) -> Floats:
    """Fill in the radii that are not there yet."""
    length = np.linalg.norm(tree.xyz - tree.xyz[np.maximum(tree.parent, 0)], axis=1)
    share = shares(tree.parent, carried(tree.parent, length), exponent)
    return grow_radii(tree.parent, share, tree.radius)


def _hold(fits: bool, reached: str, year: int) -> None:
    if not fits:
        msg = (
            f"the tree would reach {reached} in year {year}, a tree may have {MOST_NODES:,} nodes and "
            f"reach {LARGEST_M:,} m; let it grow by fewer years or less a year"
        )
        raise UsageError(msg)


def _onward(document: Mapping[str, Any]) -> Ints:
    """Return the (N,) child that goes on from each node: the one outside brackets, else the first told."""
    sheet = checked(document)
    path = walked(expand(sheet.axiom, sheet.rules, sheet.applications), sheet)
    order, _ = numbering(path)
    number = np.argsort(order)
    told = continued(path.parent, path.bracketed, np.zeros(len(order)))[order]
    return np.where(told < 0, -1, number[told]).astype(np.int32)


def _older(trunk: Trunk | None, options: ScaleOptions, years: int) -> Trunk | None:
    """Let the diameter at breast height grow, no longer measured; nothing of its bark has been seen."""
    if trunk is None or not years or not (options.speed or options.ratio or options.thickness):
        return trunk
    factor = (1 + options.thickness) ** years
    dbh, low, high = (size and size * factor for size in (trunk.dbh_m, trunk.lo_m, trunk.hi_m))
    source = "propagated" if trunk.source == "measured" else trunk.source
    return replace(trunk, dbh_m=dbh, lo_m=low, hi_m=high, arc_deg=0.0, source=source)


def _told(metadata: Mapping[str, Any], options: ScaleOptions, years: int) -> dict[str, Any]:
    """Tell in the metadata that the tree has grown, and of what growth before."""
    if not years or not any(options.model_dump().values()):
        return dict(metadata)
    before = {"before": metadata["growth"]} if "growth" in metadata else {}
    flags = tuple(sorted({*metadata.get("flags", ()), GROWN}))
    return {**metadata, "flags": flags, "growth": {"method": "scale", "years": years, **before}}


def _as_written(document: Mapping[str, Any]) -> LsystemOptions:
    """Return the options by which the radii of a document were written."""
    block = document.get("radius", {})
    names = {"radius_exponent": "exponent", "radii": "written", "radius_tolerance_m": "tolerance"}
    known = {option: block[key] for option, key in names.items() if key in block}
    try:
        return LsystemOptions(**known, radius_source="source" in block)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        key = f"radius.{names[str(first['loc'][0])]}"
        said = f"{first['msg'][0].lower()}{first['msg'][1:]}"
        msg = f"not an LsJSON: {key}: {said}; mend it as docs/lsystem.md says"
        raise InputFormatError(msg) from None
