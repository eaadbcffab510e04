"""Twins in plain Python of the compiled drawing: branch by branch, ring by ring, pair by pair."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pipeline.mesh import TubeOptions
from pipeline.mesh.rings import Planes, Rings
from pipeline.mesh.surface import MITRE, corner_share, side_counts
from pipeline.model import Floats, Ints, TreeModel


class Drawing(NamedTuple):
    """Vertices, faces, branch and uv of a mesh."""

    vertices: Floats
    faces: Ints
    branch: Ints
    uv: Floats


def drawing(tree: TreeModel, options: TubeOptions, tile_m: float) -> Drawing:
    """Draw a tree branch by branch."""
    parts = [Drawing(np.zeros((0, 3)), np.zeros((0, 3), int), np.zeros(0, int), np.zeros((0, 3, 2)))]
    placed = 0
    for branch, path in enumerate(tree.skeleton.paths):
        if len(path) > 1:
            rings = rings_on(tree, path, options)
            kept, vertices, faces = tube(rings, options.ring_gap_m)
            uv = wrapped(rings, kept, faces, tile_m)
            parts.append(Drawing(vertices, faces + placed, np.full(len(faces), branch), uv))
            placed += len(vertices)
    return Drawing(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def rings_on(tree: TreeModel, path: Ints, options: TubeOptions) -> Rings:
    radius = tree.radius[path]
    radius[0] = tree.start_radius[path[1]]
    radius = np.maximum(radius, options.min_radius_m)
    sides = side_counts(radius, options)
    corner = radius * corner_share(sides)
    edge = 2 * corner * np.sin(np.pi / sides)
    return Rings(tree.skeleton.xyz[path], corner, sides, edge, np.zeros(len(path), dtype=bool))


def tube(rings: Rings, gap: float) -> tuple[Ints, Floats, Ints]:
    kept = apart(rings.points, gap)
    while len(kept) > 1:
        now = Rings(*(column[kept] for column in rings))
        planes = ring_planes(now.points)
        lost = crossing(now, planes, gap)
        if not lost:
            first = np.concatenate([[0], np.cumsum(now.sides)])
            vertices, faces = ring_corners(now, planes), skin(first)
            one = flat_ring(vertices, faces, first, min(gap, now.edge.min()) / 3)
            if one < 0:
                one = touching_ring(vertices, first, now, planes, gap)
            if one < 0:
                return kept, vertices, faces
            lost = [one]
        kept = np.delete(kept, lost)
    return kept[:0], np.zeros((0, 3)), np.zeros((0, 3), dtype=int)


def apart(points: Floats, gap: float) -> Ints:
    kept = [0]
    for i in range(1, len(points)):
        if size(points[i] - points[kept[-1]]) >= gap:
            kept.append(i)
    if len(kept) > 1:
        kept[-1] = len(points) - 1
    if len(kept) > 2 and size(points[-1] - points[kept[-2]]) < gap:
        kept[-2:] = [len(points) - 1]
    return np.array(kept)


def dot(a: Floats, b: Floats) -> float:
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def size(a: Floats) -> float:
    return math.sqrt(dot(a, a))


def unit(a: Floats) -> Floats:
    return a / size(a) if size(a) >= 1e-12 else np.array([0.0, 0.0, 1.0])


def across(axis: Floats) -> Floats:
    return unit(np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))]))


def turned(a: Floats, old: Floats, new: Floats) -> Floats:
    out = a + -dot(old + new, a) / (1.0 + dot(old, new)) * (old + new)
    out = out + 2.0 * dot(old, a) * new
    return unit(out + -dot(out, new) * new)


def ring_planes(points: Floats) -> Planes:
    way = [unit(step) for step in np.diff(points, axis=0)]
    axis, bent, stretch = np.zeros((len(points), 3)), np.zeros((len(points), 3)), np.ones(len(points))
    axis[0], axis[-1] = way[0], way[-1]
    for k in range(1, len(points) - 1):
        half = 0.5 * way[k - 1] + 0.5 * way[k]
        share = size(half)
        axis[k] = unit(half) if share > 1e-6 else across(way[k - 1])
        if share < 1 - 1e-12:
            bent[k] = unit(way[k - 1] + -dot(way[k - 1], axis[k]) * axis[k])
            stretch[k] = 1.0 / share if share * MITRE > 1.0 else MITRE
    return Planes(axis, bent, stretch)


def reach(k: int, direction: Floats, planes: Planes) -> float:
    circle = 1.0 - dot(planes.axis[k], direction) ** 2
    drawn_out = (planes.stretch[k] ** 2 - 1.0) * dot(planes.bent[k], direction) ** 2
    return math.sqrt(max(circle + drawn_out, 0.0))


def crossing(rings: Rings, planes: Planes, gap: float) -> list[int]:
    lost, last, k = [], len(rings.points) - 1, 0
    while k < last:
        step = rings.points[k + 1] - rings.points[k]
        above = dot(step, planes.axis[k]) - rings.corner[k + 1] * reach(k + 1, planes.axis[k], planes)
        below = dot(step, planes.axis[k + 1]) - rings.corner[k] * reach(k, planes.axis[k + 1], planes)
        wide = rings.corner[k] * planes.stretch[k] + rings.corner[k + 1] * planes.stretch[k + 1]
        if min(above, below) < gap and size(step) < wide + gap:
            earlier = k > 0 and (k + 1 == last or planes.stretch[k] > planes.stretch[k + 1])
            lost.append(k if earlier else k + 1)
            k = lost[-1] + 1
        k += 1
    return lost


def ring_corners(rings: Rings, planes: Planes) -> Floats:
    corners = []
    before = planes.axis[0]
    right = across(before)
    for k, centre in enumerate(rings.points):
        right = turned(right, before, planes.axis[k])
        ahead = np.cross(planes.axis[k], right)
        for i in range(rings.sides[k]):
            turn = 2 * math.pi * i / int(rings.sides[k])
            arm = math.cos(turn) * right + math.sin(turn) * ahead
            arm = arm + (planes.stretch[k] - 1.0) * dot(planes.bent[k], arm) * planes.bent[k]
            corners.append(centre + rings.corner[k] * arm)
        if k < len(rings.points) - 1:
            before = unit(rings.points[k + 1] - centre)
            right = turned(right, planes.axis[k], before)
    return np.array(corners)


def skin(first: Ints) -> Ints:
    faces = []
    for k in range(len(first) - 2):
        na, nb = int(first[k + 1] - first[k]), int(first[k + 2] - first[k + 1])
        i = j = 0
        while i < na or j < nb:
            low, high = first[k] + i % na, first[k + 1] + j % nb
            if j == nb or (i < na and (i + 1) * nb <= (j + 1) * na):
                i += 1
                faces.append((low, first[k] + i % na, high))
            else:
                j += 1
                faces.append((low, first[k + 1] + j % nb, high))
    for k in (0, len(first) - 2):
        strip = list(range(first[k], first[k + 1]))
        from_low = True
        while len(strip) > 2:
            low, high, middle = strip[0], strip[-1], strip[1 if from_low else -2]
            faces.append((low, high, middle) if k == 0 else (low, middle, high))
            strip.pop(0 if from_low else -1)
            from_low = not from_low
    return np.array(faces)


def flat_ring(vertices: Floats, faces: Ints, first: Ints, flat: float) -> int:
    ring = np.repeat(np.arange(len(first) - 1), np.diff(first))
    for face in faces:
        low, high = ring[face].min(), ring[face].max()
        u, v = vertices[face[1]] - vertices[face[0]], vertices[face[2]] - vertices[face[0]]
        if low < high and size(np.cross(u, v)) < flat * max(size(u), size(v), size(u - v)):
            return left_out(low, high, len(first) - 2)
    return -1


def touching_ring(vertices: Floats, first: Ints, rings: Rings, planes: Planes, gap: float) -> int:
    """Try every pair of rings."""
    widest = rings.corner * planes.stretch
    last = len(rings.points) - 1
    for low in range(last + 1):
        for high in range(low + 2, last + 1):
            step = rings.points[high] - rings.points[low]
            near = size(step) < widest[low] + widest[high] + gap
            if near and dot(step, planes.axis[low]) < widest[high] + gap:
                a, b = vertices[first[low] : first[low + 1]], vertices[first[high] : first[high + 1]]
                if np.linalg.norm(a[:, None] - b, axis=2).min() < gap:
                    return left_out(low, high, last)
    return -1


def left_out(low: int, high: int, last: int) -> int:
    return low if high == last and low > 0 else high


def wrapped(rings: Rings, kept: Ints, faces: Ints, tile_m: float) -> Floats:
    """(F, 3, 2) places of the corners of one tube in pictures of bark."""
    if not len(faces):
        return np.zeros((0, 3, 2))
    sides, corner = rings.sides[kept], rings.corner[kept]
    run = np.linalg.norm(np.diff(rings.points[kept], axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(run)]) / tile_m
    girth = 2 * np.pi * float(((corner[1:] + corner[:-1]) * run).sum() / (2 * run.sum()))
    share = np.concatenate([np.arange(count) / count for count in sides.tolist()])
    u = share[faces]
    u = u + ((u < 0.5) & (np.ptp(u, axis=1) > 0.5)[:, None])
    out = np.stack([u * max(1, round(girth / tile_m)), np.repeat(along, sides)[faces]], axis=2)
    count = int(sides[0] + sides[-1]) - 4
    ends = faces[len(faces) - count :]
    turn = 2 * np.pi * share[ends]
    wide = np.repeat(corner, sides)[ends][:, :, None] / tile_m
    out[len(out) - count :] = wide * np.stack([np.cos(turn), np.sin(turn)], axis=2)
    return out
