"""Random crowns, and the shortest system by trying every mother of every leaf."""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from pipeline.skeleton.minimal.problem import Axes, Problem, System

Floats = NDArray[np.float64]
ANGLE = (42.5,)


def crown(count: int, seed: int, insertion_deg: tuple[float, ...] = ANGLE) -> Problem:
    """Leaves in an ellipsoid around a trunk of 11.2 m."""
    rng = np.random.default_rng(seed)
    way = rng.normal(size=(count, 3))
    way *= rng.uniform(0, 1, (count, 1)) ** (1 / 3) / np.linalg.norm(way, axis=1, keepdims=True)
    trunk = Axes.trunk(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 11.2]]))
    return Problem(way * [3, 3, 4] + [0, 0, 7], trunk, np.radians(insertion_deg))


def connection(
    leaf: Floats, base: Floats, tip: Floats, beyond: float, angle: float
) -> tuple[Floats, float] | None:
    """Start and length of a branch, by the bifurcation angle as the paper has it; None if it may not be."""
    size = math.dist(base, tip)
    if size == 0.0:
        return None
    u = (tip - base) / size
    foot = base + ((leaf - base) @ u) * u
    d = math.dist(leaf, foot)
    phi = math.pi - angle
    point = foot - u * d / math.tan(math.pi - phi)
    s, c = float((point - base) @ u), d / math.sin(math.pi - phi)
    return (point, c) if 0 <= s <= size and c <= size - s + beyond else None


def by_force(problem: Problem) -> tuple[int, float]:
    """Leaves that are not reached and least length, over all parent functions (mother or none)."""
    count, roots = len(problem), len(problem.roots)
    known: dict[tuple[int, ...], tuple[Floats, float] | None] = {}

    def place(history: tuple[int, ...]) -> tuple[Floats, float] | None:
        """Start and length of a branch, given the names of all axes down to the root."""
        if history not in known:
            leaf, mother = history[0] - roots, history[1]
            n = len(history) - 2
            angle = problem.insertion[min(n, len(problem.insertion) - 1)]
            if mother < roots:
                axis = (problem.roots.base[mother], problem.roots.tip[mother], problem.roots.beyond[mother])
            else:
                below = place(history[1:])
                axis = (below[0], problem.leaves[mother - roots], 0.0) if below else None
            known[history] = connection(problem.leaves[leaf], *axis, angle) if axis else None
        return known[history]

    def reached(mothers: tuple[int, ...], i: int) -> float | None:
        """Length of a leaf's branch; nan while a mother on its way is undecided, None if it may not be."""
        history, m = [roots + i], mothers[i]
        while m >= roots:
            if m in history or (m - roots < len(mothers) and mothers[m - roots] < 0):
                return None
            history.append(m)
            if m - roots >= len(mothers):
                return math.nan
            m = mothers[m - roots]
        found = place((*history, m))
        return found[1] if found else None

    def tried(mothers: tuple[int, ...]) -> tuple[int, float]:
        """Best of all parent functions that begin so; only beginnings that may not be are cut off."""
        lengths = [reached(mothers, i) for i, m in enumerate(mothers) if m >= 0]
        if None in lengths:
            return (count + 1, 0.0)
        if len(mothers) == count:
            return (mothers.count(-1), sum(lengths))
        return min(tried((*mothers, m)) for m in range(-1, roots + count))

    return tried(())


def by_dull_force(problem: Problem) -> tuple[int, float]:
    """Find the same without cutting anything off."""
    count, roots = len(problem), len(problem.roots)
    best = (count, 0.0)
    for mothers in itertools.product(range(-1, roots + count), repeat=count):
        found: dict[int, tuple[Floats, float]] = {}
        waiting = [i for i, m in enumerate(mothers) if m >= 0]
        order: dict[int, int] = {}
        while waiting:
            ready = [i for i in waiting if mothers[i] < roots or mothers[i] - roots in found]
            for i in ready:
                m = mothers[i]
                if m < roots:
                    axis = (problem.roots.base[m], problem.roots.tip[m], problem.roots.beyond[m])
                    order[i] = 1
                else:
                    axis = (found[m - roots][0], problem.leaves[m - roots], 0.0)
                    order[i] = order[m - roots] + 1
                angle = problem.insertion[min(order[i], len(problem.insertion)) - 1]
                here = connection(problem.leaves[i], *axis, angle)
                if here:
                    found[i] = here
            left = [i for i in waiting if i not in found]
            if len(left) == len(waiting):
                break
            waiting = left
        if not waiting:
            best = min(best, (mothers.count(-1), sum(c for _, c in found.values())))
    return best


def broken_rules(system: System) -> list[str]:
    """Say what a strict system does not keep: angles by order, places on mothers, apical dominance."""
    problem, roots, out = system.problem, system.problem.roots, []
    for i in np.flatnonzero(~system.free & (system.off_angle == 0.0)):
        m = system.mother[i]
        inside = m < len(roots)
        base = roots.base[m] if inside else system.base[m - len(roots)]
        tip = roots.tip[m] if inside else problem.leaves[m - len(roots)]
        beyond = roots.beyond[m] if inside else 0.0
        order = roots.order[m] if inside else system.order[m - len(roots)]
        way, along = problem.leaves[i] - system.base[i], tip - base
        c, size = np.linalg.norm(way), np.linalg.norm(along)
        if not inside and (system.free[m - len(roots)] or size == 0.0):
            out.append(f"{i} hangs on nothing")
            continue
        s = (system.base[i] - base) @ along / size
        wanted = problem.insertion[min(order, len(problem.insertion) - 1)]
        if system.order[i] != order + 1:
            out.append(f"{i} has the wrong order")
        if abs(c - system.length[i]) > 1e-7:
            out.append(f"{i} has the wrong length")
        if np.linalg.norm(base + along * s / size - system.base[i]) > 1e-7 or not -1e-7 <= s <= size + 1e-7:
            out.append(f"{i} starts off its mother")
        if c > size - s + beyond + 1e-7:
            out.append(f"{i} is longer than what its mother has left")
        if c > 1e-4 and abs(np.arccos(np.clip(way @ along / c / size, -1, 1)) - wanted) > 1e-6:
            out.append(f"{i} leaves at the wrong angle")
    return out
