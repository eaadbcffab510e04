"""Smoothing: Whittaker's curve along chains, and monotone (isotonic) fits along chains and trees."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@compiled
def whittaker(values: Floats, weight: Floats, stiffness: float) -> Floats:
    """Smooth values by least squares with a penalty on second differences.

    Minimises ``sum w_i |y_i - z_i|^2 + stiffness sum |z_{i-1} - 2 z_i + z_{i+1}|^2``.

    Parameters
    ----------
    values : (N, D) array
    weight : (N,) array
        At least two above zero.
    stiffness : float

    Returns
    -------
    (N, D) array

    References
    ----------
    Whittaker (1923); Eilers (2003), "A perfect smoother".
    """
    if len(values) < 3:
        return values.copy()
    main, one, two = _penalty(len(values), stiffness)
    main += weight + 1e-9
    _factorise(main, one, two)
    out = values * (weight + 1e-9).reshape(-1, 1)
    count = len(values)
    for d in range(values.shape[1]):
        for i in range(1, count):
            out[i, d] -= one[i - 1] * out[i - 1, d]
            if i >= 2:
                out[i, d] -= two[i - 2] * out[i - 2, d]
        for i in range(count - 1, -1, -1):
            out[i, d] /= main[i]
            if i + 1 < count:
                out[i, d] -= one[i] * out[i + 1, d]
            if i + 2 < count:
                out[i, d] -= two[i] * out[i + 2, d]
    return out


@compiled
def _penalty(count: int, stiffness: float) -> tuple[Floats, Floats, Floats]:
    """Diagonals of stiffness D'D, D the second differences."""
    main, one, two = np.zeros(count), np.zeros(count), np.zeros(count)
    for i in range(count - 2):
        main[i] += stiffness
        main[i + 1] += 4.0 * stiffness
        main[i + 2] += stiffness
        one[i] -= 2.0 * stiffness
        one[i + 1] -= 2.0 * stiffness
        two[i] += stiffness
    return main, one, two


@compiled
def _factorise(main: Floats, one: Floats, two: Floats) -> None:
    """Turn the diagonals of a five-banded matrix into its factors L D L', in place."""
    for i in range(len(main)):
        if i >= 1:
            main[i] -= main[i - 1] * one[i - 1] ** 2
        if i >= 2:
            main[i] -= main[i - 2] * two[i - 2] ** 2
        if i >= 1:
            one[i] -= main[i - 1] * one[i - 1] * two[i - 1]
        one[i] /= main[i]
        two[i] /= main[i]


@compiled
def falling(values: Floats, weight: Floats) -> Floats:
    """Weighted least-squares fit that never rises (pool adjacent violators).

    Parameters
    ----------
    values : (N,) array
    weight : (N,) array
        Above zero.

    References
    ----------
    Ayer, Brunk, Ewing, Reid & Silverman (1955).
    """
    count = len(values)
    mean, mass, size = np.empty(count), np.empty(count), np.empty(count, dtype=np.int64)
    top = 0
    for i in range(count):
        mean[top], mass[top], size[top] = values[i], weight[i], 1
        while top > 0 and mean[top] > mean[top - 1]:
            both = mass[top] + mass[top - 1]
            mean[top - 1] = (mean[top] * mass[top] + mean[top - 1] * mass[top - 1]) / both
            mass[top - 1] = both
            size[top - 1] += size[top]
            top -= 1
        top += 1
    out = np.empty(count)
    at = 0
    for block in range(top):
        out[at : at + size[block]] = mean[block]
        at += size[block]
    return out


@compiled
def falling_tree(values: Floats, weight: Floats, parent: Ints) -> Floats:
    """Weighted least-squares fit on a rooted tree in which no node exceeds its parent.

    From the tips inwards every node starts a block of its own and takes in its largest child block for
    as long as that one exceeds its mean.

    Parameters
    ----------
    values : (N,) array
    weight : (N,) array
        Above zero.
    parent : (N,) array of int
        Parents before children; -1 at roots.

    References
    ----------
    Pardalos & Xue (1999), "Algorithms for a class of isotonic regression problems".
    """
    count = len(values)
    mean, mass = values.copy(), weight.copy()
    # children of every block as a leftist heap: the largest mean on top
    top = np.full(count, -1, dtype=np.int64)
    left, right = np.full(count, -1, dtype=np.int64), np.full(count, -1, dtype=np.int64)
    rank = np.ones(count, dtype=np.int64)
    held_by = np.full(count, -1, dtype=np.int64)
    for i in range(count - 1, -1, -1):
        while top[i] >= 0 and mean[top[i]] > mean[i]:
            child = top[i]
            both = mass[i] + mass[child]
            mean[i] = (mean[i] * mass[i] + mean[child] * mass[child]) / both
            mass[i] = both
            held_by[child] = i
            rest = _meld(left[child], right[child], mean, left, right, rank)
            top[i] = _meld(rest, top[child], mean, left, right, rank)
        left[i] = right[i] = -1
        rank[i] = 1
        if parent[i] >= 0:
            top[parent[i]] = _meld(top[parent[i]], i, mean, left, right, rank)
    out = np.empty(count)
    for i in range(count):
        if held_by[i] >= 0:
            mean[i] = mean[held_by[i]]
        out[i] = mean[i]
    return out


@compiled
def _meld(a: int, b: int, key: Floats, left: Ints, right: Ints, rank: Ints) -> int:
    """Join two leftist heaps along their right spines and return the top."""
    if a < 0:
        return b
    if b < 0:
        return a
    spine = np.empty(128, dtype=np.int64)  # a right spine has log2(N) nodes at most
    length = 0
    while a >= 0 and b >= 0:
        if key[b] > key[a]:
            a, b = b, a
        spine[length] = a
        length += 1
        a = right[a]
    below = a if a >= 0 else b
    for k in range(length - 1, -1, -1):
        node = spine[k]
        right[node] = below
        if left[node] < 0 or rank[left[node]] < rank[right[node]]:
            left[node], right[node] = right[node], left[node]
        rank[node] = 1 + (rank[right[node]] if right[node] >= 0 else 0)
        below = node
    return below
