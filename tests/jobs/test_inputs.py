"""Files and folders to named trees."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.errors import OutputExistsError, UsageError
from pipeline.jobs.inputs import Input, check_free, find_inputs, stem


def touch(folder: Path, *names: str) -> None:
    for name in names:
        (folder / name).touch()


@pytest.mark.parametrize(
    ("name", "expected"),
    [("x.copc.laz", "x"), ("X.COPC.LAZ", "X"), ("a.b.xyz", "a.b"), ("x.las", "x")],
)
def test_stem(name, expected):
    assert stem(Path("some/folder") / name) == expected


def test_a_folder_means_its_clouds_by_name_without_models(tmp_path):
    touch(tmp_path, "b.xyz", "a.laz", "a.ground.laz", "a.skeleton.ply", "a.treeqsm.txt", "a.qsm.csv")
    touch(tmp_path, "a.ls.json", "a.inventory.csv", "README.md", ".hidden.xyz", "a.truth.npz")
    inputs, skipped = find_inputs([tmp_path])
    assert inputs == [Input("a", tmp_path / "a.laz"), Input("b", tmp_path / "b.xyz")]
    assert [path.name for path in skipped] == [
        "a.ground.laz",
        "a.inventory.csv",
        "a.qsm.csv",
        "a.skeleton.ply",
        "a.treeqsm.txt",
    ]


def test_a_folder_without_clouds_stands_for_itself(tmp_path):
    assert find_inputs([tmp_path])[0] == [Input(tmp_path.name, tmp_path)]


def test_the_same_stem_twice_is_refused(tmp_path):
    touch(tmp_path, "a.laz", "a.xyz")
    with pytest.raises(UsageError, match=r"a\.xyz: has the same name as .*a\.laz.*rename one"):
        find_inputs([tmp_path])


def test_a_wrong_suffix_is_refused_but_a_missing_file_is_kept(tmp_path):
    touch(tmp_path, "a.doc")
    with pytest.raises(UsageError, match=r"a\.doc: the suffix '\.doc'.*convert it"):
        find_inputs([tmp_path / "a.doc"])
    assert find_inputs([tmp_path / "b.doc"])[0] == [Input("b", tmp_path / "b.doc")]


def test_results_are_not_overwritten_unasked(tmp_path):
    inputs = [Input("a", Path("a.laz"))]
    (tmp_path / "a").mkdir()
    check_free(tmp_path, inputs, overwrite=False)
    touch(tmp_path / "a", "report.json")
    check_free(tmp_path, inputs, overwrite=True)
    with pytest.raises(OutputExistsError, match="--overwrite"):
        check_free(tmp_path, inputs, overwrite=False)


def test_a_former_summary_is_not_overwritten_unasked(tmp_path):
    touch(tmp_path, "summary.json")
    with pytest.raises(OutputExistsError, match=r"summary\.json"):
        check_free(tmp_path, [], overwrite=False)
