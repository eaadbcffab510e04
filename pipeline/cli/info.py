"""`treepipe info`: what a file holds."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pipeline.cli import options
from pipeline.cli.logs import LOGGER

if TYPE_CHECKING:
    from pipeline.model import Floats, PointCloud, Skeleton, TreeModel

KEYS = (
    *("kind", "points", "trees", "nodes", "branches", "height_m", "dbh_cm", "dbh_source", "volume_l"),
    *("length_m", "radius_share", "flags", "crs", "version", "extensions", "extent", "bytes"),
    "bytes_per_node",
)


@click.command("info")
@click.argument("file", type=options.FILE)
@options.as_json
@options.messages
def command(file: Path, as_json: bool) -> None:
    """Tell what FILE holds: a cloud, a skeleton, a mesh, a tree, or the trees of a .city.jsonl.

    One tree of many is named behind its file: park.city.jsonl#oak, park.lsjson.jsonl.zst#oak.
    """
    found = _facts(file)
    facts = {key: _rounded(found.get(key)) for key in KEYS}
    if as_json:
        click.echo(json.dumps(facts, indent=2))
        return
    if facts["kind"] == "tree" and facts["radius_share"] is None:
        facts["radius_share"] = "not told by the file"
    for key, value in facts.items():
        if value not in (None, []):
            click.echo(f"{key:<14} {_shown(value)}")


def _facts(file: Path) -> dict[str, Any]:
    """Return what is known of a file, by its suffix, and for a .ply by what it holds."""
    kind = kind_of(file)
    if kind == "mesh":
        return {"kind": kind, **_mesh_facts(file), **_size(file, None)}
    if kind == "cloud":
        from pipeline.cloud import read_cloud

        return {"kind": kind, **_cloud_facts(file, read_cloud(file)), **_size(file, None)}
    if kind == "trees":
        from pipeline.cityjson import describe_seq

        return {"kind": kind, **describe_seq(file), **_size(file, None)}
    from pipeline.exchange import read_model
    from pipeline.jobs.told import tells_sources

    model = read_model(file)
    options.warn_if_flat(file, model)
    options.tell_cylinders(file, model)
    facts = _model_facts(model)
    if not tells_sources(file):
        facts["radius_share"] = None
    return {**facts, **_size(file, len(model))}


def kind_of(file: Path) -> str:
    """Return "cloud", "mesh", "trees" (many of them) or "model"."""
    from pipeline.cloud import CLOUD_SUFFIXES
    from pipeline.exchange import FORMATS

    suffix = file.suffix.lower()
    if suffix == ".jsonl":
        return "trees"
    if suffix == ".ply" and file.is_file():
        from pipeline.formats.ply import open_ply

        held = {element.name for element in open_ply(file).elements if element.count}
        return "model" if "edge" in held else "mesh" if "face" in held else "cloud"
    models = tuple(known.suffix for known in FORMATS.values())
    return "model" if file.name.lower().endswith(models) or suffix not in CLOUD_SUFFIXES else "cloud"


def _mesh_facts(file: Path) -> dict[str, Any]:
    import numpy as np

    from pipeline.formats.ply import open_ply

    ply = open_ply(file)
    ply.require_whole()
    vertices = ply.columns("vertex")
    return _extent(np.column_stack([vertices[axis] for axis in "xyz"]).astype(np.float64))


def _cloud_facts(file: Path, cloud: PointCloud) -> dict[str, Any]:
    import numpy as np

    from pipeline.cloud.local import usable

    good = cloud.world[usable(cloud.xyz)]
    if len(good) < len(cloud):
        lost = len(cloud) - len(good)
        LOGGER.warning("%s: %d of %d points have no plausible coordinates", file, lost, len(cloud))
    height = float(np.ptp(good[:, 2])) if len(good) else None
    return {"points": len(cloud), "height_m": height, "crs": cloud.crs, **_extent(good)}


def _model_facts(model: TreeModel | Skeleton) -> dict[str, Any]:
    from pipeline.model import TreeModel

    graph = model.skeleton if isinstance(model, TreeModel) else model
    facts = {
        "kind": "skeleton",
        "nodes": len(graph),
        "branches": len(graph.paths),
        "height_m": float(graph.xyz[:, 2].max() - graph.xyz[:, 2].min()),
        "length_m": float(graph.length.sum()),
        "crs": graph.crs,
        **_extent(graph.world),
    }
    if isinstance(model, TreeModel):
        from pipeline.report import report

        known = report(model)
        told = ("height_m", "dbh_cm", "dbh_source", "volume_l", "radius_share", "flags")
        figures = {key: getattr(known, key) for key in told}
        facts |= {"kind": "tree", **figures}
    return facts


def _extent(world: Floats) -> dict[str, Any]:
    """Return the lowest and highest coordinates: x0, y0, z0, x1, y1, z1."""
    box = [*world.min(axis=0).tolist(), *world.max(axis=0).tolist()] if len(world) else None
    return {"extent": box}


def _size(file: Path, nodes: int | None) -> dict[str, Any]:
    if not file.is_file():  # a tree of an archive, which is no file of its own
        return {}
    size = file.stat().st_size
    return {"bytes": size, "bytes_per_node": size / nodes if nodes else None}


def _rounded(value: Any) -> Any:
    """Return micrometres and the like: no digit beyond what a file can mean."""
    if isinstance(value, list | tuple):
        return [_rounded(part) for part in value]
    if isinstance(value, dict):
        return {key: _rounded(part) for key, part in value.items()}
    return round(value, 6) if isinstance(value, float) else value


def _shown(value: Any) -> str:
    if isinstance(value, list | tuple):
        return "  ".join(map(_shown, value))
    if isinstance(value, dict):
        return "  ".join(f"{key} {_shown(part)}" for key, part in value.items())
    return f"{value:.3f}" if isinstance(value, float) else str(value)
