"""Factoring: what stands several times in a text is told once, as a rule. Nothing is lost.

Equal sub-trees are one class. A class that pays for itself becomes a rule, and rules may hold the
symbols of smaller ones.
"""

from __future__ import annotations

from collections.abc import Sequence

from pipeline.lsystem.transforms.subtrees import RULE_BYTES, Told, room, symbols_beside

ROUNDS = 8
"""Times that the choice of rules is gone over; most trees need three."""

Part = str | int
"""A piece of text, or the number of a class that stands there."""


class Classes:
    """The sub-trees of a text; equal ones share a number, and parts have smaller ones than the whole.

    Parameters
    ----------
    told : Told
    """

    def __init__(self, told: Told) -> None:
        self._told = told
        self._numbers: dict[tuple[Part, ...], int] = {}
        self.parts: list[tuple[Part, ...]] = []
        self.of_node = self._classify({})

    def with_repeats(self, repeats: dict[int, int]) -> int:
        """Return the class of the whole tree with other sub-trees in place of some.

        Parameters
        ----------
        repeats : dict of int to int
            The first node of the sub-tree, and of that which stands in for it.
        """
        return self._classify(repeats)[0]

    def _classify(self, repeats: dict[int, int]) -> list[int]:
        """Return the (N,) class of every sub-tree, children before parents."""
        told = self._told
        text, begin, end = told.text, told.begin.tolist(), told.end.tolist()
        below: list[list[int]] = [[] for _ in begin]
        for node, foot in enumerate(told.path.parent[1:].tolist(), 1):
            below[foot].append(node)
        found = [0] * len(begin)
        for node in range(len(begin) - 1, -1, -1):
            if node in repeats:
                found[node] = self.of_node[repeats[node]]
                continue
            parts: list[Part] = []
            done = begin[node]
            for child in below[node]:
                parts += [text[done : begin[child]], found[child]]
                done = end[child]
            parts.append(text[done : end[node]])
            found[node] = self._number(tuple(parts))
        return found

    def _number(self, parts: tuple[Part, ...]) -> int:
        number = self._numbers.setdefault(parts, len(self.parts))
        if number == len(self.parts):
            self.parts.append(parts)
        return number


def factored(classes: Classes, whole: int) -> tuple[str, dict[str, str]]:
    """Write a tree with a rule for every class that pays for itself.

    Parameters
    ----------
    classes : Classes
    whole : int
        The class of the tree.

    Returns
    -------
    axiom : str
    rules : dict of str to str
        The most used ones have the shortest symbols.
    """
    ruled, uses = _chosen(classes.parts, whole)
    symbols = symbols_beside(_spelled(classes.parts, whole, {}))
    order = sorted(ruled, key=lambda c: (-uses[c], -c))
    names = dict(zip(order, symbols, strict=False))
    rules = {name: _spelled(classes.parts, c, names) for c, name in names.items()}
    return _spelled(classes.parts, whole, names), rules


def written_bytes(axiom: str, rules: dict[str, str]) -> int:
    """Return the bytes that an axiom and its rules, with their quotes and commas, take in the file."""
    return room(axiom) + sum(room(name) + room(text) + RULE_BYTES for name, text in rules.items())


def _chosen(parts: Sequence[tuple[Part, ...]], whole: int) -> tuple[set[int], list[int]]:
    """Choose the classes that become rules; returns them and how often each class stands in the file.

    Whether a rule pays depends on the rules within it and around it. So the choice starts from all
    classes as rules and is gone over until it stands or gets no better.
    """
    own = [sum(len(p) for p in pieces if isinstance(p, str)) for pieces in parts]
    below = [[p for p in pieces if isinstance(p, int)] for pieces in parts]
    uses = _uses(below, set(range(whole)), whole)
    best: tuple[set[int], list[int]] = set(), uses
    least, count = sum(own), 0
    for turn in range(ROUNDS):
        name = 1 if count <= 40 else 2 if count <= 160 else 3
        ruled, written, total = set(), own.copy(), 0
        for c in range(whole + 1):
            if not uses[c]:
                continue
            written[c] += sum(name if child in ruled else written[child] for child in below[c])
            body = written[c]
            if c < whole and uses[c] * (body - name) > body + name + RULE_BYTES:
                ruled.add(c)
                total += body + name + RULE_BYTES
        total += written[whole]
        uses = _uses(below, ruled, whole)
        if turn and total >= least:
            break
        least, count, best = total, len(ruled), (ruled, uses)
    return best


def _uses(below: Sequence[Sequence[int]], ruled: set[int], whole: int) -> list[int]:
    """Return how often each class is written, alone or within another, if each rule is written once."""
    uses = [0] * len(below)
    uses[whole] = 1
    for c in range(whole, -1, -1):
        times = min(uses[c], 1) if c in ruled else uses[c]
        if times:
            for child in below[c]:
                uses[child] += times
    return uses


def _spelled(parts: Sequence[tuple[Part, ...]], whole: int, names: dict[int, str]) -> str:
    """Write a class out, with names in place of the classes inside it that have one."""
    pieces: list[str] = []
    waiting: list[Part] = [*reversed(parts[whole])]
    while waiting:
        part = waiting.pop()
        if isinstance(part, str):
            pieces.append(part)
        elif part in names:
            pieces.append(names[part])
        else:
            waiting.extend(reversed(parts[part]))
    return "".join(pieces)
