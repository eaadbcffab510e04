"""Where rays end: a thin coat around open3d's ray casting (Embree), and the only file that knows it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import MissingExtraError
from pipeline.model import Floats, Ints


class Raycaster:
    """Triangles that can be looked at.

    Embree computes in float32. Rays are therefore started where they enter the sphere around the
    triangles, so that a scanner at 600 m is as exact as one at 10 m: to about 1 um a metre of the
    scene. Every ray is followed by itself, so the number of threads changes nothing.

    Parameters
    ----------
    vertices : (V, 3) array of float64
        Metres, near their zero.
    faces : (F, 3) array of int32

    Raises
    ------
    MissingExtraError
        If open3d is absent, or a library that it needs.
    """

    def __init__(self, vertices: Floats, faces: Ints) -> None:
        o3d = _open3d()
        self._tensor = o3d.core.Tensor
        self._triangles = o3d.t.geometry.RaycastingScene(nthreads=1)  # as quick as many, and kind to others
        self._triangles.add_triangles(
            self._tensor(vertices.astype(np.float32)), self._tensor(faces.astype(np.uint32))
        )
        self._middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
        self._radius = float(np.linalg.norm(vertices - self._middle, axis=1).max()) + 0.01

    def cast(self, origin: Floats, direction: Floats) -> tuple[Floats, NDArray[np.int64]]:
        """Follow rays to the first triangle.

        Parameters
        ----------
        origin, direction : (R, 3) array of float64
            Metres; unit vectors.

        Returns
        -------
        distance : (R,) array of float64
            Metres; infinite where nothing is hit.
        face : (R,) array of int64
            -1 where nothing is hit.
        """
        ahead = ((self._middle - origin) * direction).sum(axis=1) - self._radius
        ahead = np.maximum(ahead, 0.0)
        start = origin + ahead[:, None] * direction
        found = self._triangles.cast_rays(self._tensor(np.hstack([start, direction]).astype(np.float32)))
        distance = ahead + found["t_hit"].numpy().astype(np.float64)
        face = np.where(np.isfinite(distance), found["primitive_ids"].numpy().astype(np.int64), -1)
        return distance, face


def _open3d() -> Any:
    """Import open3d, or say what is absent."""
    try:
        import open3d  # noqa: PLC0415  an optional package that takes seconds to load
    except ModuleNotFoundError as error:
        msg = 'simulated scans need the package open3d; pip install "treepipe[scan]"'
        raise MissingExtraError(msg) from error
    except (ImportError, OSError) as error:
        msg = (
            f"open3d cannot be loaded ({error}); install the system library it needs: "
            "apt-get install libusb-1.0-0 libgl1 libgomp1"
        )
        raise MissingExtraError(msg) from error
    return open3d
