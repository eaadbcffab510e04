"""`treepipe view`: look at a cloud, a skeleton, a mesh or a tree."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pipeline.cli import options
from pipeline.cli.info import kind_of

if TYPE_CHECKING:
    from pipeline.model import Floats, PointCloud, Skeleton, TreeModel


@click.command("view")
@click.argument("file", type=options.FILE)
@click.option("--screenshot", type=options.FILE, metavar="F", help="Draw a .png instead of opening a window.")
@click.option("--html", type=options.FILE, metavar="F", help="Write a page with a tree that turns.")
@click.option("--overwrite", is_flag=True, help="Write over results that are there.")
@options.messages
def command(file: Path, screenshot: Path | None, html: Path | None, *, overwrite: bool) -> None:
    """Look at FILE from all sides: a cloud, a skeleton, a mesh or a tree."""
    for target, suffix in ((screenshot, ".png"), (html, ".html")):
        if target is not None:
            options.check_target(target, (suffix,), overwrite=overwrite)
    held = _held(file)
    from pipeline.view import window

    if screenshot is not None:
        window.screenshot(held, screenshot)
    if html is not None:
        _write_page(held, file, html)
    if screenshot is None and html is None:
        window.show(held, file.name)


def _write_page(held: object, file: Path, target: Path) -> None:
    from pipeline.accuracy.page import page_of
    from pipeline.errors import UsageError
    from pipeline.model import Skeleton, TreeModel
    from pipeline.output import write_text

    if not isinstance(held, TreeModel | Skeleton):
        msg = f"{file}: pages show trees and skeletons; draw a cloud or a mesh with --screenshot F.png"
        raise UsageError(msg)
    write_text(target, page_of(held, title=file.name))


def _held(file: Path) -> TreeModel | Skeleton | PointCloud | tuple[Floats, Any]:
    """Return what a file holds, by its kind."""
    kind = kind_of(file)
    if kind == "cloud":
        from pipeline.cloud import read_cloud

        return read_cloud(file)
    if kind == "mesh":
        return _mesh(file)
    from pipeline.exchange import read_model

    model = read_model(file)
    options.warn_if_flat(file, model)
    return model


def _mesh(file: Path) -> tuple[Floats, Any]:
    import numpy as np
    import trimesh

    surface = trimesh.load_mesh(file, process=False)
    return np.asarray(surface.vertices, dtype=np.float64), np.asarray(surface.faces)
