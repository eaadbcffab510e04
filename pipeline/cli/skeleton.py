"""`treepipe skeleton`: the second stage alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from pipeline.cli import options

if TYPE_CHECKING:
    from pipeline.config import Config


@click.command("skeleton")
@click.argument("cloud", type=options.FILE)
@options.output("a .skeleton.ply or .ply file")
@options.method
@options.settings
@options.overwrite
@options.messages
def command(cloud: Path, target: Path, method: str | None, config: Config, overwrite: bool) -> None:
    """Extract the skeleton of CLOUD, which `treepipe clean` has written."""
    options.check_target(target, (".ply",), overwrite=overwrite)
    config = options.with_method(config, method)
    from pipeline.cloud import read_cloud
    from pipeline.cloud.usable import require_tree
    from pipeline.formats import skeleton_ply
    from pipeline.jobs.naming import named
    from pipeline.skeleton import extract

    with named(cloud):
        points = read_cloud(cloud)
        require_tree(points)
        skeleton = extract(points, options=config.skeleton)
    skeleton_ply.write(skeleton, target)
    click.echo(f"{target}: {len(skeleton)} nodes, {len(skeleton.paths)} branches")
