"""Triangles, milliseconds and bytes of a tree's mesh: stage by stage, and against its options.

    python tests/benchmarks/meshes.py [--models A.npz B.ls.json ...] [--cold]

Without models, the default tree of the studio and known-truth trees of the project's own generator are drawn.
Everything is warm: each kind is made once before it is counted, and the best of some runs counts, in
processor time, for the machine may be busy. Where manifold3d is installed, the union is timed too. With
`--cold` it tells instead what the first tubes of a process cost without and with machine code on disk.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.errors import MissingExtraError
from pipeline.exchange import read_model
from pipeline.formats import glb, mesh_ply, obj
from pipeline.mesh import Mesh, MeshOptions, TubeOptions, build, tubes, union
from pipeline.mesh.surface import MITRE, axes_of, rings_of
from pipeline.mesh.triangles import with_normals
from pipeline.mesh.tube import Rules, tubes_around
from pipeline.mesh.wrapping import wrapped
from pipeline.model import TreeModel
from pipeline.synthetic import TubeTreeOptions, grow_tubes
from pipeline.synthetic.colonization import ColonizationOptions, dressed, grow, leaves_of, shaped
from pipeline.synthetic.colonization.dressing import leaf_mesh

KINDS: dict[str, MeshOptions] = {
    "as it stands": MeshOptions(),
    "smooth": MeshOptions(smooth=True),
    "leaves": MeshOptions(leaves="quads"),
    "lod 1": MeshOptions(lod=1),
    "lod 2": MeshOptions(lod=2),
    "lod 3": MeshOptions(lod=3),
}
WRITERS = {"obj": obj.write, "glb": glb.write, "mesh.ply": mesh_ply.write}


TIMES = 5
FIRST = """
import time
from pipeline.mesh import tubes
from pipeline.synthetic import TubeTreeOptions, grow_tubes
tree = grow_tubes(TubeTreeOptions(seed=1))
begin = time.process_time()
tubes(tree, tile_m=0.5)
print(f"{time.process_time() - begin:.2f} s")
"""


def timed(make: Callable[[], Any]) -> tuple[float, Any]:
    """Run some times; return the best seconds after the first run, and what it makes."""
    made, best = make(), float("inf")
    for _ in range(TIMES):
        begin = time.process_time()
        made = make()
        best = min(best, time.process_time() - begin)
    return best, made


def stages(tree: TreeModel, options: TubeOptions) -> None:
    """Print what every step from a tree to a mesh takes, and the triangles a second."""
    _, mesh = timed(lambda: tubes(tree, options=options))
    axes = axes_of(tree, options)
    rings = rings_of(axes, options)
    made = tubes_around(rings, axes.first, Rules(options.ring_gap_m, MITRE))
    flat = np.zeros(len(mesh.faces), dtype=bool)
    steps: dict[str, Callable[[], Any]] = {
        "paths of a new tree": lambda: replace(tree.skeleton).paths,
        "axes": lambda: axes_of(tree, options),
        "rings": lambda: rings_of(axes, options),
        "tubes, compiled": lambda: tubes_around(rings, axes.first, Rules(options.ring_gap_m, MITRE)),
        "places in a picture": lambda: wrapped(made, rings, 0.5),
        "normals": lambda: with_normals(mesh, flat),
        "tubes, all": lambda: tubes(tree, options=options),
        "tubes with places": lambda: tubes(tree, options=options, tile_m=0.5),
    }
    for name, step in steps.items():
        seconds, _ = timed(step)
        rate = len(mesh.faces) / seconds / 1e6
        print(f"  {name:<20} {1000 * seconds:8.2f} ms {rate:8.2f} million triangles/s")


def studio() -> None:
    """Print what the default tree of the studio takes, as it is modelled there."""
    options = ColonizationOptions(seed=1)
    sides = TubeOptions(min_sides=options.ring_sides, max_sides=options.ring_sides)
    colony, stem = grow(options)
    tree = shaped(colony, stem, options)
    leaves = leaves_of(tree, options)
    print(f"\nthe studio's default tree: {len(tree)} nodes, {len(tree.skeleton.paths)} branches")
    steps: dict[str, Callable[[], Any]] = {
        "grow": lambda: grow(options),
        "shaped": lambda: shaped(colony, stem, options),
        "leaves_of": lambda: leaves_of(tree, options),
        "leaf_mesh": lambda: leaf_mesh(leaves, tree),
        "dressed": lambda: dressed(tree, options),
    }
    for name, step in steps.items():
        print(f"  {name:<20} {1000 * timed(step)[0]:8.2f} ms")
    stages(tree, sides)


def cold() -> None:
    """Print what the first tubes of a process take."""
    with tempfile.TemporaryDirectory() as folder:
        for what in ("nothing on disk", "machine code on disk"):
            command = [sys.executable, "-c", FIRST]
            env = {**os.environ, "NUMBA_CACHE_DIR": folder}
            said = subprocess.run(command, env=env, capture_output=True, text=True, check=True)
            print(f"the first tubes, {what}: {said.stdout.strip()} of processor time")


def draw(name: str, tree: TreeModel) -> None:
    """Print a table for one tree."""
    print(f"\n{name}: {len(tree)} nodes, {len(tree.skeleton.paths)} branches")
    stages(tree, TubeOptions())
    for kind, options in KINDS.items():
        seconds, mesh = timed(lambda options=options: build(tree, options=options))
        rate = len(mesh.faces) / seconds / 1e6
        print(f"  {kind:<14} {len(mesh.faces):9d} triangles {seconds:7.3f} s, {rate:.2f} million a second")
    join(tree)
    write(build(tree))


def join(tree: TreeModel) -> None:
    """Print what the union takes and makes."""
    apart = build(tree)
    try:
        seconds, joined = timed(lambda: union(apart))
    except MissingExtraError as error:
        print(f"  union          {error}")
        return
    share = joined.branch_volume.sum() / apart.branch_volume.sum()
    print(f"  {'union':<14} {len(joined.faces):9d} triangles {seconds:7.3f} s, {share:.3f} of the volume")


def write(mesh: Mesh) -> None:
    """Print the size of every file."""
    with tempfile.TemporaryDirectory() as folder:
        for suffix, writer in WRITERS.items():
            path = Path(folder) / f"tree.{suffix}"
            seconds, _ = timed(lambda writer=writer, path=path: writer(mesh, path))
            print(f"  {suffix:<14} {path.stat().st_size / 1e6:9.2f} MB        {seconds:7.3f} s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--models", nargs="*", default=[], help="files of trees, instead of generated ones")
    parser.add_argument("--cold", action="store_true", help="time the first call of a process")
    asked = parser.parse_args()
    if asked.cold:
        cold()
        return
    models = asked.models
    if not models:
        studio()
    for file in models:
        tree = read_model(file)
        if isinstance(tree, TreeModel):
            draw(Path(file).name, tree)
    for seed in () if models else (1, 2):
        draw(f"generated, seed {seed}", grow_tubes(TubeTreeOptions(seed=seed)))


if __name__ == "__main__":
    main()
