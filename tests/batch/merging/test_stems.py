"""Field lists: columns by their usual names, units, and joining one to one."""

from __future__ import annotations

import math

import geopandas
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.batch.merging.fieldlist import Stem, read_stems
from pipeline.batch.merging.genera import leaf_type_of
from pipeline.batch.merging.stems import join
from pipeline.errors import InputFormatError, InputMissingError


def listed(tmp_path, text, name="stems.csv"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "text",
    [
        "x,y,species,dbh\n121000.5,487000.25,Tilia cordata,31.5\n",
        "\ufeffRD_X;RD_Y;Boomsoort;Stamdiameter (cm)\n121000,5;487000,25;Tilia cordata;31,5\n",
        "X-coördinaat\tx\ty\tsoort\tdbh_mm\n-\t121000.5\t487000.25\tTilia cordata\t315\n",
        "x,y,wetenschappelijke_naam,dbh_m\n121000.5,487000.25,Tilia cordata,0.315\n",
        f"x,y,Latijnse naam,stamomtrek_cm\n121000.5,487000.25,Tilia cordata,{31.5 * math.pi}\n",
        "X_coord,Y_coord,s,DBHmm\n121000.5,487000.25,Tilia cordata,315\n\n",
    ],
)
def test_usual_names_and_units(tmp_path, text):
    (stem,) = read_stems(listed(tmp_path, text))
    assert stem[:5] == ("row 1", 121000.5, 487000.25, "Tilia cordata", "angiosperm")
    assert stem.dbh_cm == pytest.approx(31.5)


def test_what_is_missing_is_unknown(tmp_path):
    rows = (
        "boomnummer,x,y,soort,stamdiameter",
        "A1,10,487000,,20-30 cm",
        "A2,,487000,Taxus,0",
        "A3,12,487009,,",
    )
    stems = read_stems(listed(tmp_path, "\n".join(rows)))
    assert [stem.name for stem in stems] == ["A1", "A3"]
    assert all(math.isnan(stem.dbh_cm) and stem.species is None for stem in stems)


def test_a_geopackage_in_another_system_is_brought_over(tmp_path):
    points = geopandas.points_from_xy([4.9], [52.37], crs="EPSG:4326")
    frame = geopandas.GeoDataFrame({"soort": ["Picea abies"], "dbh_cm": [40]}, geometry=points)
    frame.to_file(tmp_path / "stems.gpkg")
    (stem,) = read_stems(tmp_path / "stems.gpkg", "EPSG:7415")
    assert (stem.x, stem.y) == pytest.approx((121_770, 487_160), abs=600)
    assert (stem.leaf_type, stem.dbh_cm) == ("gymnosperm", 40)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("x,species\n1,a\n", "no column for y among x, species; name it y"),
        ("x,y\n", "holds no stem; give a list"),
        ("x,y\na,b\n", "holds no stem with coordinates"),
        ("x,y,dbh\n100000,400000,0.3\n100001,400000,0.4\n", "name the column with its unit, such as dbh_m"),
        ("x,y,dbh\n100000,400000,300\n100001,400000,600\n100002,400000,700\n", "such as dbh_m or dbh_mm"),
        ("x,y\n4.9001,52.3\n4.9002,52.3\n", "coordinates in degrees; reproject"),
    ],
)
def test_a_list_that_cannot_be_used_is_told(tmp_path, text, says):
    with pytest.raises(InputFormatError, match=says):
        read_stems(listed(tmp_path, text))


def test_a_file_that_is_none_is_told(tmp_path):
    with pytest.raises(InputMissingError, match="check the name given to --stems"):
        read_stems(tmp_path / "no.csv")
    (tmp_path / "bad.gpkg").write_bytes(b"nothing")
    with pytest.raises(InputFormatError, match="give a CSV or a GeoPackage"):
        read_stems(tmp_path / "bad.gpkg")
    (tmp_path / "bad.csv").write_bytes(b"\xff\xfe\x00x")
    with pytest.raises(InputFormatError, match="save the list as CSV in UTF-8"):
        read_stems(tmp_path / "bad.csv")


def stem(name, x, y=0.0):
    return Stem(name, x, y, "Quercus robur", "angiosperm", 30.0)


def test_the_nearest_pairs_come_first_one_to_one():
    trees = [(["a", "b"], np.array([[0.0, 0], [2, 0]])), (["c"], np.array([[10.0, 0]]))]
    joined = join([stem("s1", 1.8), stem("s2", 1.0), stem("far", 14.0), stem("s3", 2.9)], trees)
    assert {name: round(found[3], 9) for name, found in joined.by_tree.items()} == {"b": 0.2, "a": 1.0}
    assert [left.name for left in joined.unmatched] == ["far", "s3"]
    assert joined.summary() == {"given": 4, "matched": 2, "unmatched": 2, "unmatched_names": ["far", "s3"]}


places = st.lists(st.tuples(st.integers(0, 20), st.integers(0, 20)), min_size=1, max_size=12, unique=True)


@given(places, places, st.randoms())
def test_order_does_not_matter_and_nobody_is_joined_twice(stems, trees, shuffle):
    listed_stems = [stem(f"s{k}", *map(float, xy)) for k, xy in enumerate(stems)]
    listed_trees = [(f"t{k}", xy) for k, xy in enumerate(trees)]

    def joined():
        names, xy = zip(*listed_trees, strict=True)
        half = len(names) // 2
        parts = [(names[:half], np.array(xy[:half]).reshape(-1, 2)), (names[half:], np.array(xy[half:]))]
        return join(listed_stems, parts)

    first = joined()
    assert len(first.by_tree) + len(first.unmatched) == len(stems)
    assert all(found[3] <= 3 for found in first.by_tree.values())
    shuffle.shuffle(listed_stems)
    shuffle.shuffle(listed_trees)
    assert dict(joined().by_tree) == dict(first.by_tree)


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("Pinus sylvestris", "gymnosperm"),
        ("grove den", "gymnosperm"),
        ("Robinia pseudoacacia 'Golden'", "angiosperm"),
        ("Zwarteden", "gymnosperm"),
        ("Linden", "angiosperm"),
        ("ABAL", "gymnosperm"),
        ("FASY", "angiosperm"),
        ("Ginkgo biloba 'Princeton Sentry'", "gymnosperm"),
        ("", None),
        (None, None),
    ],
)
def test_leaf_types(name, kind):
    assert leaf_type_of(name) == kind


def test_real_lists_are_read(shared_data):
    field = read_stems(shared_data / "tiles" / "chablais3.inventory.csv")
    assert len(field) == 110
    assert {one.species: one.leaf_type for one in field}["PIAB"] == "gymnosperm"
    assert 7 < np.median([one.dbh_cm for one in field]) < 60
    town = read_stems(shared_data / "tiles" / "ahn4_2496_9727.truth.gpkg", "EPSG:7415")
    assert len(town) == 9
    assert all(124_800 < one.x < 124_840 for one in town)
