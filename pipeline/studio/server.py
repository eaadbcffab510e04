"""Serving the page: on this machine alone unless told otherwise, and never half."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from trame.app import get_server

from pipeline.errors import OutputError
from pipeline.studio.address import HERE, check_port
from pipeline.studio.folders import Folders
from pipeline.studio.modeller.tab import ModelTab
from pipeline.studio.scan import ScanTab
from pipeline.studio.shell import Clock, Log, Shell, Tab
from pipeline.studio.years import YearsTab

NO_TIMEOUT = 0


def serve(
    server: Any, *, ready: Callable[[str], Any], host: str = HERE, port: int = 0, browser: bool = True
) -> None:
    """Serve the studio until it is interrupted.

    Parameters
    ----------
    server : trame server
        With the page, see `page_server`.
    ready : callable
        Is told the address as soon as pages are served.
    host : str, optional
        Address of this machine to listen at.
    port : int, optional
        0 is any that is free.
    browser : bool, optional
        Whether to open one.

    Raises
    ------
    OutputError
        If the port is in use.
    """
    check_port(host, port)
    server.controller.on_server_ready.add(lambda **_: ready(f"http://{host}:{server.port}/"))
    os.environ.setdefault("WSLINK_WS_COMPRESS", "0")  # it costs more time than it saves on one machine
    try:
        server.start(
            port=port,
            host=host,
            open_browser=browser,
            show_connection_info=False,
            disable_logging=True,
            timeout=NO_TIMEOUT,
        )
    except OSError as error:
        msg = f"port {port}: cannot be served ({error.strerror}); give another one with --port"
        raise OutputError(msg) from error


def page_server(files: Sequence[Path], *, clock: Clock, log: Log, name: str = "treepipe") -> Any:
    """Make a server with the page, the files opened, not yet started.

    Parameters
    ----------
    files : sequence of Path
        Folders where results may go, and what is to be opened at the start.
    clock : callable
        Tells seconds.
    log : callable
        Is told every sentence that says what went wrong.
    name : str, optional
        Servers of one name share what they know.

    Raises
    ------
    PipelineError
        If a file cannot be opened.
    """
    folders = Folders(files)
    server = get_server(name=name, client_type="vue3")
    server.cli.parse_known_args = _no_arguments(server.cli)
    shell = Shell(server, folders, clock, log)
    shell.lay_out(tabs_of(shell))
    shell.open(files)
    return server


def tabs_of(shell: Shell) -> list[Tab]:
    """Make the tabs, in the order in which they stand and are asked whether a file is theirs."""
    model = ModelTab(shell)
    return [model, YearsTab(shell, lambda: model.tree), ScanTab(shell)]


def _no_arguments(parser: Any) -> Callable[..., Any]:
    """Keep trame from reading the command line, which is treepipe's."""
    read = parser.parse_known_args
    return lambda args=None, namespace=None: read([] if args is None else args, namespace)
