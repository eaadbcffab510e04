"""`treepipe fit`: the third stage alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from pipeline.cli import options

if TYPE_CHECKING:
    from pipeline.config import Config


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
    from pipeline.cylinders import fit
    from pipeline.jobs.naming import named
    from pipeline.model import TreeModel

    graph = read_model(skeleton)
    graph = graph.skeleton if isinstance(graph, TreeModel) else graph
    with named(skeleton):
        tree = fit(read_cloud(cloud), graph, options=config.cylinders)
    write(tree, target, config=config)
    click.echo(f"{target}: {len(tree)} nodes, {1000 * tree.volume.sum():.1f} L")
