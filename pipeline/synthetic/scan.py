"""`scan`: the cloud that a scanner makes of a known tree, with the truth of every return."""

from __future__ import annotations

import os
from dataclasses import fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from pipeline.cloud import write_cloud
from pipeline.errors import NotATreeError
from pipeline.model import Floats, PointCloud, TreeModel
from pipeline.output import whole_file
from pipeline.synthetic.beams import Beams
from pipeline.synthetic.flight import AlsOptions, flight_beams
from pipeline.synthetic.returns import Echoes, Returns, echoes_of, incidence, recorded, segments, swayed
from pipeline.synthetic.scene import GROUND, LEAF, NEIGHBOUR, SURFACES, WOOD, Scene, set_scene
from pipeline.synthetic.terrestrial import TlsOptions, tripod_beams
from pipeline.synthetic.truth import Truth, truth_of, write_truth

SCANNERS: dict[str, type[TlsOptions] | type[AlsOptions]] = {"tls": TlsOptions, "als": AlsOptions}
"""Options of the scanners by name: terrestrial and airborne."""
LAS_CLASSES = {WOOD: 1, LEAF: 5, GROUND: 2, NEIGHBOUR: 1}
"""Classes of the LAS specification: unclassified, high vegetation, ground."""
STRONGEST = 10_000
"""Intensity of a beam that hits one surface at a right angle."""


class Scan(NamedTuple):
    """A simulated cloud and what is true of it.

    Attributes
    ----------
    cloud : PointCloud
        In the tree's own coordinates and CRS, scanner by scanner, in the order of the beams. Attributes:
        `classification`, `intensity`, `return_number`, `number_of_returns`, and of the truth `surface`,
        `segment`, `branch`, `order`, `scanner` and `range_error_m`.
    returns : Returns
        The truth of every point.
    truth : Truth
        The cylinders of the tree.
    """

    cloud: PointCloud
    returns: Returns
    truth: Truth


def scan(tree: TreeModel, *, options: TlsOptions | AlsOptions | None = None) -> Scan:
    """Scan a tree by following every beam.

    Parameters
    ----------
    tree : TreeModel
        In metres, z upwards; it stands on its root.
    options : TlsOptions or AlsOptions, optional
        The scanner is terrestrial or airborne by what they are.

    Returns
    -------
    Scan
        The same for the same tree and options, whatever the number of processors.

    Raises
    ------
    MissingExtraError
        If open3d is absent.
    NotATreeError
        If there is nothing to scan, or no beam hits the tree.
    UsageError
        If a station stands inside a trunk.
    """
    options = options or TlsOptions()
    standing, shooting, measuring = (np.random.default_rng([options.seed, k]) for k in range(3))
    scene = set_scene(tree, options, standing)
    if isinstance(options, AlsOptions):
        beams = flight_beams(scene, options, shooting)
    else:
        beams = tripod_beams(scene, options, shooting)
    echoes, number, count = recorded(echoes_of(beams, scene, options), options)
    kept = _kept(echoes, scene, options)
    if not (scene.surface[echoes.face[kept]] <= LEAF).any():
        msg = (
            f"none of the {len(beams.origin)} beams hits the tree; move the scanner nearer, look finer, "
            "raise max_range_m, or take away what stands before it"
        )
        raise NotATreeError(msg)
    echoes = echoes.take(kept)
    measured = echoes.mean + measuring.normal(0, options.noise_m, len(echoes.mean))
    returns = _truth(echoes, measured, beams, scene, (number[kept], count[kept]))
    xyz = beams.origin[echoes.beam] + measured[:, None] * beams.direction[echoes.beam]
    xyz = xyz + _shifts(echoes, beams, scene, options, measuring)
    return Scan(_cloud(xyz, returns, scene, options), returns, truth_of(tree))


def _kept(echoes: Echoes, scene: Scene, options: TlsOptions | AlsOptions) -> NDArray[np.bool_]:
    """Return which echoes come from near the tree."""
    away = np.hypot(echoes.place[:, 0], echoes.place[:, 1])
    return np.asarray(away <= scene.crown_radius + options.margin_m)


