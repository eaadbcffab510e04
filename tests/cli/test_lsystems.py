"""The commands for L-systems, on the tree that `treepipe run` has made."""

from __future__ import annotations

import json

import numpy as np
import pytest

from pipeline.exchange import read_model
from pipeline.lsystem import ArchiveWriter, read_lsjson

RECURSIVE = {
    "recursions": 2,
    "axiom": "F",
    "rules": {"F": "F[+F]F"},
    "trunk": {"anchor": [1.5, 2.5, 0.5], "radius": 0.1},
    "dimensions": {"forward": 0.5, "rotation": 22.5, "roll": 20},
    "degrees": True,
}


@pytest.fixture
def oak(made, tmp_path):
    """An .ls.json with measured radii."""
    path = tmp_path / "oak.ls.json"
    path.write_text((made / "sapling" / "sapling.ls.json").read_text())
    return path


@pytest.fixture
def rules(tmp_path):
    return save(tmp_path / "rules.ls.json", RECURSIVE)


def save(path, document):
    path.write_text(json.dumps(document))
    return path


def test_generalise_says_what_it_saved_and_what_it_moved(call, oak, tmp_path):
    result = call("generalise", oak, "-o", tmp_path / "short.ls.json", "--steps", 2, "--rules", 4)
    assert result.exit_code == 0, result.stderr
    first, second = result.stdout.splitlines()
    assert first.startswith(f"{tmp_path / 'short.ls.json'}: ")
    assert "characters (" in first
    assert "rule" in first
    assert second.startswith("nodes move by 0.0 mm (median)")
    before, after = read_lsjson(oak), read_lsjson(tmp_path / "short.ls.json")
    assert len(after["axiom"]) < len(before["axiom"])
    assert len(read_model(tmp_path / "short.ls.json")) == len(read_model(oak))


def test_repeats_are_found(call, rules, tmp_path):
    expanded, short = tmp_path / "long.ls.json", tmp_path / "short.ls.json"
    document = {**RECURSIVE, "axiom": call("expand", rules, "--recursions", 6).stdout.strip()}
    save(expanded, {**document, "rules": {}, "recursions": 0})
    result = call("generalise", expanded, "-o", short, "--repeats", 0.001)
    assert result.exit_code == 0, result.stderr
    assert short.stat().st_size < 0.8 * expanded.stat().st_size
    long, again = read_model(expanded), read_model(short)
    np.testing.assert_allclose(long.skeleton.world, again.skeleton.world, atol=0.0011)


def test_generalise_without_a_wish_is_wrong_usage(call, oak, tmp_path):
    result = call("generalise", oak, "-o", tmp_path / "short.ls.json")
    assert (result.exit_code, "--steps" in result.stderr) == (2, True)


def test_grow_makes_only_what_is_named(call, oak, tmp_path):
    thicker = tmp_path / "thicker.ls.json"
    assert call("grow", oak, "-o", thicker, "--years", 2, "--thickness", 0.5).exit_code == 0
    before, after = read_model(oak), read_model(thicker)
    np.testing.assert_array_equal(before.skeleton.xyz, after.skeleton.xyz)
    np.testing.assert_allclose(after.radius, 2.25 * before.radius, atol=0.003)


def test_grow_by_itself_grows(call, oak, tmp_path):
    result = call("grow", oak, "-o", tmp_path / "older.ls.json.zst", "--years", 1)
    assert result.exit_code == 0, result.stderr
    before, after = read_model(oak), read_model(tmp_path / "older.ls.json.zst")
    assert len(after) > len(before)
    assert after.skeleton.length.sum() > 1.05 * before.skeleton.length.sum()
    assert f"{len(before)} -> {len(after)} nodes" in result.stdout
    again = call("grow", tmp_path / "older.ls.json.zst", "-o", tmp_path / "oldest.ls.json", "--years", 1)
    assert again.exit_code == 0, again.stderr


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--speed", "0.05", "at least 0.1"),
        ("--ratio", "9", "--ratio 9"),
        ("--thickness", "-1", "--thickness"),
    ],
)
def test_growth_out_of_range_is_wrong_usage(call, oak, tmp_path, option, value, words):
    result = call("grow", oak, "-o", tmp_path / "older.ls.json", "--years", 1, option, value)
    assert (result.exit_code, words in result.stderr) == (2, True), result.stderr


@pytest.mark.parametrize(
    ("more", "text"),
    [
        ([], "F[+F]F[+F[+F]F]F[+F]F"),
        (["--recursions", "0"], "F"),
        (["--recursions", "1"], "F[+F]F"),
    ],
)
def test_expand_prints_the_string(call, rules, more, text):
    result = call("expand", rules, *more)
    assert (result.exit_code, result.stdout) == (0, f"{text}\n")


def test_rules_without_end_are_refused_with_what_they_would_reach(call, tmp_path):
    path = save(tmp_path / "endless.ls.json", {**RECURSIVE, "recursions": 40, "axiom": "F"})
    result = call("expand", path)
    assert result.exit_code == 1
    assert f"{path}: the rules grow the L-string to more than 1,000,000,000,000,000" in result.stderr


