"""Sub-trees of a document as pieces of its text: where they stand, and what a rule would make of them.

Whatever follows a node up to the bracket that ends its level hangs on that node, in our documents
and in those of 2021. So every sub-tree is one piece of text, and a symbol of a rule may stand for it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from typing import Any, NamedTuple
from unicodedata import normalize

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.lsystem import tokens
from pipeline.lsystem.decode import defaults, numbering, walked
from pipeline.lsystem.document import FORMAT, VERSION, Document, checked
from pipeline.lsystem.grammar import expand
from pipeline.lsystem.loop import RADIAN
from pipeline.lsystem.numbering import carried
from pipeline.lsystem.radii import grow_radii, shares, sources, sources_text
from pipeline.lsystem.turtle import CLOSE, FORWARD, LEFT, OPEN, RIGHT, ROLL_LEFT, ROLL_RIGHT, WIDTH, Walk
from pipeline.model import MEASURED, PROPAGATED, Floats, Ints

RULE_BYTES = 8
"""What a rule takes in the file beside its symbol and its text: quotes, colon, comma."""

_SCRIPTS = ((0x3B1, 0x3C9), (0x391, 0x3A9), (0x430, 0x44F), (0x410, 0x42F), (0x561, 0x586), (0x4E00, 0x9FA5))
"""Greek, Cyrillic, Armenian, Chinese: letters of 2, then 3 bytes, read from left to right."""


class Told(NamedTuple):
    """An expanded document, node by node in the order of its text; node 0 is the root.

    Parameters
    ----------
    text : str
        Every ``!`` stands with the F that it is for.
    sheet : Document
    path : Walk
    begin, head, end : (N,) array of int64
        Characters at which the turns of a node begin, its own F is over, and its sub-tree is over.
    size : (N,) array of int64
        Nodes of the sub-tree, its own included: they are the next ones.
    foot : (N, 2) array of float64
        Accumulated rotation and roll before the turns of each node, in radians.
    aim : (N, 2) array of float64
        The same after them: the heading of its segment.
    """

    text: str
    sheet: Document
    path: Walk
    begin: NDArray[np.int64]
    head: NDArray[np.int64]
    end: NDArray[np.int64]
    size: NDArray[np.int64]
    foot: Floats
    aim: Floats

    @property
    def radian(self) -> float:
        """One unit of the document's angles in radians."""
        return RADIAN if self.sheet.degrees else 1.0


def told_in(document: Mapping[str, Any]) -> Told:
    """Expand a document and find its sub-trees.

    Raises
    ------
    InputFormatError
        As `pipeline.lsystem.decode`.
    """
    sheet = checked(document)
    text = expand(sheet.axiom, sheet.rules, sheet.applications)
    path = walked(text, sheet)
    symbols, values = tokens.tokenise(text)
    if _has_stray_widths(symbols):
        text = _with_widths_in_place(text, path)
        symbols, values = tokens.tokenise(text)
    values = np.where(np.isnan(values), defaults(sheet.dimensions)[symbols], values)
    begin, head, end, foot, aim = trace(symbols, values)
    starts, stops = _places(text)
    radian = RADIAN if sheet.degrees else 1.0
    size = _sizes(path.parent)
    return Told(text, sheet, path, starts[begin], stops[head], starts[end], size, foot * radian, aim * radian)


@compiled
def trace(
    symbols: NDArray[np.uint8], values: Floats
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], Floats, Floats]:
    """Find the tokens and the angles of every node; see `Told`, in tokens and in the text's units.

    Parameters
    ----------
    symbols : (T,) array of uint8
        With brackets that match.
    values : (T,) array of float64
        With the default angles filled in.
    """
    count, room = 1 + (symbols == FORWARD).sum(), 1 + (symbols == OPEN).sum()
    begin, head = np.zeros(count, dtype=np.int64), np.full(count, -1, dtype=np.int64)
    end = np.full(count, len(symbols), dtype=np.int64)
    foot, aim, kept = np.zeros((count, 2)), np.zeros((count, 2)), np.zeros((room, 2))
    waiting, level = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    last, depth, held, start = 0, 0, 0, 0
    rot, roll, rot_before, roll_before = 0.0, 0.0, 0.0, 0.0
    for t in range(len(symbols)):
        symbol = symbols[t]
        if symbol == RIGHT:
            rot += values[t]
        elif symbol == LEFT:
            rot -= values[t]
        elif symbol == ROLL_RIGHT:
            roll += values[t]
        elif symbol == ROLL_LEFT:
            roll -= values[t]
        elif symbol == FORWARD:
            last += 1
            begin[last], head[last] = start, t
            foot[last, 0], foot[last, 1] = rot_before, roll_before
            aim[last, 0], aim[last, 1] = rot, roll
            waiting[held], level[held] = last, depth
            held += 1
        elif symbol == OPEN:
            kept[depth, 0], kept[depth, 1] = rot, roll
            depth += 1
        elif symbol == CLOSE:
            while held > 0 and level[held - 1] == depth:
                held -= 1
                end[waiting[held]] = t
            depth -= 1
            rot, roll = kept[depth, 0], kept[depth, 1]
        if symbol in (FORWARD, OPEN, CLOSE):
            start, rot_before, roll_before = t + 1, rot, roll
    return begin, head, end, foot, aim


