"""Lines of other programs, and of 2021, become trees; damaged ones are named."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.cityjson import CityjsonOptions, from_cityjson, read_cityjson, to_cityjson
from pipeline.errors import InputFormatError
from pipeline.model import ALLOMETRIC, Skeleton, TreeModel

PLACES = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.1, 0.0, 2.0], [0.5, 0.0, 1.2], [1.0, 0.0, 1.3]]


def of_2021(lines: list[list[int]], values: list[int], **semantics: Any) -> dict[str, Any]:
    """Return a file as the study of 2021 shows it: no transform, a number for the lod, types for surfaces."""
    kinds = [{"class": k + 1, "radius": 0.01 * (k + 1)} for k in range(10)]
    shape = {
        "type": "MultiLineString",
        "lod": 2,
        "boundaries": lines,
        "semantics": {"types": kinds, "values": values, **semantics},
    }
    return {
        "type": "CityJSON",
        "version": "1.0",
        "CityObjects": {"oneTree": {"type": "SolitaryVegetationObject", "geometry": [shape]}},
        "vertices": PLACES,
    }


EDGES = [[0, 1], [1, 2], [1, 3], [3, 4]]
PARENT = [-1, 0, 1, 1, 3]


def test_edges_of_2021_become_a_tree() -> None:
    tree = from_cityjson(of_2021(EDGES, [9, 4, 0, 0]))
    assert tree.skeleton.parent.tolist() == PARENT
    assert tree.skeleton.xyz.tolist() == PLACES
    assert tree.radius == pytest.approx([0.1, 0.1, 0.05, 0.01, 0.01])
    assert set(tree.radius_source.tolist()) == {ALLOMETRIC}


@pytest.mark.parametrize("order", [[3, 2, 1, 0], [2, 0, 3, 1], [1, 3, 0, 2]])
@pytest.mark.parametrize("turned", [False, True])
def test_edges_may_come_in_any_order_and_direction(order: list[int], turned: bool) -> None:
    values = [9, 4, 0, 0]
    lines = [EDGES[k][::-1] if turned else EDGES[k] for k in order]
    tree = from_cityjson(of_2021(lines, [values[k] for k in order]))
    assert tree.skeleton.parent.tolist() == PARENT
    assert tree.radius == pytest.approx([0.1, 0.1, 0.05, 0.01, 0.01])


def test_without_direction_the_lowest_is_the_root_and_the_longest_branch_goes_on() -> None:
    document = of_2021([[1, 2], [0, 1], [4, 1], [3, 4]], [0, 0, 0, 0])
    document["vertices"] = [PLACES[k] for k in (2, 1, 0, 4, 3)]  # root is vertex 2
    tree = from_cityjson(document)
    assert tree.skeleton.xyz[0].tolist() == PLACES[0]
    assert tree.skeleton.parent.tolist() == [-1, 0, 1, 2, 1]
    assert tree.skeleton.xyz[2].tolist() == PLACES[3]  # 0.54 + 0.51 m on, against 1.005 m


def test_lines_without_length_are_a_tree_of_one_node() -> None:
    for lines in ([[2]], [[2, 2], [2, 2]]):
        tree = from_cityjson(of_2021(lines, [4] * len(lines)))
        assert tree.skeleton.xyz.tolist() == [PLACES[2]]
        assert tree.radius.tolist() == [0.04]


def test_values_may_count_classes_from_one() -> None:
    tree = from_cityjson(of_2021(EDGES, [10, 5, 1, 1]))
    assert tree.radius == pytest.approx([0.1, 0.1, 0.05, 0.01, 0.01])


def test_values_may_be_one_a_segment() -> None:
    lines = [[0, 1, 2], [1, 3, 4]]
    for values in ([9, 4, 0, 0], [[9, 4], [0, 0]]):
        tree = from_cityjson(of_2021(lines, values))  # type: ignore[arg-type]
        assert tree.skeleton.parent.tolist() == PARENT
        assert tree.radius == pytest.approx([0.1, 0.1, 0.05, 0.01, 0.01])


def test_a_file_in_the_style_of_2021_is_read(shared_data: Path) -> None:
    document = read_cityjson(shared_data / "cityjson" / "invalid_2021_style.city.json")
    tree = from_cityjson(document)
    (thing,) = document["CityObjects"].values()
    assert len(tree) == len(document["vertices"])
    assert tree.skeleton.crs == "EPSG:7415"
    assert [path.tolist() for path in tree.skeleton.paths] == thing["geometry"][0]["boundaries"]
    assert set(tree.radius.tolist()) == {0.05, 0.01}


@pytest.mark.parametrize("name", ["valid_solids", "valid_extension"])
def test_skeletons_of_other_writers_are_read(name: str, shared_data: Path) -> None:
    document = read_cityjson(shared_data / "cityjson" / f"{name}.city.json")
    graph = from_cityjson(document)
    attributes = document["CityObjects"]["tree-1"]["attributes"]
    del attributes["skeleton" if name == "valid_solids" else "+treeskel-graph"]
    lines = from_cityjson(document)
    assert np.array_equal(lines.skeleton.parent, graph.skeleton.parent)
    assert np.abs(lines.skeleton.world - graph.skeleton.world).max() < 6e-4
    assert np.abs(lines.radius - graph.radius).max() <= 1e-4
    assert lines.metadata == graph.metadata == {"species": "Quercus robur"}


@pytest.mark.parametrize(
    ("lines", "values", "says"),
    [
        ([[0, 1], [1, 2], [2, 0]], [0, 0, 0], "which is no tree"),
        ([[0, 1], [2, 3]], [0, 0], "which is no tree"),
        ([[0, 1], [1, 9]], [0, 0], "a vertex that is not there"),
        ([[0, 1], [1, -1]], [0, 0], "a vertex that is not there"),
        ([[0, 1], []], [0, 0], "without empty ones"),
        ([[0, 1]], [77], "none of the 10 classes"),
        ([[0, 1]], [0, 0, 0], "not one class for every line"),
        ([[0, 1]], ["a"], "not one class for every line"),
    ],
)
def test_lines_that_make_no_tree_are_named(lines: Any, values: Any, says: str) -> None:
    with pytest.raises(InputFormatError, match=f"'oneTree': .*{says}"):
        from_cityjson(of_2021(lines, values))


@pytest.mark.parametrize("radius", [None, -1, "thick", True])
def test_a_class_without_a_radius_is_named(radius: Any) -> None:
    document = of_2021(EDGES, [0, 0, 0, 0])
    shape = document["CityObjects"]["oneTree"]["geometry"][0]
    shape["semantics"]["types"][3]["radius"] = radius
    with pytest.raises(InputFormatError, match="radius is"):
        from_cityjson(document)


@pytest.mark.parametrize("vertices", [None, [[0, 0]], [["a", 0, 0]] * 5])
def test_damaged_vertices_are_named(vertices: Any) -> None:
    with pytest.raises(InputFormatError, match="three numbers"):
        from_cityjson(of_2021(EDGES, [0, 0, 0, 0]) | {"vertices": vertices})


@pytest.mark.parametrize(
    "axes", [7, {}, {"root": -1}, {"root": 99}, {"root": 0, "feet": [[1]]}, {"root": 0, "feet": [[2, 99]]}]
)
def test_damaged_axes_are_named(axes: Any, tree: TreeModel) -> None:
    document = to_cityjson(tree, name="oak", options=CityjsonOptions(profile="compact"))
    document["CityObjects"]["oak"]["attributes"]["+treeskel-axes"] = axes
    with pytest.raises(InputFormatError, match=r"'oak': .*write the file anew"):
        from_cityjson(document)


@pytest.mark.parametrize("radii", [None, [[1, 2, 3]], [[1.5] * 3, [1] * 3, [1] * 2]])
def test_damaged_radii_are_named(radii: Any, tree: TreeModel) -> None:
    chosen = CityjsonOptions(skeleton=False, skeleton_object=True)
    document = json.loads(json.dumps(to_cityjson(tree, name="oak", options=chosen)))
    document["CityObjects"]["oak-skeleton"]["attributes"]["radii"] = radii
    with pytest.raises(InputFormatError, match="one whole number for every vertex"):
        from_cityjson(document)


@pytest.mark.parametrize("nodes", [None, [[0, 1, 2]], [[0, 1, 2], [1, 3, 9], [3, 5]]])
def test_damaged_nodes_are_named(nodes: Any, tree: TreeModel) -> None:
    chosen = CityjsonOptions(skeleton=False, skeleton_object=True)
    document = to_cityjson(tree, name="oak", options=chosen)
    document["CityObjects"]["oak-skeleton"]["attributes"]["nodes"] = nodes
    with pytest.raises(InputFormatError, match="numbered from 0"):
        from_cityjson(document)


def test_nodes_in_one_place_are_told_apart_by_their_numbers() -> None:
    xyz = np.array([[0, 0, 0], [0, 0, 1], [0, 0, 1], [1, 0, 1], [1, 0, 1], [0, 0, 0]])
    skeleton = Skeleton(xyz, np.array([-1, 0, 1, 1, 2, 4]), np.zeros(3))
    tree = TreeModel(skeleton, np.full(6, 0.01), np.zeros(6), np.zeros(6))
    chosen = CityjsonOptions(skeleton=False, skeleton_object=True)
    document = to_cityjson(tree, name="oak", options=chosen)
    assert "nodes" in document["CityObjects"]["oak-skeleton"]["attributes"]
    assert from_cityjson(document).skeleton.parent.tolist() == [-1, 0, 1, 1, 2, 4]
    assert np.abs(from_cityjson(document).skeleton.world - xyz).max() < 1e-4


junk = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 2**70),
    st.floats(),
    st.text(max_size=3),
    st.just([]),
    st.just({}),
)


@settings(max_examples=200, deadline=None)
@given(st.data(), st.sampled_from(["compact", "extension", "2021"]))
def test_no_file_however_broken_breaks_the_reader(data: st.DataObject, form: str) -> None:
    """Replace or remove any one member, at any depth: a tree, or a sentence."""
    document: Any = of_2021(EDGES, [9, 4, 0, 0])
    if form != "2021":
        known = from_cityjson(document)
        chosen = CityjsonOptions(profile=form, skeleton=False, lods=())
        document = to_cityjson(known, name="elm", options=chosen)
    document = json.loads(json.dumps(document))
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
    with suppress(InputFormatError):
        assert len(from_cityjson(document)) >= 1
