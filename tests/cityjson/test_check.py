"""Files broken on purpose: every fault gets its own sentence that names the place."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jsonschema.validators import validator_for

from pipeline.cityjson import Finding, check, to_cityjson
from pipeline.cityjson.schema import schema_findings
from pipeline.model import Skeleton, TreeModel

Document = dict[str, Any]


def small() -> Document:
    """A tree whose five solids are few enough for a plain schema validator."""
    skeleton = Skeleton(
        np.array([[0, 0, 0], [0, 0, 1.0], [0, 0, 2.0], [1, 0, 1.5]]),
        np.array([-1, 0, 1, 1]),
        np.array([1e5, 4e5, 0.0]),
        "EPSG:28992",
    )
    return to_cityjson(TreeModel(skeleton, np.full(4, 0.02), np.zeros(4), np.zeros(4)), name="elm")


def shape(document: Document, number: int = -1) -> Any:
    return document["CityObjects"]["elm"]["geometry"][number]


def shell(document: Document, number: int = -1) -> Any:
    return shape(document, number)["boundaries"][0]


def missing_surface(d: Document) -> None:
    del shell(d)[3]


def flipped_surface(d: Document) -> None:
    shell(d)[3][0].reverse()


def inside_out(d: Document) -> None:
    for surface in shell(d):
        surface[0].reverse()


def repeated_surface(d: Document) -> None:
    shell(d).append(copy.deepcopy(shell(d)[3]))


def flat_surface(d: Document) -> None:
    a, b, _ = shell(d)[3][0]
    d["vertices"][a], d["vertices"][b] = [0, 0, 0], [20, 20, 20]
    d["vertices"].append([10, 10, 10])
    shell(d)[3][0][2] = len(d["vertices"]) - 1


def same_corner_twice(d: Document) -> None:
    shell(d)[3][0][1] = shell(d)[3][0][0]


def index_out_of_range(d: Document) -> None:
    shell(d)[3][0][1] = 10**6


def negative_index(d: Document) -> None:
    shell(d)[3][0][1] = -1


def index_no_number(d: Document) -> None:
    shell(d)[3][0][1] = 1.5


def wrongly_nested(d: Document) -> None:
    shape(d)["boundaries"] = shell(d)


def bent_surface(d: Document) -> None:
    far = len(d["vertices"])
    d["vertices"] += [[0, 0, 90000], [10000, 0, 90000], [10000, 10000, 95000], [0, 10000, 90000]]
    square = {"type": "MultiSurface", "lod": "3", "boundaries": [[[far, far + 1, far + 2, far + 3]]]}
    d["CityObjects"]["elm"]["geometry"].append(square)


def unused_vertex(d: Document) -> None:
    d["vertices"].append([5, 5, -5])


def double_vertex(d: Document) -> None:
    d["vertices"].append(list(d["vertices"][0]))
    shell(d)[0][0][0] = len(d["vertices"]) - 1


def vertex_with_fractions(d: Document) -> None:
    d["vertices"][0] = [0.5, 0, 0]


def no_scale(d: Document) -> None:
    del d["transform"]


def child_without_parent(d: Document) -> None:
    d["CityObjects"]["leaf"] = {"type": "GenericCityObject", "geometry": []}
    d["CityObjects"]["elm"]["children"] = ["leaf"]


def unknown_child(d: Document) -> None:
    d["CityObjects"]["elm"]["children"] = ["nobody"]


def parent_without_child(d: Document) -> None:
    d["CityObjects"]["leaf"] = {"type": "GenericCityObject", "geometry": [], "parents": ["elm"]}


def float_lod(d: Document) -> None:
    shape(d)["lod"] = 2.1


def no_lod(d: Document) -> None:
    del shape(d)["lod"]


def lod_too_high(d: Document) -> None:
    shape(d)["lod"] = "4"


def urn_crs(d: Document) -> None:
    d["metadata"]["referenceSystem"] = "urn:ogc:def:crs:EPSG::28992"


def unknown_surface_type(d: Document) -> None:
    values = [[0] * len(shell(d))]
    shape(d)["semantics"] = {"surfaces": [{"type": "Bark"}], "values": values}


def too_few_values(d: Document) -> None:
    shape(d)["semantics"] = {"surfaces": [{"type": "+Bark"}], "values": [[0, 0]]}


def value_out_of_range(d: Document) -> None:
    values = [[1] * len(shell(d))]
    shape(d)["semantics"] = {"surfaces": [{"type": "+Bark"}], "values": values}


def unknown_object_type(d: Document) -> None:
    d["CityObjects"]["elm"]["type"] = "Tree"


def undeclared_extension(d: Document) -> None:
    d["CityObjects"]["elm"]["type"] = "+Tree"


def unknown_geometry(d: Document) -> None:
    shape(d)["type"] = "Cylinder"


def old_version(d: Document) -> None:
    d["version"] = "1.1"


LAST = "elm, geometry 4, shell 0, surface"

CASES: list[tuple[Callable[[Document], None], str, str, str]] = [
    (missing_surface, LAST, "the shell is open, a surface is missing", "exactly two surfaces"),
    (flipped_surface, f"{LAST} 3", "faces the other way than its neighbours", "Reverse its corners"),
    (inside_out, "elm, geometry 4, shell 0", "its surfaces face the wrong way", "Reverse the corners"),
    (repeated_surface, LAST, "same corners as an earlier one", "Remove one"),
    (flat_surface, f"{LAST} 3", "has no area", "Merge its corners"),
    (same_corner_twice, f"{LAST} 3", "names a vertex twice", "Remove it"),
    (index_out_of_range, f"{LAST} 3", "Vertex 1000000 does not exist", "Name a vertex"),
    (negative_index, f"{LAST} 3", "Vertex -1 does not exist", "Name a vertex"),
    (index_no_number, "elm, geometry 4", "not indices nested 4 deep", "Nest them"),
    (wrongly_nested, "elm, geometry 4", "not indices nested 4 deep", "Nest them"),
    (bent_surface, "elm, geometry 5, surface 0", "is not planar", "triangles"),
    (unused_vertex, "vertex", "not used by any geometry", "Remove it"),
    (double_vertex, "vertex", "where an earlier one stands", "Merge the two"),
    (vertex_with_fractions, "vertices", "not all three whole numbers", "Round them"),
    (no_scale, "transform", "scale is missing", "Add a transform"),
    (child_without_parent, "elm, children", "'leaf' does not name 'elm' among its parents", "Add 'elm'"),
    (unknown_child, "elm, children", "no city object 'nobody'", "remove its name"),
    (parent_without_child, "leaf, parents", "'elm' does not name 'leaf' among its children", "Add 'leaf'"),
    (float_lod, "elm, geometry 4", "The lod is 2.1, not a string", '"lod": "2.1"'),
    (no_lod, "elm, geometry 4", "There is no lod", '"lod": "3"'),
    (lod_too_high, "elm, geometry 4", "'4' is not a level", '"0" to "3"'),
    (urn_crs, "metadata, referenceSystem", "urn:ogc:def:crs:EPSG::28992", "opengis.net/def/crs/EPSG/0/28992"),
    (unknown_surface_type, "elm, geometry 4, semantic surface 0", "'Bark' is not a type", "extension"),
    (too_few_values, "elm, geometry 4, semantics", "2 semantic values for", "one value"),
    (value_out_of_range, "elm, geometry 4, semantics", "value 1 is none of the 1", "from 0"),
    (unknown_object_type, "elm", "'Tree' is not a type", "SolitaryVegetationObject"),
    (undeclared_extension, "elm", "none is declared", "Declare"),
    (unknown_geometry, "elm, geometry 4", "'Cylinder' is not a type", "Use one of"),
    (old_version, "version", "'1.1', not '2.0'", "Upgrade"),
]


def test_the_file_is_sound_before_it_is_broken() -> None:
    assert [s["lod"] for s in small()["CityObjects"]["elm"]["geometry"]] == ["1", "2", "2", "3", "3"]
    assert check(small()) == []


@pytest.mark.parametrize(
    ("harm", "where", "what", "remedy"), CASES, ids=lambda c: getattr(c, "__name__", None)
)
def test_every_fault_is_named(harm: Callable[[Document], None], where: str, what: str, remedy: str) -> None:
    document = small()
    harm(document)
    found = check(document)
    hits = [f for f in found if f.where.startswith(where) and what in f.what and remedy in f.remedy]
    assert len(hits) == 1, [str(f) for f in found]
    for finding in found:
        assert finding.what[0].isupper() or finding.what[0] in "'\"+0123456789"
        assert finding.what.endswith(".")
        assert finding.remedy.endswith(".")


@pytest.mark.parametrize("harm", [flipped_surface, urn_crs, float_lod, child_without_parent, inside_out])
def test_one_fault_gives_one_finding(harm: Callable[[Document], None]) -> None:
    document = small()
    harm(document)
    assert len(check(document)) == 1


def test_two_flipped_neighbours_are_found_too() -> None:
    document = small()
    for surface in shell(document)[3:5]:
        surface[0].reverse()
    (found,) = check(document)
    assert "in the same direction" in found.what


def test_an_inner_shell_faces_the_hollow() -> None:
    corners = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    cube = [
        [[0, 1, 3, 2]], [[4, 6, 7, 5]], [[0, 4, 5, 1]], [[2, 3, 7, 6]], [[0, 2, 6, 4]], [[1, 5, 7, 3]],
    ]  # fmt: skip
    hole = [[[v + 8 for v in surface[0][::-1]]] for surface in cube]
    vertices = [[9000 * v for v in c] for c in corners] + [[3000 + 3000 * v for v in c] for c in corners]
    document: Document = {
        "type": "CityJSON",
        "version": "2.0",
        "transform": {"scale": [1e-3] * 3, "translate": [0, 0, 0]},
        "CityObjects": {
            "box": {
                "type": "GenericCityObject",
                "geometry": [{"type": "Solid", "lod": "1", "boundaries": [cube, hole]}],
            }
        },
        "vertices": vertices,
    }
    assert check(document) == []
    document["CityObjects"]["box"]["geometry"][0]["boundaries"][1] = [[s[0][::-1]] for s in hole]
    (found,) = check(document)
    assert found.where == "box, geometry 0, shell 1"
    assert "wrong way" in found.what
    two = {
        "type": "MultiSolid",
        "lod": "1",
        "boundaries": [[cube], [[[[v + 8 for v in s[0]]] for s in cube]]],
    }
    document["CityObjects"]["box"]["geometry"][0] = two
    assert check(document) == []


def test_a_finding_reads_as_two_sentences() -> None:
    assert str(Finding("elm", "It is wrong.", "Mend it.")) == "elm: It is wrong. Mend it."


@pytest.fixture(scope="module")
def schema(shared_data: Path) -> Any:
    return json.loads((shared_data / "cityjson" / "cityjson.min.schema.json").read_bytes())


@pytest.mark.parametrize("name", ["valid_solids", "valid_extension"])
def test_valid_files_pass(name: str, shared_data: Path, schema: Any) -> None:
    document = json.loads((shared_data / "cityjson" / f"{name}.city.json").read_bytes())
    assert check(document) == []
    assert check(document, schema=schema) == []


def test_the_style_of_2021_fails(shared_data: Path, schema: Any) -> None:
    document = json.loads((shared_data / "cityjson" / "invalid_2021_style.city.json").read_bytes())
    assert [f.where for f in check(document)] == [
        "tree-1, geometry 0",
        "tree-1, geometry 0, semantic surface 0",
        "tree-1, geometry 0, semantic surface 1",
    ]
    assert len(list(schema_findings(document, schema))) == 3


@pytest.mark.parametrize("harm", [lambda _: None, *(case[0] for case in CASES)], ids=lambda h: h.__name__)
def test_the_schema_is_applied_to_the_same_verdict(harm: Callable[[Document], None], schema: Any) -> None:
    document = small()
    for shape_ in document["CityObjects"]["elm"]["geometry"][:3]:
        shape_["boundaries"] = [shape_["boundaries"][0][:4]]  # a plain validator takes 30 ms a surface
    harm(document)
    shape_ = document["CityObjects"]["elm"]["geometry"][4]
    if shape_["type"] == "Solid" and harm is not wrongly_nested:
        shape_["boundaries"] = [shape_["boundaries"][0][:5]]
    document["CityObjects"]["elm"]["geometry"] = document["CityObjects"]["elm"]["geometry"][3:]
    plain = validator_for(schema)(schema).is_valid(document)
    assert (list(schema_findings(document, schema)) == []) == plain


junk = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 2**70),
    st.floats(),
    st.text(max_size=3),
    st.just([]),
    st.just({}),
)


@settings(max_examples=300, deadline=None)
@given(st.data())
def test_no_file_however_broken_breaks_the_check(data: st.DataObject) -> None:
    """Replace or remove any one member, at any depth."""
    document = small()
    document["CityObjects"]["elm"]["children"] = ["elm"]
    document["CityObjects"]["elm"]["geometry"] = document["CityObjects"]["elm"]["geometry"][:2]
    shape(document)["semantics"] = {"surfaces": [{"type": "+Bark"}], "values": [[0] * len(shell(document))]}
    at: Any = document
    for _ in range(data.draw(st.integers(0, 7))):
        keys = list(at) if isinstance(at, dict) else list(range(min(len(at), 4)))
        below = [k for k in keys if isinstance(at[k], dict | list) and at[k]]
        if not below:
            break
        at = at[data.draw(st.sampled_from(below))]
    key = data.draw(st.sampled_from(list(at) if isinstance(at, dict) else list(range(min(len(at), 4)))))
    if data.draw(st.booleans()):
        del at[key]
    else:
        at[key] = data.draw(junk)
    for finding in check(document):
        assert finding.where
        assert finding.what
        assert finding.remedy
