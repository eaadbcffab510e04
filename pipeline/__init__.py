"""From laser points to compact, measured, exchangeable tree models.

Examples
--------
>>> import pipeline
>>> cloud = pipeline.read_cloud("oak.laz")  # doctest: +SKIP
>>> tree = pipeline.reconstruct(cloud)  # doctest: +SKIP
>>> pipeline.report(tree).dbh_cm  # doctest: +SKIP
>>> pipeline.write(tree, "oak.city.json")  # doctest: +SKIP

Names are resolved when they are first used, so that ``import pipeline`` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipeline.cloud import clean, read_cloud
    from pipeline.config import Config
    from pipeline.cylinders import fit
    from pipeline.exchange import read_model, write
    from pipeline.model import PointCloud, Skeleton, TreeModel
    from pipeline.report import report
    from pipeline.run import reconstruct
    from pipeline.skeleton import extract
    from pipeline.version import __version__

__all__ = [
    "Config",
    "PointCloud",
    "Skeleton",
    "TreeModel",
    "__version__",
    "clean",
    "extract",
    "fit",
    "read_cloud",
    "read_model",
    "reconstruct",
    "report",
    "write",
]

_HOMES = {
    "__version__": "version",
    "Config": "config",
    "PointCloud": "model",
    "Skeleton": "model",
    "TreeModel": "model",
    "clean": "cloud",
    "extract": "skeleton",
    "fit": "cylinders",
    "read_cloud": "cloud",
    "read_model": "exchange",
    "reconstruct": "run",
    "report": "report",
    "write": "exchange",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        msg = f"module 'pipeline' has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(f"pipeline.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
