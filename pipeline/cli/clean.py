"""`treepipe clean`: the first stage alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from pipeline.cli import options

if TYPE_CHECKING:
    from pipeline.config import Config


@click.command("clean")
@click.argument("cloud", type=options.FILE)
@options.output("a .laz or .las file")
@options.ground
@options.settings
@options.overwrite
@options.messages
def command(cloud: Path, target: Path, ground: Path | None, config: Config, overwrite: bool) -> None:
    """Drop from CLOUD what is not the tree, and thin the points."""
    options.check_target(target, (".laz", ".las"), overwrite=overwrite)
    from pipeline.cloud import clean, read_cloud, write_cloud
    from pipeline.cloud.units import require_metres
    from pipeline.jobs.naming import named

    with named(cloud):
        points = read_cloud(cloud)
        require_metres(points)
        cleaned = clean(points, read_cloud(ground) if ground else None, options=config.clean)
    write_cloud(cleaned, target)
    click.echo(f"{target}: {len(cleaned)} of {len(points)} points")
