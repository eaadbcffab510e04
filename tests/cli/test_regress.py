"""References kept and checked: green, drift of every kind, and what could not be checked."""

from __future__ import annotations

import json
import shutil
from xml.etree import ElementTree

import pytest

from pipeline.lsystem import read_lsjson, write_lsjson


@pytest.fixture
def refs(call, made, tmp_path):
    """A reference of the sapling."""
    folder = tmp_path / "refs"
    result = call("regress", "accept", made, "--refs", folder, "--note", "looked at it")
    assert (result.exit_code, result.stdout) == (0, f"{folder / 'sapling'}\n")
    return folder


@pytest.fixture
def today(made, tmp_path):
    """What today's run has written, to be spoilt."""
    return shutil.copytree(made, tmp_path / "today")


@pytest.fixture
def guard(call, refs, tmp_path):
    return lambda *more: call("regress", "run", "--refs", refs, "--out", tmp_path / "night", *more)


def told(tmp_path):
    report = json.loads((tmp_path / "night" / "report.json").read_text())
    return report["trees"][0], report


def test_a_reference_says_who_why_and_what_of(refs):
    kept = json.loads((refs / "sapling" / "reference.json").read_text())
    assert kept["format"] == {"name": "treepipe-reference", "version": 1}
    assert kept["accepted"]["note"] == "looked at it"
    assert kept["accepted"]["when"]
    assert kept["figures"]["config_hash"]
    assert kept["figures"]["source"]["sha256"]


def test_the_same_is_green_and_quiet(guard, tmp_path):
    result = guard()
    assert (result.exit_code, result.output) == (0, "")
    tree, report = told(tmp_path)
    assert (tree["status"], report["counts"]["ok"]) == ("ok", 1)
    assert all(check["ok"] for check in tree["checks"])
    suite = ElementTree.parse(tmp_path / "night" / "junit.xml").getroot()
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("1", "0", "0")
    assert guard().exit_code == 0
    assert len((tmp_path / "night" / "history.jsonl").read_text().splitlines()) == 2


def spoil(today, change):
    path = today / "sapling" / "sapling.ls.json"
    document = read_lsjson(path)
    write_lsjson(document | change(document), path)


@pytest.mark.parametrize(
    ("change", "measure"),
    [
        (lambda document: {"radius": document["radius"] | {"exponent": 0.9}}, "file_volume_l"),
        (lambda document: {"axiom": document["axiom"].translate(str.maketrans("+-><", "><+-"))}, "moved_"),
        (lambda document: {"axiom": document["axiom"].translate(str.maketrans("<>", "><"))}, "moved_"),
        (lambda _: {"degrees": False}, "moved_"),
    ],
    ids=["a wrong exponent", "rotation and roll swapped", "a mirror image", "radians"],
)
def test_a_drift_is_caught_and_named(guard, today, tmp_path, change, measure):
    spoil(today, change)
    result = guard("--models", today)
    assert result.exit_code == 1
    assert result.stderr.startswith("sapling: drift: ")
    tree, _ = told(tmp_path)
    assert measure in {check["measure"][: len(measure)] for check in tree["checks"] if not check["ok"]}
    page = (tmp_path / "night" / "report.html").read_text()
    assert "<svg" in page
    assert "http" not in page.replace("http://www.w3.org/2000/svg", "")
    suite = ElementTree.parse(tmp_path / "night" / "junit.xml").getroot()
    assert suite.find("testcase/failure").get("message").startswith("sapling: drift")


def test_other_settings_are_a_drift(guard):
    result = guard("--set", "clean.voxel_m=0.05")
    assert result.exit_code == 1
    assert "points_used" in result.stderr


def test_tolerances_have_the_last_word(guard, refs, today):
    report = today / "sapling" / "report.json"
    figures = json.loads(report.read_text())
    report.write_text(json.dumps(figures | {"height_m": figures["height_m"] * 1.05}))
    assert guard("--models", today).exit_code == 1
    (refs / "tolerances.toml").write_text("[trees.sapling]\nheight_m = {relative = 0.1}\n")
    assert guard("--models", today).exit_code == 0
    (refs / "tolerances.toml").write_text("[trees.sapling]\nheigth_m = {relative = 0.1}\n")
    result = guard("--models", today)
    assert result.exit_code == 3
    assert "'heigth_m' is not measured" in result.stderr


def test_a_figure_that_is_lost_is_a_drift(guard, today):
    report = today / "sapling" / "report.json"
    report.write_text(json.dumps(json.loads(report.read_text()) | {"dbh_cm": None}))
    result = guard("--models", today)
    assert (result.exit_code, "unknown" in result.stderr) == (1, True)


def test_new_and_missing_trees_are_named(guard, today):
    (today / "sapling").rename(today / "elm")
    for path in (today / "elm").glob("sapling*"):
        path.rename(path.with_name(path.name.replace("sapling", "elm")))
    result = guard("--models", today)
    assert result.exit_code == 1
    assert "sapling: missing: " in result.stderr
    assert "elm: new: has no reference yet" in result.stdout


def test_a_cloud_that_is_gone_could_not_be_checked(guard, refs, sapling, tmp_path):
    path = refs / "sapling" / "reference.json"
    path.write_text(path.read_text().replace(str(sapling), str(tmp_path / "gone.xyz")))
    result = guard()
    assert result.exit_code == 3
    assert "--clouds" in result.stderr
    assert guard("--clouds", sapling.parent).exit_code == 0


@pytest.mark.parametrize(
    ("spoilt", "words"),
    [
        (lambda text: text.replace('"version": 1\n', '"version": 2\n'), "newer treepipe"),
        (lambda text: text[:100], "accept the tree again"),
        (lambda _: "{}", "accept the tree again"),
    ],
)
def test_references_that_cannot_be_read(guard, refs, spoilt, words):
    path = refs / "sapling" / "reference.json"
    path.write_text(spoilt(path.read_text()))
    result = guard()
    assert (result.exit_code, words in result.stderr) == (3, True), result.stderr


def test_a_model_that_was_changed_behind_its_back(guard, refs):
    with (refs / "sapling" / "sapling.ls.json").open("a") as file:
        file.write("\n")
    result = guard()
    assert (result.exit_code, "is not the model that was accepted" in result.stderr) == (3, True)


def test_no_references_at_all(call, tmp_path):
    result = call("regress", "run", "--refs", tmp_path / "none", "--out", tmp_path / "night")
    assert (result.exit_code, "no such folder of references" in result.stderr) == (3, True)


@pytest.mark.parametrize("arguments", [("--set", "clean.voxl_m=1"), ("--clouds", "a", "--models", "b")])
def test_wrong_usage(guard, arguments):
    assert guard(*arguments).exit_code == 2


def test_accept_of_an_empty_folder_names_the_remedy(call, tmp_path):
    (tmp_path / "empty").mkdir()
    result = call("regress", "accept", tmp_path / "empty", "--refs", tmp_path / "refs")
    says = "no folder in it has a report.json; give the --out of a `treepipe run`"
    assert (result.exit_code, says in result.stderr) == (1, True)
    assert not (tmp_path / "refs").exists()


def test_accept_names_what_there_is(call, made, tmp_path):
    result = call("regress", "accept", made, "--refs", tmp_path / "refs", "--only", "elm")
    assert (result.exit_code, "there is sapling" in result.stderr) == (1, True)
