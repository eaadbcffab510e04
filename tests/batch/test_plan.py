"""Which cells, in which reference system; and what is refused, with its remedy."""

from __future__ import annotations

import json
import struct

import pytest

from pipeline.airborne.grid import GridOptions
from pipeline.batch.area import box_area, parse_bbox, read_area
from pipeline.batch.extra import check_installed
from pipeline.batch.forecast import CPU_S_PER_MILLION, CPU_S_PER_TREE, forecast
from pipeline.batch.plan import NoTileError, find_tiles
from pipeline.errors import MissingExtraError, UsageError
from tests.batch.stubs import make_tile, plan_of


def test_dutch_tiles_without_a_reference_system_are_assumed_to_be_dutch(tmp_path):
    plan = plan_of(make_tile(tmp_path / "a.laz"))
    assert (plan.reference.crs, plan.reference.assumed) == ("EPSG:7415", True)
    assert not plan.warnings
    assert len(plan.cells) == 4
    assert plan.points == pytest.approx(4000, rel=0.01)
    elsewhere = plan_of(make_tile(tmp_path / "b.laz", corner=(900_000.0, 6_500_000.0), scale=0.01))
    assert "--crs EPSG:N" in elsewhere.warnings[0]
    given = plan_of(tmp_path / "b.laz", crs="EPSG:2154")
    assert (given.reference.crs, given.reference.assumed, given.warnings) == ("EPSG:2154", True, ())
    with pytest.raises(UsageError, match="degree"):
        plan_of(tmp_path / "b.laz", crs="EPSG:4326")


def test_one_unnamed_tile_among_named_ones_takes_theirs(tmp_path):
    named = make_tile(tmp_path / "a.laz", crs="EPSG:28992")
    plan = plan_of(
        named, make_tile(tmp_path / "b.laz", seed=2), make_tile(tmp_path / "c.laz", crs="EPSG:7415")
    )
    assert (plan.reference.crs, plan.reference.assumed) == ("EPSG:7415", True)
    assert "b.laz: names no reference system" in plan.warnings[0]


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (
            {"crs": "EPSG:4326", "corner": (4.9, 52.3), "size_m": 0.01, "scale": 1e-7},
            "in degrees.*pdal translate",
        ),
        ({"corner": (4.9, 52.3), "size_m": 0.01, "scale": 1e-7}, "in degrees.*pdal translate"),
        (
            {"crs": "EPSG:2249", "corner": (770_000.0, 2_950_000.0), "scale": 0.01},
            "US survey foot.*pdal translate",
        ),
    ],
)
def test_degrees_and_feet_are_refused_with_the_command_that_helps(made, words, tmp_path):
    with pytest.raises(UsageError, match=words):
        plan_of(make_tile(tmp_path / "tile.laz", **made))


def test_tiles_in_different_systems_are_refused(tmp_path):
    dutch = make_tile(tmp_path / "a.laz", crs="EPSG:28992")
    french = make_tile(tmp_path / "b.laz", crs="EPSG:2154")
    with pytest.raises(UsageError, match=r"a\.laz: is in EPSG:28992.*b\.laz in EPSG:2154.*reproject"):
        plan_of(dutch, french)


def test_bad_tiles_are_told_and_the_rest_is_planned(tmp_path):
    good = make_tile(tmp_path / "good.laz")
    empty, cut = make_tile(tmp_path / "empty.laz", points=0), tmp_path / "cut.laz"
    cut.write_bytes(good.read_bytes()[:3000])
    absent, wide = tmp_path / "absent.laz", make_tile(tmp_path / "wide.las")
    content = bytearray(wide.read_bytes())
    struct.pack_into("<d", content, 179, float("nan"))  # the greatest x
    wide.write_bytes(content)
    plan = plan_of(good, empty, cut, absent, wide)
    assert len(plan.tiles) == 1
    assert set(plan.failures) == {str(empty), str(cut), str(absent), str(wide)}
    assert plan.input_hash == plan_of(good).input_hash
    with pytest.raises(NoTileError) as caught:
        plan_of(empty, absent)
    assert len(caught.value.failures) == 2
    assert caught.value.exit_code == 1


def test_the_same_tile_twice_is_taken_once(tmp_path):
    first = make_tile(tmp_path / "a.laz")
    twin = tmp_path / "b.laz"
    twin.write_bytes(first.read_bytes())
    plan = plan_of(first, twin, first)
    assert len(plan.tiles) == 1
    assert "holds the same as" in plan.warnings[0]
    assert plan.input_hash == plan_of(twin).input_hash


