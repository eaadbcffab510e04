"""An LsJSON document becomes a tree model; ours and the files of 2021."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputFormatError, ModelError
from pipeline.lsystem import tokens
from pipeline.lsystem.document import GROWN, BreastHeight, Dimensions, Document, checked, is_flat
from pipeline.lsystem.grammar import expand
from pipeline.lsystem.loop import RADIAN
from pipeline.lsystem.numbering import canonical, carried, continued, numbered
from pipeline.lsystem.radii import grow_radii, shares, sources
from pipeline.lsystem.turtle import Walk, walk
from pipeline.model import Floats, Ints, Skeleton, TreeModel, Trunk

FLAT = "flat_anchor"
"""Flag of a tree whose document gave no height of its foot."""


def decode(document: Mapping[str, Any]) -> TreeModel:
    """Read an L-system as a tree, node 0 at the anchor, numbered canonically.

    Every ``F`` is a node. What follows a node outside brackets continues its branch; where all is
    in brackets, as in 2021, the child that carries the most length does.

    Parameters
    ----------
    document : mapping
        An LsJSON as `read_lsjson` gives it.

    Raises
    ------
    InputFormatError
        If a key is missing or wrong, or the L-string cannot be read, with the position in it.
    """
    sheet = checked(document)
    text = expand(sheet.axiom, sheet.rules, sheet.applications)
    path = walked(text, sheet)
    order, parent = numbering(path)
    skeleton = Skeleton(path.xyz[order], parent, np.array(sheet.trunk.anchor), sheet.crs)
    given = path.width[order]
    given[0] = sheet.trunk.radius
    share = shares(parent, carried(parent, np.abs(path.length[order])), sheet.radius.exponent)
    return TreeModel(
        skeleton,
        grow_radii(parent, share, given),
        sources(sheet.radius.source, len(parent)),
        np.full(len(parent), np.nan),
        _trunk(sheet.trunk.breast_height, skeleton),
        _known(sheet, is_flat(document)),
    )


def max_error(tree: TreeModel, document: Mapping[str, Any]) -> float:
    """Return the largest distance between a node of a tree and the same node of its document, in metres.

    Raises
    ------
    ModelError
        If the document is of a tree with other branches.
    """
    ours, theirs = canonical(tree).skeleton, decode(document).skeleton
    if not np.array_equal(ours.parent, theirs.parent):
        msg = (
            f"the document's tree ({len(theirs)} nodes) is not built as the model ({len(ours)} nodes); "
            "give the document that was encoded from this model"
        )
        raise ModelError(msg)
    offset = (theirs.xyz - ours.xyz) + (theirs.origin - ours.origin)
    return float(np.linalg.norm(offset, axis=1).max())


def walked(text: str, sheet: Document) -> Walk:
    """Follow an L-string with the defaults and the unit of its document."""
    symbols, values = tokens.tokenise(text)
    values = np.where(np.isnan(values), defaults(sheet.dimensions)[symbols], values)
    widths = values[symbols == tokens.WIDTH]
    if not (widths >= 0).all():
        at = int(np.flatnonzero((symbols == tokens.WIDTH) & ~(values >= 0))[0])
        place = tokens.excerpt(text, tokens.position(text, at))
        msg = f"{place} is no radius; write !(r) with r in metres, 0 or more"
        raise InputFormatError(msg)
    path = Walk(*walk(symbols, values, RADIAN if sheet.degrees else 1.0))
    if path.stray >= 0:
        place = tokens.excerpt(text, tokens.position(text, path.stray))
        msg = f"the bracket {place} has no partner; balance [ and ]"
        raise InputFormatError(msg)
    if not np.isfinite(path.xyz).all():
        msg = "the lengths of the L-string add up to more than a number holds; mend its values"
        raise InputFormatError(msg)
    return path


def defaults(sizes: Dimensions) -> Floats:
    """Return the value of every character that has none, NaN where it needs none or must have one."""
    values = np.full(256, np.nan)
    values[tokens.FORWARD] = sizes.forward
    values[[tokens.RIGHT, tokens.LEFT]] = sizes.rotation
    values[[tokens.ROLL_RIGHT, tokens.ROLL_LEFT]] = sizes.roll
    return values


def numbering(path: Walk) -> tuple[NDArray[np.int64], Ints]:
    """Return the walked number of each node in the canonical order, and the parents in that order."""
    wood = carried(path.parent, np.abs(path.length))
    return numbered(path.parent, continued(path.parent, path.bracketed, wood))


def _known(sheet: Document, flat: bool) -> dict[str, Any]:
    """Return the metadata: the tree's name, how it has grown, and flags of that and of a height not told."""
    known: dict[str, Any] = {"id": sheet.id} if sheet.id is not None else {}
    if sheet.growth is not None:
        known["growth"] = _fixed(sheet.growth)
    flags = (FLAT,) * flat + (GROWN,) * (sheet.growth is not None)
    return known | ({"flags": flags} if flags else {})


def _fixed(known: Any) -> Any:
    """Return values of JSON with tuples for arrays: metadata are never changed."""
    if isinstance(known, dict):
        return {key: _fixed(value) for key, value in known.items()}
    return tuple(map(_fixed, known)) if isinstance(known, list) else known


def _trunk(breast: BreastHeight | None, skeleton: Skeleton) -> Trunk | None:
    if breast is None:
        return None
    ground_z = breast.ground - float(skeleton.origin[2])
    sizes = breast.diameter, breast.low, breast.high
    return Trunk(*sizes, breast.arc, breast.source, ground_z)