def _truth(
    echoes: Echoes,
    measured: Floats,
    beams: Beams,
    scene: Scene,
    counted: tuple[NDArray[np.int64], NDArray[np.int64]],
) -> Returns:
    """Say of every echo where it comes from."""
    skeleton = scene.tree.skeleton
    node = segments(echoes.place, echoes.face, scene)
    off = node < 0
    return Returns(
        segment=np.where(off, -1, node - 1).astype(np.int32),
        branch=np.where(off, -1, skeleton.branch[node]).astype(np.int32),
        order=np.where(off, -1, skeleton.order[node]).astype(np.int32),
        surface=scene.surface[echoes.face],
        true_xyz=echoes.place + scene.foot + skeleton.origin,
        true_range_m=echoes.range,
        range_error_m=(measured - echoes.range).astype(np.float32),
        spread_m=echoes.spread.astype(np.float32),
        hits=echoes.hits.astype(np.uint8),
        incidence_deg=incidence(beams.direction[echoes.beam], echoes.face, scene).astype(np.float32),
        scanner=beams.scanner[echoes.beam],
        return_number=counted[0].astype(np.uint8),
        number_of_returns=counted[1].astype(np.uint8),
    )


def _shifts(
    echoes: Echoes, beams: Beams, scene: Scene, options: TlsOptions | AlsOptions, rng: Generator
) -> Floats:
    """Return the (R, 3) shifts of the points by inexact registration and by wind."""
    scanner = beams.scanner[echoes.beam]
    total = int(beams.scanner.max()) + 1
    shift = rng.normal(0, options.registration_m, (total, 3))[scanner]
    for one in range(total):
        own = np.flatnonzero((scanner == one) & (scene.surface[echoes.face] != GROUND))
        share = np.arange(len(own)) / max(1, len(own))
        shift[own] += swayed(echoes.place[own], share, scene.height, options.wind_m, rng)
    return np.asarray(shift)


def _cloud(xyz: Floats, returns: Returns, scene: Scene, options: TlsOptions | AlsOptions) -> PointCloud:
    skeleton = scene.tree.skeleton
    classes = np.array([LAS_CLASSES[kind] for kind in range(len(SURFACES))], dtype=np.uint8)
    share = returns.hits / options.sub_rays * np.cos(np.radians(returns.incidence_deg))
    attributes: dict[str, NDArray[Any]] = {
        "classification": classes[returns.surface],
        "intensity": np.rint(STRONGEST * share).astype(np.uint16),
        "return_number": returns.return_number,
        "number_of_returns": returns.number_of_returns,
        "surface": returns.surface,
        "segment": returns.segment,
        "branch": returns.branch,
        "order": returns.order,
        "scanner": returns.scanner,
        "range_error_m": returns.range_error_m,
    }
    scanner = next(name for name, kind in SCANNERS.items() if isinstance(options, kind))
    told = {"scan": {"scanner": scanner, **options.model_dump(mode="json")}}
    return PointCloud(xyz + scene.foot, skeleton.origin, skeleton.crs, attributes, told)


def scan_files(path: str | os.PathLike[str]) -> tuple[Path, Path, Path]:
    """Return where the cloud, the truth of the tree and the truth of the returns are written."""
    cloud = Path(path)
    return cloud, cloud.with_name(f"{cloud.stem}.truth.npz"), cloud.with_name(f"{cloud.stem}.returns.npz")


def write_scan(made: Scan, path: str | os.PathLike[str]) -> tuple[Path, Path, Path]:
    """Write the cloud, and beside it the truth: ``NAME.laz``, ``NAME.truth.npz`` and ``NAME.returns.npz``.

    Parameters
    ----------
    made : Scan
    path : path-like
        Of the cloud; ends in .laz or .las.

    Returns
    -------
    tuple of Path
        The three files.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    cloud, truth, returns = scan_files(path)
    write_cloud(made.cloud, cloud)
    write_truth(made.truth, truth)
    columns: dict[str, Any] = {field.name: getattr(made.returns, field.name) for field in fields(Returns)}
    with whole_file(returns) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, **columns)
    return cloud, truth, returns