@compiled
def _sizes(parent: Ints) -> NDArray[np.int64]:
    """Return the (N,) nodes of every sub-tree, its own included."""
    size = np.ones(len(parent), dtype=np.int64)
    for i in range(len(parent) - 1, 0, -1):
        size[parent[i]] += size[i]
    return size


def _places(text: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return where each token begins, and the end of the text; where each is over, and 0."""
    spans = chain.from_iterable([match.span() for match in tokens.TOKEN.finditer(text)])
    places = np.fromiter(spans, dtype=np.int64)
    return np.append(places[::2], len(text)), np.append(places[1::2], 0)


def _has_stray_widths(symbols: NDArray[np.uint8]) -> bool:
    """Tell whether a ``!`` is for an F behind a bracket, or for none: no piece of text could hold it."""
    stops = np.flatnonzero(np.isin(symbols, (FORWARD, OPEN, CLOSE)))
    nearest = np.searchsorted(stops, np.flatnonzero(symbols == WIDTH))
    ahead = np.append(symbols[stops], np.uint8(CLOSE))
    return bool((ahead[nearest] != FORWARD).any())


def _with_widths_in_place(text: str, path: Walk) -> str:
    """Write every ``!`` right before the F that it is for."""
    widths = iter(path.width[1:].tolist())
    pieces, done = [], 0
    for match in tokens.TOKEN.finditer(text):
        if match[1] in "F!":
            width = next(widths) if match[1] == "F" else np.nan
            pieces += [text[done : match.start()], "" if np.isnan(width) else f"!({width!r})"]
            done = match.start() if match[1] == "F" else match.end()
    return "".join(pieces) + text[done:]


def radii_with(told: Told, length: Floats) -> tuple[Floats, Floats]:
    """Return the (N,) radii that the document has with such lengths, and the factors of the pipe rule."""
    parent, given = told.path.parent, told.path.width.copy()
    given[0] = told.sheet.trunk.radius
    share = shares(parent, carried(parent, length), told.sheet.radius.exponent)
    return grow_radii(parent, share, given), share


def symbols_beside(text: str) -> Iterator[str]:
    """Yield characters that may stand for rules: letters that the text does not hold, short ones first.

    ``F`` moves, and ``e`` and ``E`` may come with the next number that is written.
    """
    latin = "XYZABCDGHIJKLMNOPQRSTUVWabcdfghijklmnopqrstuvwxyz"
    others = chain.from_iterable(map(chr, range(low, high + 1)) for low, high in _SCRIPTS)
    lasting = (letter for letter in others if letter.isalpha() and normalize("NFKD", letter) == letter)
    taken = set(text)
    return (letter for letter in chain(latin, lasting) if letter not in taken)


def room(symbol: str) -> int:
    """Return the bytes of a symbol in the file."""
    return len(symbol.encode())


def replaced(told: Told, starts: Iterable[int], texts: Iterable[str]) -> str:
    """Put other texts in place of the sub-trees that begin at the nodes `starts`, in ascending order."""
    begin, end = told.begin.tolist(), told.end.tolist()
    pieces, done = [], 0
    for start, text in zip(starts, texts, strict=True):
        pieces += [told.text[done : begin[start]], text]
        done = end[start]
    return "".join(pieces) + told.text[done:]


def rewritten(
    document: Mapping[str, Any], told: Told, axiom: str, rules: dict[str, str], inexact: NDArray[np.bool_]
) -> dict[str, Any]:
    """Give a document another text for the same nodes, told in the same order.

    Parameters
    ----------
    document : mapping
    told : Told
        What is in it.
    axiom, rules
        The other text; rules may hold the symbols of others.
    inexact : (N,) array of bool
        Nodes, as told, whose radius is no longer the one that was measured.
    """
    recursions = _depth(rules)
    wording = {"recursions": recursions, "rules": rules, "axiom": axiom}
    ours = {**document, "format": {"name": FORMAT, "version": VERSION}, **wording}
    known = told.sheet.radius.source
    if known is not None:
        before = after = numbering(told.path)[0]
        if _weight_decides(told.path):
            after = numbering(walked(expand(axiom, rules, recursions), told.sheet))[0]
        source = np.empty(len(before), dtype=np.uint8)
        source[before] = sources(known, len(before))
        source[inexact & (source == MEASURED)] = PROPAGATED
        ours["radius"] = {**document["radius"], "source": sources_text(source[after])}
    return ours


def _weight_decides(path: Walk) -> bool:
    """Tell whether somewhere all children are in brackets, so that numbers depend on lengths."""
    outside = np.zeros(len(path.parent), dtype=bool)
    outside[path.parent[1:][~path.bracketed[1:]]] = True
    return not outside[path.parent[1:]].all()


def _depth(rules: Mapping[str, str]) -> int:
    """Return how often rules must be applied, at least once, until none of their symbols is left."""
    depth = 1
    left = set(rules)
    while left := {s for text in (rules[symbol] for symbol in left) for s in set(text) & set(rules)}:
        depth += 1
    return depth
