"""The stages one by one, export, info and validate."""

from __future__ import annotations

import json

import pytest


def test_the_stages_one_by_one_give_the_model_of_run(call, sapling, made, tmp_path):
    cloud, skeleton, model = tmp_path / "c.laz", tmp_path / "s.skeleton.ply", tmp_path / "m.npz"
    for arguments in (
        ["clean", sapling, "-o", cloud],
        ["skeleton", cloud, "-o", skeleton],
        ["fit", skeleton, "--cloud", cloud, "-o", model],
    ):
        result = call(*arguments)
        assert result.exit_code == 0, result.output
        again = call(*arguments)
        assert again.exit_code == 2
        assert "--overwrite" in again.stderr
    result = call("export", model, "-o", tmp_path, "--formats", "lsjson,qsm")
    assert result.exit_code == 0, result.output
    assert result.stdout.split() == [str(tmp_path / "m.ls.json"), str(tmp_path / "m.qsm.csv")]
    here = json.loads(call("info", model, "--json").stdout)
    there = json.loads((made / "sapling" / "report.json").read_text())
    assert here["nodes"] == there["nodes"]
    assert here["volume_l"] == pytest.approx(there["volume_l"], rel=1e-6)


def test_export_does_not_overwrite_unasked(call, made, tmp_path):
    model = made / "sapling" / "sapling.ls.json"
    assert call("export", model, "-o", tmp_path, "--formats", "qsm").exit_code == 0
    assert call("export", model, "-o", tmp_path, "--formats", "qsm").exit_code == 2
    assert call("export", model, "-o", tmp_path, "--formats", "qsm", "--overwrite").exit_code == 0


@pytest.mark.parametrize(
    ("suffix", "kind"),
    [
        (".ls.json", "tree"),
        (".city.json", "tree"),
        (".skeleton.ply", "tree"),
        (".qsm.csv", "tree"),
        (".mesh.ply", "mesh"),
    ],
)
def test_info_tells_what_a_file_holds(call, made, suffix, kind):
    file = made / "sapling" / f"sapling{suffix}"
    known = json.loads(call("info", file, "--json").stdout)
    keys = "kind nodes branches height_m dbh_cm volume_l length_m crs extent bytes bytes_per_node"
    assert set(keys.split()) <= set(known)
    assert known["kind"] == kind
    assert known["bytes"] == file.stat().st_size
    if kind == "tree":
        report = json.loads((made / "sapling" / "report.json").read_text())
        assert known["branches"] == report["branches"]
        assert known["bytes_per_node"] == pytest.approx(known["bytes"] / known["nodes"], abs=1e-5)


def test_info_of_a_cloud(call, sapling, points):
    known = json.loads(call("info", sapling, "--json").stdout)
    assert (known["kind"], known["points"]) == ("cloud", len(points))
    assert known["extent"] == pytest.approx([*points.min(axis=0), *points.max(axis=0)], abs=1e-6)
    assert "points" in call("info", sapling).stdout


def test_info_of_a_missing_file(call, tmp_path):
    result = call("info", tmp_path / "gone.ls.json")
    assert result.exit_code == 1
    assert "no such file" in result.stderr


@pytest.mark.parametrize("suffix", [".ls.json", ".city.json"])
def test_our_own_files_are_valid(call, made, suffix):
    result = call("validate", made / "sapling" / f"sapling{suffix}", "--json")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout) == {"valid": True, "errors": []}


@pytest.mark.parametrize("suffix", [".ls.json", ".city.json"])
def test_damaged_files_are_not(call, made, tmp_path, suffix):
    whole = (made / "sapling" / f"sapling{suffix}").read_text()
    damaged = tmp_path / f"a{suffix}"
    damaged.write_text(whole[: len(whole) // 2])
    result = call("validate", damaged, "--json")
    assert result.exit_code == 1
    found = json.loads(result.stdout)
    assert found["valid"] is False
    assert all(set(error) == {"where", "what", "remedy"} for error in found["errors"])
    assert call("validate", damaged).exit_code == 1


def test_names_keep_their_capitals(call, tmp_path):
    (tmp_path / "a.city.json").write_text("")
    assert "Give a CityJSON file." in call("validate", tmp_path / "a.city.json").stdout


def test_a_schema_is_for_cityjson(call, made, tmp_path):
    result = call("validate", made / "sapling" / "sapling.ls.json", "--schema", tmp_path / "schema.json")
    assert (result.exit_code, "is for CityJSON" in result.stderr) == (2, True)


def test_a_solid_that_is_not_closed_is_found(call, made, tmp_path):
    document = json.loads((made / "sapling" / "sapling.city.json").read_text())
    geometry = next(
        g for thing in document["CityObjects"].values() for g in thing["geometry"] if g["type"] == "Solid"
    )
    geometry["boundaries"][0].pop()
    (tmp_path / "a.city.json").write_text(json.dumps(document))
    result = call("validate", tmp_path / "a.city.json")
    assert result.exit_code == 1
    assert "Solid" in result.stdout or "shell" in result.stdout
