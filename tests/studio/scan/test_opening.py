"""What can be opened, how, and what is said of what cannot."""

import shutil

import pytest

from pipeline.errors import PipelineError, UsageError
from pipeline.studio.folders import Folders
from pipeline.studio.scan import listing
from pipeline.studio.scan.listing import entries, kind_of
from pipeline.studio.scan.opening import open_scan


def test_clouds_models_and_runs_are_listed(folder, run_folder):
    found = {entry.label: entry.kind for entry in entries(Folders([folder, run_folder.parent]))}
    assert found[f"{folder.name}/twig.laz"] == "cloud"
    assert found[f"{folder.name}/twig.truth.npz"] == "model"
    assert found["out/twig"] == "run"
    assert found["out/twig/twig.ls.json"] == "model"
    assert not [label for label in found if label.endswith(("report.json", "config.toml"))]


def test_runs_come_first_and_hidden_files_are_not_listed(folder, run_folder):
    (run_folder / ".secret.xyz").write_text("0 0 0")
    kinds = [entry.kind for entry in entries(Folders([folder, run_folder]))]
    assert kinds == sorted(kinds, key=["run", "cloud", "model"].index)
    assert not [entry for entry in entries(Folders([run_folder])) if "secret" in entry.label]


def test_links_out_of_the_folder_are_neither_listed_nor_opened(folder, tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "link.laz").symlink_to(folder / "twig.laz")
    folders = Folders([tmp_path / "in"])
    assert entries(folders) == []
    for path in (tmp_path / "in" / "link.laz", folder / "twig.laz", tmp_path / "in" / ".." / "x.laz"):
        with pytest.raises(UsageError, match="outside the folders"):
            open_scan(path, folders)


def test_very_many_files_are_not_all_listed(tmp_path, monkeypatch):
    monkeypatch.setattr(listing, "MOST_FILES", 3)
    for number in range(6):
        (tmp_path / f"{number}.xyz").write_text("0 0 0")
    assert len(entries(Folders([tmp_path]))) == 3


def test_surfaces_and_other_files_are_no_models(tmp_path):
    for name in ("oak.mesh.ply", "oak.obj", "oak.glb", "oak.png", "oak.toml", "report.json"):
        (tmp_path / name).write_text("x")
        assert kind_of(tmp_path / name) is None


def test_a_ply_is_what_it_holds(tmp_path):
    head = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
    (tmp_path / "points.ply").write_text(f"{head}end_header\n0 0 0\n")
    edges = "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n0 0 0\n0 0\n"
    (tmp_path / "lines.ply").write_text(head + edges)
    (tmp_path / "torn.ply").write_text("ply")
    assert [kind_of(tmp_path / f"{name}.ply") for name in ("points", "lines", "torn")] == [
        "cloud",
        "model",
        "cloud",
    ]


@pytest.mark.parametrize("name", ["empty.laz", "words.txt", "cut.laz", "torn.ls.json", "absent.laz"])
def test_what_cannot_be_read_is_a_sentence_with_the_name(folder, name):
    with pytest.raises(PipelineError, match=name):
        open_scan(folder / name, Folders([folder]))


def test_a_run_brings_its_cloud_its_options_and_its_figures(folder, run_folder):
    opened = open_scan(run_folder, Folders([run_folder.parent, folder]))
    assert (opened.kind, opened.name, opened.notes) == ("run", "twig", ())
    assert len(opened.cloud) == opened.written["points_in"]
    assert len(opened.model) == opened.written["nodes"]
    assert opened.config.cylinders.rounds == 1


def test_what_lies_outside_is_missed_in_a_sentence(run_folder):
    opened = open_scan(run_folder, Folders([run_folder]))
    assert opened.cloud is None
    assert opened.config.cylinders.rounds == 2
    assert "config.toml is not in the folders" in opened.notes[0]
    assert "start the studio with its folder" in opened.notes[1]


def test_another_cloud_of_that_name_is_not_taken(folder, run_folder, tmp_path):
    (tmp_path / "other").mkdir()
    shutil.copy(folder / "plane.laz", tmp_path / "other" / "twig.laz")
    opened = open_scan(run_folder, Folders([run_folder.parent, tmp_path / "other"]))
    assert opened.cloud is None
    assert "is another cloud than the run's" in opened.notes[0]


@pytest.mark.parametrize("content", ["nonsense", "[]", '{"x": 1}'])
def test_a_report_of_something_else_is_explained(tmp_path, content):
    (tmp_path / "report.json").write_text(content)
    with pytest.raises(PipelineError, match="is no report of a run"):
        open_scan(tmp_path, Folders([tmp_path]))


def test_a_run_without_a_model_is_explained(run_folder):
    (run_folder / "twig.ls.json").unlink()
    with pytest.raises(PipelineError, match="holds no model of twig that can be read"):
        open_scan(run_folder, Folders([run_folder]))
