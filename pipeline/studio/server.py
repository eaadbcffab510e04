"""Serving the page: on this machine alone unless told otherwise, and never half."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from trame.app import get_server

from pipeline.errors import OutputError, UsageError
from pipeline.studio.address import HERE, check_port
from pipeline.studio.files import TOML, Folders, open_parameters
from pipeline.studio.modelling import Clock
from pipeline.studio.page import Page
from pipeline.studio.session import Session, random_seed
from pipeline.synthetic.colonization import ColonizationOptions

NO_TIMEOUT = 0


def serve(
    files: list[Path],
    *,
    clock: Clock,
    ready: Callable[[str], Any],
    host: str = HERE,
    port: int = 0,
    browser: bool = True,
) -> None:
    """Serve the studio until it is interrupted.

    Parameters
    ----------
    files : list of Path
        Folders where results may go, and at most one parameter file to begin with.
    clock : callable
        Tells seconds.
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
    UsageError, InputMissingError, InputFormatError
        If the files are none to begin with.
    OutputError
        If the port is in use.
    """
    session = session_of(files)
    check_port(host, port)
    server = page_server(session, clock)
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


def page_server(session: Session, clock: Clock) -> Any:
    """Make a server with the page, not yet started."""
    server = get_server(name="treepipe", client_type="vue3")
    server.cli.parse_known_args = _no_arguments(server.cli)
    Page(server, session, clock)
    return server


def session_of(files: list[Path]) -> Session:
    """Begin a session with the files of the command line.

    Raises
    ------
    UsageError
        If a file is no parameter file, or there are two of them.
    """
    folders = Folders(files)
    given = [path for path in files if path.is_file()]
    for path in given:
        if path.suffix.lower() != TOML:
            msg = f"{path}: the studio opens folders and parameter files; end its name in {TOML}"
            raise UsageError(msg)
    if len(given) > 1:
        msg = f"{given[1]}: is the second parameter file; give one"
        raise UsageError(msg)
    first = open_parameters(given[0], folders) if given else ColonizationOptions(seed=random_seed())
    return Session(first, folders)


def _no_arguments(parser: Any) -> Callable[..., Any]:
    """Keep trame from reading the command line, which is treepipe's."""
    read = parser.parse_known_args
    return lambda args=None, namespace=None: read([] if args is None else args, namespace)
