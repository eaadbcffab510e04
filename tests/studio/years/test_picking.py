"""Which wood a click means, by hand-made limbs and by the pixels of a grown tree."""

import numpy as np
import pytest

from pipeline.errors import UsageError
from pipeline.growth import GrowthOptions, grow
from pipeline.growth.carrying import Carrying
from pipeline.growth.pruning.selecting import nearest
from pipeline.studio.years.limbs import Limbs, branch_at, limbs_of
from pipeline.studio.years.picking import picked, ray_of

SIZE = (800, 600)
CAMERA = {
    "position": [0.0, -10.0, 1.0],
    "focalPoint": [0.0, 0.0, 1.0],
    "viewUp": [0.0, 0.0, 1.0],
    "viewAngle": 30.0,
    "parallelProjection": False,
    "parallelScale": 1.0,
}


def limbs(*rows):
    """Make limbs of (begin, end, width)."""
    begin, end, width = (np.array(part, dtype=float) for part in zip(*rows, strict=True))
    number = np.zeros(len(rows), dtype=np.int32)
    return Limbs(begin, end, width, np.arange(-1, len(rows) - 1, dtype=np.int32), number, number, number)


FOOT = ((0, 0, 0), (0, 0, 0), 0.1)
STEM = ((0, 0, 0), (0, 0, 2), 0.2)
BEHIND = ((0, 3, 0), (0, 3, 2), 0.2)
BESIDE = ((1, 0, 0), (1, 0, 2), 0.01)


def pixel_of(point, camera=CAMERA):
    """Project a point as a browser does, onto a picture of SIZE."""
    eye, focus, up = (np.array(camera[key]) for key in ("position", "focalPoint", "viewUp"))
    ahead = (focus - eye) / np.linalg.norm(focus - eye)
    right = np.cross(ahead, up)
    right /= np.linalg.norm(right)
    above = np.cross(right, ahead)
    step = np.asarray(point) - eye
    half = (
        camera["parallelScale"]
        if camera["parallelProjection"]
        else np.tan(np.radians(camera["viewAngle"] / 2))
    )
    depth = 1.0 if camera["parallelProjection"] else step @ ahead
    x, y = step @ right / (half * depth), step @ above / (half * depth)
    return (SIZE[0] + x * SIZE[1]) / 2, SIZE[1] * (1 - y) / 2


def test_the_middle_of_the_picture_is_what_the_camera_looks_at():
    ray = ray_of(CAMERA, (400, 300), SIZE)
    assert np.allclose(ray.eye, (0, -10, 1))
    assert np.allclose(ray.way, (0, 1, 0))
    assert np.isclose(ray.spread, 2 * np.tan(np.radians(15)) / 600)


def test_a_click_meets_the_first_wood_and_the_place_on_its_axis():
    found, place = picked(limbs(FOOT, STEM, BEHIND), ray_of(CAMERA, pixel_of((0.05, 0, 1.2)), SIZE))
    assert found == 1
    assert np.allclose(place, (0, 0, 1.2), atol=0.02)


def test_a_click_beside_thin_wood_means_it_and_one_far_from_all_means_nothing():
    wood = limbs(FOOT, STEM, BESIDE)
    x, y = pixel_of((1, 0, 1.5))
    assert picked(wood, ray_of(CAMERA, (x + 5, y), SIZE))[0] == 2
    assert picked(wood, ray_of(CAMERA, (x + 40, y), SIZE)) is None
    assert picked(limbs(FOOT), ray_of(CAMERA, (x, y), SIZE)) is None


def test_what_is_behind_the_camera_is_not_meant():
    wood = limbs(FOOT, ((0, -20, 0), (0, -20, 2), 0.5))
    assert picked(wood, ray_of(CAMERA, (400, 300), SIZE)) is None


def test_a_place_is_never_that_of_two_metamers():
    _, place = picked(limbs(FOOT, STEM), ray_of(CAMERA, pixel_of((0, 0, 2.01)), SIZE))
    assert np.allclose(place, (0, 0, 1.9))


@pytest.mark.parametrize("parallel", [False, True])
def test_every_metamer_that_is_seen_is_picked_at_its_pixel(parallel):
    tree = grown()
    held = limbs_of(tree.metamers)
    camera = CAMERA | {"position": [6.0, -9.0, 3.0], "parallelProjection": parallel, "parallelScale": 2.0}
    hits = 0
    for metamer in range(1, len(held.width)):
        middle = (held.begin[metamer] + held.end[metamer]) / 2
        ray = ray_of(camera, pixel_of(middle, camera), SIZE)
        found, place = picked(held, ray)
        off = np.linalg.norm(np.cross(place - ray.eye, ray.way))
        assert off <= held.width[found] / 2 + 1e-9
        assert nearest(tree.metamers, np.round(place, 3))[0] == found or off == 0
        hits += found == metamer
    assert hits > 0.8 * (len(held.width) - 1)


def grown():
    return grow(GrowthOptions(), 12, seed=2)


def test_a_branch_tells_its_figures():
    growth = grown()
    held, tree = limbs_of(growth.metamers), growth.to_model()
    third = int(growth.metamers.axis()[3])
    stem = branch_at(held, third, held.end[third], tree)
    assert (stem.order, stem.start) == (0, 0)
    assert np.isclose(stem.length_m, 0.1 * (len(growth.metamers.axis()) - 1))
    assert np.isclose(stem.bears_m, 0.1 * held.above(third).sum())
    assert stem.base_cm >= stem.here_cm > 0.6
    assert stem.known == "allometric"
    side = int(np.flatnonzero(held.order == 1)[0])
    branch = branch_at(held, side, held.end[side], tree)
    assert (branch.order, branch.start) == (1, side)
    assert branch.birth_year == growth.metamers.birth_year[side]


def test_how_radii_are_known_is_told_with_shares(standing):
    growth = Carrying(standing, GrowthOptions(), seed=1)
    for _ in range(3):
        growth.grow_year()
    stem = branch_at(limbs_of(growth.metamers), 1, growth.metamers.end[1], growth.to_model())
    assert "measured" in stem.known or "allometric" in stem.known
    before = Carrying(standing, GrowthOptions(), seed=1)
    assert branch_at(limbs_of(before.metamers), 1, before.metamers.end[1], standing).known == "measured"


@pytest.mark.parametrize(
    "camera",
    [
        {},
        CAMERA | {"position": [0, 0]},
        CAMERA | {"focalPoint": CAMERA["position"]},
        CAMERA | {"viewAngle": "?"},
    ],
)
def test_what_is_no_camera_is_a_sentence(camera):
    with pytest.raises(UsageError, match="click again"):
        ray_of(camera, (1, 1), SIZE)


@pytest.mark.parametrize(("place", "size"), [((1, 1), (0, 0)), ((np.nan, 1), SIZE)])
def test_a_picture_without_size_is_a_sentence(place, size):
    with pytest.raises(UsageError, match="wait until it is drawn"):
        ray_of(CAMERA, place, size)
