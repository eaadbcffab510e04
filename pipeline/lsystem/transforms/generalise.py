"""Generalising: the last steps before every tip become a symbol whose rule is their average.

Only the unforked tail of a branch is ever averaged, by its own length where that is shorter, and the
main axis always keeps its first step. So nothing hangs on what is averaged, and no limb is turned.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from pipeline.errors import ModelError
from pipeline.lsystem.decode import walked
from pipeline.lsystem.document import Document, checked
from pipeline.lsystem.grammar import expand
from pipeline.lsystem.numbering import carried, continued
from pipeline.lsystem.tokens import number
from pipeline.lsystem.transforms.averages import clustered
from pipeline.lsystem.transforms.moves import moves
from pipeline.lsystem.transforms.subtrees import (
    RULE_BYTES,
    Told,
    radii_with,
    replaced,
    rewritten,
    room,
    symbols_beside,
    told_in,
)
from pipeline.model import Floats, Ints
from pipeline.options import Options

SAME_M = 0.00005
"""Radii in the file are rounded by as much."""
_MARK = "\ue000"
Nodes = NDArray[np.int64]


class Rule(NamedTuple):
    """An average: its text, the nodes at which it begins, and the nodes that it draws."""

    text: str
    members: Nodes
    steps: int


class GeneraliseOptions(Options):
    """How much of every branch is averaged, and by how many averages."""

    steps: int = Field(default=1, ge=1, le=10, description="steps before every tip that are averaged")
    rules: int = Field(default=1, ge=1, le=512, description="averages, for the tails of each length")
    seed: int = Field(default=0, ge=0, description="seed of the first guess of the averages")


def generalise(document: Mapping[str, Any], *, options: GeneraliseOptions | None = None) -> dict[str, Any]:
    """Replace the last steps before every tip by averages, as one symbol and its rule.

    Parameters
    ----------
    document : mapping
        An LsJSON, ours or of 2021; rules that it has are applied first.
    options : GeneraliseOptions, optional

    Returns
    -------
    dict
        An LsJSON with as many nodes in the same order, `recursions` 1. The text before the tails is
        the same, so are their nodes. A rule that would not shorten the file is not made: its tails
        stay as they are. Radii of averaged tails are averages or follow the pipe rule, whichever is closer;
        none counts as measured.

    Raises
    ------
    InputFormatError
        As `pipeline.lsystem.decode`.

    References
    ----------
    The synthesis project report of 2021 (Delft), section 3.3.1. Changed: tails end at forks, headings
    are averaged on the sphere instead of their angles, k-means gives more than one rule.
    """
    options = options or GeneraliseOptions()
    told = told_in(document)
    starts, counts = _tails(told, options.steps)
    chosen = []
    for count in range(1, options.steps + 1):
        members = starts[counts == count]
        if len(members) > 1:
            chosen += _averaged(told, members, count, options)
    return _applied(document, told, chosen)


def deviation(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    """Say how far the nodes of a document lie from where another has them, node by node as told.

    Parameters
    ----------
    before, after : mapping
        Documents of as many nodes in the same order, such as `generalise` takes and gives.

    Returns
    -------
    dict
        `nodes`, and of those that a rule of `after` draws `generalised_nodes`; for both `deviation_m`
        and `generalised_deviation_m`: min, max, mean, median and stdev in metres (0 of no nodes).

    Raises
    ------
    ModelError
        If the documents have different numbers of nodes.
    """
    sheets = checked(before), checked(after)
    texts = [expand(sheet.axiom, sheet.rules, sheet.applications) for sheet in sheets]
    one, two = (
        walked(text, sheet).xyz + np.array(sheet.trunk.anchor)
        for text, sheet in zip(texts, sheets, strict=True)
    )
    if len(one) != len(two):
        msg = f"the documents have {len(one)} and {len(two)} nodes; give two documents of one tree"
        raise ModelError(msg)
    apart = np.linalg.norm(one - two, axis=1)
    drawn = apart[_drawn_by_rules(sheets[1])]
    return {
        "nodes": len(apart),
        "deviation_m": _figures(apart),
        "generalised_nodes": len(drawn),
        "generalised_deviation_m": _figures(drawn),
    }


def _figures(values: Floats) -> dict[str, float]:
    if not len(values):
        values = np.zeros(1)
    return {
        "min": float(values.min()),
        "max": float(values.max()),
        "mean": float(values.mean()),
        "median": float(np.median(values)),
        "stdev": float(values.std()),
    }


def _drawn_by_rules(sheet: Document) -> NDArray[np.bool_]:
    """Return the (N,) nodes, as told, whose F comes out of a rule."""
    marked = {symbol: text.replace("F", _MARK) for symbol, text in sheet.rules.items()}
    if "F" in marked:
        marked[_MARK] = marked["F"]
    text = expand(sheet.axiom, marked, sheet.applications)
    return np.array([False, *(letter == _MARK for letter in text if letter in ("F", _MARK))])


def _tails(told: Told, steps: int) -> tuple[Nodes, Nodes]:
    """Return the first node and the number of nodes of every tail, of at most `steps` nodes."""
    parent = told.path.parent
    children = np.bincount(parent[1:], minlength=len(parent))
    start = 1 + np.flatnonzero(children[1:] == 0)
    count = np.ones(len(start), dtype=np.int64)
    for _ in range(steps - 1):
        before = parent[start]
        longer = (before > 0) & (children[before] == 1)
        start, count = np.where(longer, before, start), count + longer
    # The main axis keeps its first step. What is unforked from there is told node after node.
    wood = carried(parent, np.abs(told.path.length))
    axis = start == continued(parent, told.path.bracketed, wood)[0]
    start, count = start + axis, count - axis
    return start[count > 0], count[count > 0]


def _averaged(told: Told, members: Nodes, count: int, options: GeneraliseOptions) -> list[Rule]:
    """Make the rules for all tails of `count` nodes."""
    seen = moves(told, members, count)
    length = np.abs(told.path.length[members[:, None] + np.arange(count)])
    cluster, fit = clustered(seen, length, options.rules, options.seed)
    radius, share = radii_with(told, told.path.length)
    rules = []
    for k in np.unique(cluster).tolist():
        mine = members[cluster == k]
        widths = _widths(radius, share, mine, count, told.path.parent)
        rules.append(Rule(_text(fit.angle[k] / told.radian, fit.length[k], widths, told), mine, count))
    return rules


def _widths(radius: Floats, share: Floats, members: Nodes, count: int, parent: Ints) -> list[float]:
    """Return for each step the mean radius where it is closer than the pipe rule, else NaN."""
    widths, thick = [], radius[parent[members]]
    for node in (members + step for step in range(count)):
        piped, mean = thick * share[node], float(radius[node].mean())
        missed, spread = (float(np.sqrt(((told - radius[node]) ** 2).mean())) for told in (piped, mean))
        is_written = missed > max(spread, SAME_M)
        widths.append(mean if is_written else np.nan)
        thick = np.full(len(node), mean) if is_written else piped
    return widths


def _text(angle: Floats, length: Floats, widths: list[float], told: Told) -> str:
    """Write the steps of a rule; its angles are sums since the foot, in the unit of the document."""
    decimals, whole = (3, 360.0) if told.sheet.degrees else (5, 2 * np.pi)
    pieces, sums = [], np.zeros(2)
    for aim, step, width in zip(angle, length.tolist(), widths, strict=True):
        turn = np.round((aim - sums + whole / 2) % whole - whole / 2, decimals)
        sums = sums + turn
        for value, signs in zip(turn.tolist(), ("+-", "><"), strict=True):
            pieces.append(f"{signs[value < 0]}({number(abs(value))})" if value else "")
        pieces.append("" if np.isnan(width) else f"!({number(round(width, 4))})")
        pieces.append(f"F({number(round(step, 6))})")
    return "".join(pieces)


def _applied(document: Mapping[str, Any], told: Told, found: list[Rule]) -> dict[str, Any]:
    """Put the rules that pay in place of their tails, the most used ones under the shortest symbols."""
    symbols = symbols_beside(told.text)
    rules, place = {}, {}
    inexact = np.zeros(len(told.size), dtype=bool)
    for rule in sorted(found, key=lambda rule: -len(rule.members)):
        symbol = next(symbols, None)
        if symbol is None:
            break
        saved = int((told.end - told.begin)[rule.members].sum()) - len(rule.members) * room(symbol)
        if saved > len(rule.text) + room(symbol) + RULE_BYTES:
            rules[symbol] = rule.text
            place.update(dict.fromkeys(rule.members.tolist(), symbol))
            inexact[rule.members[:, None] + np.arange(rule.steps)] = True
    starts = sorted(place)
    axiom = replaced(told, starts, [place[start] for start in starts])
    return rewritten(document, told, axiom, rules, inexact)
