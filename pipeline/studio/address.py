"""Where the page is served, and whether it can be; quick to import."""

from __future__ import annotations

import socket

from pipeline.errors import OutputError

HERE = "127.0.0.1"
"""This machine, and no other."""

PORT = 8080


def check_port(host: str, port: int) -> None:
    """Make sure that a port is free.

    Raises
    ------
    OutputError
        If it is not, or the host is none of this machine's.
    """
    try:
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
    except OSError as error:
        msg = f"port {port} of {host}: cannot be served ({error.strerror}); give another one with --port"
        raise OutputError(msg) from error
