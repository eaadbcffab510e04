"""Every real cloud gives one rooted, measured tree whose files read back."""

import numpy as np
import pytest

import pipeline
from pipeline.cityjson import check, to_cityjson
from pipeline.lsystem import encode, max_error

CLOUDS = [
    *("trees/" + n for n in ("tree1.xyz", "tree7.xyz", "Lille_2.xyz", "Lille_11.xyz", "mobile_tree_1.xyz")),
    *("trees/" + n for n in ("ahn_LAS00_9.xyz", "archi_tree1.las", "rtwig_coffeetree.txt")),
    *("trees/" + n for n in ("itsme_tree1.las", "treetraits_pine0129.laz", "voxr_t0.asc", "voxr_t1.asc")),
    "trees/ahn4_121913_487434.las",
    *(f"truth/syn_{t}_{s}.laz" for t in "AB" for s in ("clean", "noisy", "oneside", "als")),
]
# metres, from two mobile scanners or circle fits
DIAMETERS = {
    "trees/rtwig_coffeetree.txt": (0.065, 0.076),
    "trees/itsme_tree1.las": (0.146, 0.156),
    "trees/treetraits_pine0129.laz": (0.317, 0.337),
    "trees/archi_tree1.las": (0.49, 0.55),
}


@pytest.mark.parametrize("name", CLOUDS)
def test_a_real_cloud(shared_data, name):
    cloud = pipeline.read_cloud(shared_data / name)
    tree = pipeline.reconstruct(cloud)
    told = pipeline.report(tree)
    graph = tree.skeleton
    assert told.status == "ok"
    assert np.count_nonzero(graph.parent < 0) == 1
    points = cloud.xyz[np.isfinite(cloud.xyz).all(axis=1)]
    assert told.height_m == pytest.approx(np.ptp(points[:, 2]), rel=0.05)
    assert np.ptp(graph.xyz[:, 2]) == pytest.approx(told.height_m, rel=0.08)
    assert told.dbh_cm is None or 2 <= told.dbh_cm <= 150
    low, high = DIAMETERS.get(name, (0.0, np.inf))
    assert low <= tree.trunk.dbh_m <= high
    assert max_error(tree, encode(tree)) <= 0.0006
    assert check(to_cityjson(tree, name=graph.crs or "tree")) == []


def test_an_airborne_tree_knows_that_it_does_not_know(shared_data):
    folder = shared_data / "trees"
    tree = pipeline.reconstruct(
        pipeline.read_cloud(folder / "ahn4_121913_487434.las"),
        ground=pipeline.read_cloud(folder / "ahn4_121913_487434.ground.laz"),
    )
    told = pipeline.report(tree)
    assert told.dbh_source in ("allometric", "propagated")
    assert told.dbh_lo_cm < 57.1 < told.dbh_hi_cm
    assert 14.2 <= told.height_m <= 15.3
