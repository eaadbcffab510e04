"""The table of cylinders: every field by hand, round trips, foreign order, broken tables."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import InputFormatError, InputMissingError
from pipeline.formats import qsm
from pipeline.model import Skeleton, TreeModel

TABLE = """\
# crs: EPSG:28992; units: m
id,parent_id,branch_id,parent_branch_id,branch_order,start_x,start_y,start_z,end_x,end_y,end_z,start_radius,end_radius,radius_source,radius_se
0,-1,0,-1,0,121913.50000,487434.90000,-0.30000,121913.50000,487434.90000,0.70000,0.100000,0.090000,measured,0.002000
1,0,0,-1,0,121913.50000,487434.90000,0.70000,121913.60000,487434.90000,1.70000,0.090000,0.010000,measured,
2,0,1,0,1,121913.50000,487434.90000,0.70000,121914.10000,487434.90000,1.00000,0.030000,0.030000,propagated,0.003000
3,2,1,0,1,121914.10000,487434.90000,1.00000,121913.73333,487435.30000,1.00000,0.030000,0.003333,allometric,
4,0,2,0,1,121913.50000,487434.90000,-0.30000,121913.70000,487434.90000,-0.10000,0.002000,0.002000,allometric,
"""


def test_every_field_is_as_the_contract_says(tree: TreeModel, tmp_path: Path) -> None:
    qsm.write(tree, tmp_path / "t.qsm.csv")
    assert (tmp_path / "t.qsm.csv").read_text() == TABLE


def test_the_table_comes_back(tree: TreeModel, tmp_path: Path) -> None:
    qsm.write(tree, tmp_path / "t.qsm.csv")
    again = qsm.read(tmp_path / "t.qsm.csv")
    assert np.array_equal(again.skeleton.parent, tree.skeleton.parent)
    assert np.abs(again.skeleton.world - tree.skeleton.world).max() <= 0.5e-5 + 1e-9
    assert np.abs(again.radius - tree.radius).max() <= 0.5e-6 + 1e-12
    assert np.array_equal(again.radius_source, tree.radius_source)
    assert again.radius_rmse[1:] == pytest.approx(tree.radius_rmse[1:], nan_ok=True)
    assert again.skeleton.crs == "EPSG:28992"
    assert again.volume.sum() == pytest.approx(tree.volume.sum(), rel=1e-4)


def test_a_tree_without_reference_system(tree: TreeModel, tmp_path: Path) -> None:
    bare = TreeModel(
        Skeleton(tree.skeleton.xyz, tree.skeleton.parent), tree.radius, tree.radius_source, tree.radius_rmse
    )
    qsm.write(bare, tmp_path / "t.qsm.csv")
    assert (tmp_path / "t.qsm.csv").read_text().startswith("# crs: unknown; units: m\nid,")
    assert qsm.read(tmp_path / "t.qsm.csv").skeleton.crs is None


def test_rows_in_any_order_keep_their_branches(tree: TreeModel, tmp_path: Path) -> None:
    """Children before parents, gaps between the ids, and a limb that outweighs the stem."""
    head, names, *rows = TABLE.splitlines()
    number = {"0": "50", "1": "11", "2": "90", "3": "4", "4": "70", "-1": "-1"}
    fields = [row.split(",") for row in rows]
    other = [",".join([number[f[0]], number[f[1]], *f[2:]]) for f in fields]
    (tmp_path / "t.csv").write_text("\n".join([head, names, *sorted(other)]) + "\n")
    again = qsm.read(tmp_path / "t.csv")
    qsm.write(again, tmp_path / "again.csv")
    want = {tuple(f[5:]) + (f[4],) for f in fields}
    have = {
        tuple(line.split(",")[5:]) + (line.split(",")[4],)
        for line in (tmp_path / "again.csv").read_text().splitlines()[2:]
    }
    assert have == want
    assert len(again.skeleton.paths) == len(tree.skeleton.paths)


def row_without(column: int, value: str) -> str:
    lines = TABLE.splitlines()
    fields = lines[3].split(",")
    fields[column] = value
    return "\n".join([*lines[:3], ",".join(fields), *lines[4:]]) + "\n"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "lacks the columns id"),
        (TABLE.replace("end_x", "x"), "lacks the columns end_x"),
        ("\n".join(TABLE.splitlines()[:2]), "has no rows"),
        (row_without(1, "77"), "the parent 77 of row 1 is not there"),
        (row_without(1, "-1"), "2 rows have no parent"),
        (row_without(0, "0"), "two rows have the id 0"),
        (row_without(8, "east"), "end_x of row 1 is 'east'"),
        (row_without(8, "nan"), "not finite"),
        (row_without(13, "guessed"), "'guessed', not one of measured"),
        (TABLE.replace("\n2,0,", "\n2,3,"), "cycle"),
        (TABLE[:-60], "mend the table"),
    ],
)
def test_broken_tables_are_named_with_their_remedy(tmp_path: Path, text: str, says: str) -> None:
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(InputFormatError, match=rf"t\.csv: .*{says}") as caught:
        qsm.read(tmp_path / "t.csv")
    assert "mend the table" in str(caught.value) or "give a .qsm.csv" in str(caught.value)


def test_absent_and_binary_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputMissingError, match="no such file"):
        qsm.read(tmp_path / "no.csv")
    (tmp_path / "t.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputFormatError, match="cannot be read as text"):
        qsm.read(tmp_path / "t.csv")


@settings(max_examples=50, deadline=None)
@given(st.lists(st.integers(0, 50), min_size=1, max_size=30), st.integers(1, 6))
def test_what_is_read_is_written_alike(
    tmp_path_factory: pytest.TempPathFactory, draws: list[int], wide: int
) -> None:
    generator = np.random.default_rng(len(draws))
    count = len(draws) + 1
    parent = np.array([-1] + [max(i - d % wide, 0) for i, d in enumerate(draws)])
    skeleton = Skeleton(
        generator.normal(0, 9, (count, 3)), parent, generator.uniform(-1e6, 1e6, 3), "EPSG:28992"
    )
    tree = TreeModel(
        skeleton, generator.random(count), generator.integers(0, 3, count), generator.random(count)
    )
    folder = tmp_path_factory.mktemp("qsm")
    qsm.write(tree, folder / "a.csv")
    qsm.write(qsm.read(folder / "a.csv"), folder / "b.csv")
    a, b = ((folder / name).read_text().splitlines() for name in ("a.csv", "b.csv"))
    strip = [
        sorted(",".join([*line.split(",")[4:11], *line.split(",")[12:]]) for line in lines[2:])
        for lines in (a, b)
    ]
    assert strip[0] == strip[1]


def test_the_independent_score_takes_it(shared_data: Path, tmp_path: Path) -> None:
    """The truth itself, written as our table, scores as the truth."""
    score = shared_data.parent / "tools" / "score.py"
    if not score.is_file():
        pytest.skip(f"the score is not at {score}")
    truth = shared_data / "truth" / "syn_A.truth.npz"
    with np.load(truth) as held:
        start, end, radius, above = (held[name] for name in ("s", "e", "r", "parent"))
        branch = held["branch"]
    order = np.lexsort([np.arange(len(branch)), branch])
    assert np.array_equal(order, np.arange(len(branch)))  # the truth is numbered path by path
    parent = np.concatenate([[-1], above + 1])
    parent[1] = 0
    skeleton = Skeleton(np.concatenate([start[:1], end]), parent)
    thick = np.concatenate([radius[:1], radius])
    tree = TreeModel(skeleton, thick, np.zeros(len(thick)), np.full(len(thick), np.nan))
    qsm.write(tree, tmp_path / "t.qsm.csv")
    command = [sys.executable, str(score), str(tmp_path / "t.qsm.csv"), "--json"]
    command += ["--cloud", str(shared_data / "truth" / "syn_A_clean.laz"), "--truth", str(truth)]
    told = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert told["recall"] > 0.99
    assert told["precision"] > 0.99
    assert abs(told["length_error_pct"]) < 1
    assert told["surface_mm"]["mean"] < told["surface_floor_mm"] + 1
