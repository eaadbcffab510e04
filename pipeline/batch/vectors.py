"""Files of a geographic program that a run is given: areas, lists of stems."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pipeline.batch.merging.packages import package

LOGGER = logging.getLogger("treepipe")


def read_vector(path: Path) -> tuple[dict[str, Any], Any, list[Any]]:
    """Read the first layer with shapes; measures (M) along them have no meaning here and are left out.

    Parameters
    ----------
    path : Path
        GeoPackage, GeoJSON or whatever GDAL reads; where there are more layers, which one is read is said.

    Returns
    -------
    info : dict
        ``crs``, ``fields`` and what else pyogrio tells.
    geometry : array or None
        Shapes as WKB.
    values : list of arrays
        A column for each field.

    Raises
    ------
    pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError, ValueError
        If it cannot be read.
    """
    pyogrio = package("pyogrio")
    with _measures_left_out():
        layers = [(str(name), kind) for name, kind in pyogrio.list_layers(path).tolist()]
        shaped = [name for name, kind in layers if kind] or [name for name, _ in layers]
        info, _, geometry, values = pyogrio.raw.read(path, layer=next(iter(shaped), None))
    if len(layers) > 1:
        others = ", ".join(name for name, _ in layers if name != shaped[0])
        LOGGER.warning("%s: its layer %s is read, of others there are %s", path, shaped[0], others)
    return info, geometry, values


@contextmanager
def _measures_left_out() -> Iterator[None]:
    """Let pyogrio drop measures, which it cannot hold, without its warning: it has no option for that."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"Measured \(M\) geometry types are not supported", UserWarning)
        yield