@pytest.mark.parametrize("command", ["expand", "generalise", "grow"])
@pytest.mark.parametrize(
    ("suffix", "says"),
    [
        (".swc", "is no L-system; make one of it with `treepipe convert {path} oak.ls.json`"),
        (".city.json", "is no L-system; make one of it with `treepipe convert {path} oak.ls.json`"),
        (".obj", "is a drawn surface, and no model that can be read; give "),
        (".laz", "is a point cloud, and no model that can be read; make one of it with `treepipe run`"),
    ],
)
def test_what_is_no_lsystem_is_told_how_to_become_one(call, oak, tmp_path, command, suffix, says):
    path = tmp_path / f"oak{suffix}"
    if suffix == ".laz":
        path.write_bytes(b"LASF")
    else:
        assert call("convert", oak, path).exit_code == 0
    more = {
        "expand": [],
        "generalise": ["-o", tmp_path / "y.ls.json", "--steps", 1],
        "grow": ["-o", tmp_path / "y.ls.json", "--method", "scale", "--years", 1],
    }
    result = call(command, path, *more[command])
    assert (result.exit_code, f"{path}: {says.format(path=path)}" in result.stderr) == (1, True), (
        result.stderr
    )


@pytest.mark.parametrize("profile", ["abop", "lpy", "groimp", "houdini"])
def test_an_lstring_comes_back(call, oak, tmp_path, profile):
    target, again = tmp_path / "oak.lstring", tmp_path / "again.ls.json"
    result = call("convert", oak, target, "--profile", profile)
    assert result.exit_code == 0, result.stderr
    assert f"profile {profile}" in target.read_text().splitlines()[0]
    assert "does not hold radius source, radius error" in result.stderr
    assert call("convert", target, again).exit_code == 0
    ours, theirs = read_model(oak), read_model(again)
    np.testing.assert_allclose(theirs.skeleton.world, ours.skeleton.world, atol=0.0012)


def test_a_profile_that_the_suffix_has_not_is_wrong_usage(call, oak, tmp_path):
    result = call("convert", oak, tmp_path / "oak.qsm.csv", "--profile", "lpy")
    assert (result.exit_code, "have none" in result.stderr) == (2, True)
    result = call("convert", oak, tmp_path / "oak.lstring", "--profile", "lpj")
    assert (result.exit_code, "--profile lpj" in result.stderr) == (2, True)


def test_a_tree_of_an_archive(call, oak, tmp_path):
    archive = tmp_path / "park.lsjson.jsonl.zst"
    with ArchiveWriter(archive) as writer:
        for name in ("elm", "oak"):
            writer.add(name, read_lsjson(oak))
    taken = tmp_path / "taken.ls.json"
    assert call("convert", f"{archive}#oak", taken).exit_code == 0
    assert read_lsjson(taken)["id"] == "oak"
    assert read_lsjson(taken)["axiom"] == read_lsjson(oak)["axiom"]
    assert call("expand", f"{archive}#oak").stdout == call("expand", oak).stdout
    missing = call("convert", f"{archive}#ask", tmp_path / "x.ls.json")
    assert missing.exit_code == 1
    assert "ask" in missing.stderr


@pytest.mark.parametrize(
    ("change", "where", "words"),
    [
        ({"axiom": "F(1)?F", "rules": {}}, "L-string, character 4", "not part of an L-string"),
        ({"axiom": "F(1)[F", "rules": {}}, "L-string, character 4", "no partner"),
        ({"axiom": "F(nan)", "rules": {}}, "L-string, character 0", "not a finite number"),
        ({"trunk": {"anchor": [1, 2]}}, "file", "trunk.radius"),
        ({"axiom": 3}, "file", "axiom"),
    ],
)
def test_validate_names_the_first_fault(call, tmp_path, change, where, words):
    result = call("validate", save(tmp_path / "bad.ls.json", RECURSIVE | change), "--json")
    told = json.loads(result.stdout)
    assert (result.exit_code, told["valid"]) == (1, False)
    assert told["errors"][0]["where"] == where
    assert words in told["errors"][0]["what"]
    assert told["errors"][0]["remedy"]


def test_an_anchor_of_two_coordinates_is_taken_at_height_0(call, tmp_path):
    path = save(tmp_path / "flat.ls.json", RECURSIVE | {"trunk": {"anchor": [1.5, 2.5], "radius": 0.1}})
    result = call("validate", path)
    assert result.exit_code == 0
    assert "trunk.anchor has two coordinates; its height is taken as 0" in result.stderr
    assert read_model(path).skeleton.world[0].tolist() == [1.5, 2.5, 0.0]


@pytest.mark.parametrize("content", ["", "{", "[]", "null", '{"axiom": "F"}', '{"axiom": NaN}'])
@pytest.mark.parametrize("command", ["expand", "info", "validate"])
def test_what_is_no_lsystem(call, tmp_path, content, command):
    path = tmp_path / "bad.ls.json"
    path.write_text(content)
    result = call(command, path)
    assert result.exit_code == 1
    assert str(path) in result.output
    assert "Traceback" not in result.output
