"""`treepipe config show`: all settings with their units and ranges."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from pipeline.cli import options

if TYPE_CHECKING:
    from pipeline.config import Config


@click.group("config")
def command() -> None:
    """Show the settings."""


@command.command("show")
@options.settings
def show(config: Config) -> None:
    """Print all settings as TOML, ready to be saved and given to --config."""
    click.echo(config.to_toml(), nl=False)
