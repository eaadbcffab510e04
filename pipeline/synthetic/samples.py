"""The known-truth trees that ship with the project in data/samples."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pipeline.cloud import write_cloud
from pipeline.model import PointCloud, Skeleton, TreeModel
from pipeline.synthetic.sample import SampleOptions, sample
from pipeline.synthetic.truth import truth_of, write_truth
from pipeline.synthetic.tubes import TubeTreeOptions, grow_tubes


class Sample(NamedTuple):
    """One sample: how its tree grows, how it is scanned, where it stands."""

    tree: TubeTreeOptions
    scan: SampleOptions
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    crs: str | None = None


SAMPLES = {
    "maple": Sample(
        TubeTreeOptions(seed=11, height_m=6.2, trunk_radius_m=0.075, max_order=2),
        SampleOptions(seed=11, density_per_m2=8000, noise_m=0.002),
        origin=(120000.0, 487000.0, 1.25),
        crs="EPSG:28992",
    ),
    "lime": Sample(
        TubeTreeOptions(
            seed=22, height_m=8.5, trunk_radius_m=0.12, lean_deg=9, fork=0.3, max_order=2, twig_spacing_m=0.4
        ),
        SampleOptions(seed=22, density_per_m2=5000, noise_m=0.008),
    ),
    "oak": Sample(
        TubeTreeOptions(
            seed=33,
            height_m=11.5,
            trunk_radius_m=0.16,
            crown_base=0.25,
            branch_spacing_m=0.4,
            twig_spacing_m=0.55,
        ),
        SampleOptions(seed=33, density_per_m2=4500, noise_m=0.004, one_sided=True, ground_radius_m=3.0),
    ),
}
"""A small clean tree with a CRS; a leaning, forked, noisy one; a larger one seen from one side, on ground."""


def make(name: str) -> tuple[TreeModel, PointCloud]:
    """Grow and scan one of `SAMPLES`."""
    chosen = SAMPLES[name]
    grown = grow_tubes(chosen.tree)
    skeleton = Skeleton(
        grown.skeleton.xyz,
        grown.skeleton.parent,
        np.array(chosen.origin),
        chosen.crs,
        grown.skeleton.metadata,
    )
    tree = TreeModel(
        skeleton, grown.radius, grown.radius_source, grown.radius_rmse, grown.trunk, grown.metadata
    )
    return tree, sample(tree, options=chosen.scan)


def write_samples(folder: str | os.PathLike[str]) -> list[Path]:
    """Write every sample as ``NAME.laz`` and ``NAME.truth.npz``; the same bytes every time.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    written = []
    for name in SAMPLES:
        tree, cloud = make(name)
        written += [Path(folder) / f"{name}.laz", Path(folder) / f"{name}.truth.npz"]
        write_cloud(cloud, written[-2])
        write_truth(truth_of(tree), written[-1])
    return written
