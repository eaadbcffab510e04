"""Triangles, seconds and bytes of a tree's mesh against its nodes and options.

    python tests/benchmarks/meshes.py [--models A.npz B.ls.json ...]

Without models, known-truth trees of the project's own generator are drawn. Everything is warm: each kind is
made once before it is counted. Where manifold3d is installed, the union is timed too.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pipeline.errors import MissingExtraError
from pipeline.exchange import read_model
from pipeline.formats import glb, mesh_ply, obj
from pipeline.mesh import Mesh, MeshOptions, build, union
from pipeline.model import TreeModel
from pipeline.synthetic import TubeTreeOptions, grow_tubes

KINDS: dict[str, MeshOptions] = {
    "as it stands": MeshOptions(),
    "smooth": MeshOptions(smooth=True),
    "leaves": MeshOptions(leaves="quads"),
    "lod 1": MeshOptions(lod=1),
    "lod 2": MeshOptions(lod=2),
    "lod 3": MeshOptions(lod=3),
}
WRITERS = {"obj": obj.write, "glb": glb.write, "mesh.ply": mesh_ply.write}


def timed(make: Callable[[], Any]) -> tuple[float, Any]:
    """Run twice; return the seconds of the second run, and what it makes."""
    make()
    begin = time.perf_counter()
    made = make()
    return time.perf_counter() - begin, made


def draw(name: str, tree: TreeModel) -> None:
    """Print a table for one tree."""
    print(f"\n{name}: {len(tree)} nodes, {len(tree.skeleton.paths)} branches")
    for kind, options in KINDS.items():
        seconds, mesh = timed(lambda options=options: build(tree, options=options))
        print(f"  {kind:<14} {len(mesh.faces):9d} triangles {seconds:7.3f} s")
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
    models = parser.parse_args().models
    for file in models:
        tree = read_model(file)
        if isinstance(tree, TreeModel):
            draw(Path(file).name, tree)
    for seed in () if models else (1, 2):
        draw(f"generated, seed {seed}", grow_tubes(TubeTreeOptions(seed=seed)))


if __name__ == "__main__":
    main()
