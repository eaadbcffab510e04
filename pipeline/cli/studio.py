"""`treepipe studio`: model trees in the browser."""

from __future__ import annotations

from pathlib import Path

import click

from pipeline.cli import options
from pipeline.cli.logs import LOGGER
from pipeline.studio.address import HERE, PORT, check_port


@click.command("studio", context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("files", nargs=-1, type=options.FILE)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=PORT,
    show_default=True,
    metavar="N",
    help="Where the page is served; 0: any free one.",
)
@click.option(
    "--host", default=HERE, show_default=True, metavar="ADDRESS", help="Whom it is served to: this machine."
)
@click.option("--no-browser", is_flag=True, help="Do not open a browser.")
@options.messages
def command(files: tuple[Path, ...], port: int, host: str, no_browser: bool) -> None:
    """Trees in the browser: model one, grow and prune it year by year, see what a scan becomes.

    FILES are folders where results may go, and what is opened at the start: parameters or events (.toml), a
    model, a cloud, the folder of a run. No file outside of their folders is opened. End it with Ctrl-C.
    """
    from importlib.util import find_spec
    from time import perf_counter

    for package in ("trame", "trame_vtk", "trame_vuetify", "trame_pyvista"):
        if find_spec(package) is None:
            msg = f'the studio needs {package}, which is not installed; run pip install "treepipe[studio]"'
            raise click.UsageError(msg)
    check_port(host, port)
    from pipeline.studio.server import page_server, serve

    if host not in (HERE, "localhost", "::1"):
        LOGGER.warning("--host %s: everyone in that network can use the studio and its folders", host)
    serve(
        page_server(files, clock=perf_counter, log=LOGGER.warning),
        ready=lambda address: click.echo(f"studio at {address} (end it with Ctrl-C)"),
        host=host,
        port=port,
        browser=not no_browser,
    )