def test_a_folder_means_the_tiles_in_it(tmp_path):
    tiles = [make_tile(tmp_path / name) for name in ("b.laz", "a.las")]
    (tmp_path / "notes.txt").write_text("no tile")
    assert find_tiles([tmp_path]) == sorted(tiles)
    assert plan_of(tmp_path).input_hash == plan_of(*tiles).input_hash == plan_of(*tiles[::-1]).input_hash
    with pytest.raises(UsageError, match=r"notes\.txt.*convert"):
        find_tiles([tmp_path / "notes.txt"])
    (tmp_path / "none").mkdir()
    with pytest.raises(NoTileError, match="no tiles are in this folder"):
        plan_of(tmp_path / "none")


def test_a_box_chooses_cells(tmp_path):
    tile = make_tile(tmp_path / "a.laz")
    window = parse_bbox("121010,487010,121020,487020")
    plan = plan_of(tile, area=lambda _: box_area(window))
    assert [cell.name for cell in plan.cells] == ["121000_487000_50"]
    assert plan.input_hash != plan_of(tile).input_hash
    with pytest.raises(UsageError, match="--bbox"):
        plan_of(tile, area=lambda _: box_area((0, 0, 1, 1)))
    for text in ("1,2,3", "a,b,c,d", "5,5,1,1"):
        with pytest.raises(UsageError, match="west,south,east,north"):
            parse_bbox(text)


def test_polygons_of_another_system_are_reprojected(tmp_path):
    from pyproj import Transformer

    to_degrees = Transformer.from_crs("EPSG:28992", "EPSG:4326", always_xy=True).transform
    ring = [to_degrees(x, y) for x, y in ((121_060, 487_010), (121_070, 487_010), (121_060, 487_020))]
    shape = {"type": "Polygon", "coordinates": [[*ring, ring[0]]]}
    file = tmp_path / "area.geojson"
    file.write_text(json.dumps({"type": "FeatureCollection", "features": [
        {"type": "Feature", "properties": {}, "geometry": shape}]}))  # fmt: skip
    plan = plan_of(make_tile(tmp_path / "a.laz"), area=lambda crs: read_area(file, crs))
    assert [cell.name for cell in plan.cells] == ["121050_487000_50"]
    with pytest.raises(UsageError, match="--aoi"):
        read_area(tmp_path / "absent.gpkg", "EPSG:7415")
    (tmp_path / "bad.geojson").write_text("{}")
    with pytest.raises(UsageError, match="--aoi"):
        read_area(tmp_path / "bad.geojson", "EPSG:7415")


def test_what_a_run_costs_is_told_beforehand(tmp_path):
    plan = plan_of(make_tile(tmp_path / "a.laz"), grid=GridOptions(core_m=50, buffer_m=25))
    one, two = forecast(plan, 1), forecast(plan, 2)
    assert one["cells"] == 4
    assert one["points"] == pytest.approx(4000, rel=0.01)
    assert one["hectares"] == pytest.approx(1.0, rel=0.01)
    for kind, trees in (("open", 80), ("forest", 350)):
        assert one[f"trees_{kind}"] == pytest.approx(trees, rel=0.01)
        cpu_s = 0.004 * CPU_S_PER_MILLION + trees * CPU_S_PER_TREE
        assert one[f"hours_{kind}"] == pytest.approx(cpu_s / 3600, rel=0.01)
        assert one[f"hours_{kind}"] == pytest.approx(2 * two[f"hours_{kind}"])
        assert one[f"results_gb_{kind}"] == pytest.approx(36e-6 * trees, rel=0.01)
    assert one["work_gb"] == pytest.approx(4000 * 30 / 1e9 * 75**2 / 50**2, rel=0.01)


@pytest.mark.parametrize(
    ("name", "trees"),
    [("ahn4_2496_9727", 26), ("ahn3_2386_9702", 22), ("chablais3", 219), ("spanner_als", 23)],
)
def test_the_trees_of_real_tiles_lie_between_what_is_forecast(shared_data, name, trees):
    """So many are found in them."""
    told = forecast(plan_of(shared_data / "tiles" / f"{name}.laz"), 1)
    assert told["trees_open"] <= trees <= told["trees_forest"]


def test_an_absent_package_is_named_before_any_work(monkeypatch):
    monkeypatch.setattr("pipeline.batch.extra.NEEDED", ("distributed", "no_such_package"))
    with pytest.raises(
        MissingExtraError, match=r'no_such_package.*pip install "treepipe\[batch\]"'
    ) as caught:
        check_installed()
    assert caught.value.exit_code == 2
