"""Which version is installed."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("treepipe")
except PackageNotFoundError:  # a source tree on the path that was never installed
    __version__ = "unknown"
