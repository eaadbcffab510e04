"""`treepipe fit`: the third stage alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from pipeline.cli import options
from pipeline.errors import InputFormatError

if TYPE_CHECKING:
    from pipeline.config import Config
    from pipeline.model import Floats


@click.command("fit")
@click.argument("skeleton", type=options.FILE)
@click.option(
    "--cloud", type=options.FILE, required=True, metavar="CLOUD", help="The cleaned cloud it is of."
)
@options.output("a .npz or another model file")
@options.settings
@options.overwrite
@options.messages
def command(skeleton: Path, cloud: Path, target: Path, config: Config, overwrite: bool) -> None:
    """Measure the radii of SKELETON in the cloud from which it was made."""
    from pipeline.exchange import FORMATS, read_model, write

    options.check_target(target, [known.suffix for known in FORMATS.values()], overwrite=overwrite)
    from pipeline.cloud import read_cloud
    from pipeline.cloud.usable import require_tree
    from pipeline.cylinders import fit
    from pipeline.jobs.naming import named
    from pipeline.model import TreeModel

    graph = read_model(skeleton)
    graph = graph.skeleton if isinstance(graph, TreeModel) else graph
    points = read_cloud(cloud)
    with named(cloud):
        require_tree(points)
    _require_together(skeleton, graph.world, cloud, points.world)
    with named(skeleton):
        tree = fit(points, graph, options=config.cylinders)
    write(tree, target, config=config)
    click.echo(f"{target}: {len(tree)} nodes, {1000 * tree.volume.sum():.1f} L")


def _require_together(skeleton: Path, nodes: Floats, cloud: Path, points: Floats) -> None:
    """Refuse a cloud that lies elsewhere than the skeleton: no radius could be measured in it."""
    apart = (nodes.min(axis=0) > points.max(axis=0)) | (points.min(axis=0) > nodes.max(axis=0))
    if apart.any():
        msg = f"{cloud}: lies elsewhere than {skeleton}; give the cloud that the skeleton was made from"
        raise InputFormatError(msg)
