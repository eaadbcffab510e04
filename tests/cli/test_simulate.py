"""`treepipe simulate`: trees through the years, as a person asks for them."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline.exchange import read_model
from pipeline.growth.species import SPECIES
from pipeline.view.graphics import NoGraphicsError, prepare


@pytest.fixture
def oak(made):
    """A reconstructed sapling."""
    return made / "sapling" / "sapling.ls.json"


def can_draw():
    try:
        prepare()
    except NoGraphicsError:
        return False
    return True


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_bud_becomes_a_tree(call, tmp_path):
    out = tmp_path / "out"
    result = call(
        "simulate", "--years", 12, "--every", 6, "-o", out, "--formats", "lsjson,qsm", "--no-picture"
    )
    assert result.exit_code == 0, result.stderr
    files = [f"year_{year:03d}{end}" for year in (6, 12) for end in (".ls.json", ".qsm.csv")]
    assert names(out) == [*files, "years.json"]
    log = json.loads((out / "years.json").read_text())
    assert [entry["year"] for entry in log["log"]] == list(range(1, 13))
    heights = [entry["height_m"] for entry in log["log"]]
    assert heights == sorted(heights)
    assert [model["year"] for model in log["models"]] == [6, 12]
    tree = read_model(out / "year_012.ls.json")
    assert len(tree) == log["log"][-1]["metamers"] + 1
    assert f"year 12: {log['models'][-1]['height_m']:.2f} m high" in result.stdout


def test_a_reconstructed_tree_grows_on_where_it_stands(call, oak, tmp_path):
    out = tmp_path / "out"
    more = ("--formats", "npz,cityjson,mesh", "--no-picture", "--set", "shed_threshold=0")
    result = call("simulate", oak, "--years", 3, "--every", 2, "-o", out, *more)
    assert result.exit_code == 0, result.stderr
    ends = (".city.json", ".mesh.ply", ".npz")
    assert names(out) == [*(f"year_{year:03d}{end}" for year in (0, 2, 3) for end in ends), "years.json"]
    before, first, last = (read_model(path) for path in (oak, out / "year_000.npz", out / "year_003.npz"))
    np.testing.assert_array_equal(first.skeleton.xyz, before.skeleton.xyz)
    assert {node.tobytes() for node in before.skeleton.xyz} <= {node.tobytes() for node in last.skeleton.xyz}
    assert last.metadata["growth"]["years"] == 3
    assert last.trunk.dbh_m >= before.trunk.dbh_m
    assert call("validate", out / "year_003.city.json").exit_code == 0


def test_the_same_seed_writes_the_same_bytes(call, oak, tmp_path):
    def made(name, *more):
        result = call("simulate", oak, "--years", 3, "-o", tmp_path / name, "--no-picture", *more)
        assert result.exit_code == 0, result.stderr
        return [(tmp_path / name / file).read_bytes() for file in ("year_003.ls.json", "years.json")]

    one = made("one", "--seed", 3)
    assert made("two", "--seed", 3) == one
    assert made("other", "--seed", 4)[0] != one[0]
    assert made("space", "--seed", 3, "--light", "space")[0] != one[0]
    assert made("priority", "--seed", 3, "--allocation", "priority")[0] != one[0]


def test_shade_keeps_a_tree_from_growing(call, tmp_path):
    def height(*more):
        result = call("simulate", "--years", 8, "-o", tmp_path / "out", "--no-picture", "--overwrite", *more)
        assert result.exit_code == 0, result.stderr
        return json.loads((tmp_path / "out" / "years.json").read_text())["log"][-1]["height_m"]

    roof = np.stack(np.meshgrid(*2 * [np.arange(-1, 1, 0.04)]), axis=-1).reshape(-1, 2)
    np.savetxt(tmp_path / "roof.xyz", np.column_stack([roof, np.full(len(roof), 0.7)]), fmt="%.3f")
    assert height("--shade", tmp_path / "roof.xyz") < 0.8 < height()
    assert height("--shade", _tall(call, tmp_path)) <= height()


def _tall(call, folder):
    """Return a model of a neighbour."""
    assert call("simulate", "--years", 14, "-o", folder / "tall", "--no-picture").exit_code == 0
    return folder / "tall" / "year_014.ls.json"


@pytest.mark.skipif(not can_draw(), reason="this machine has no graphics")
def test_the_years_are_drawn_and_filmed(call, tmp_path):
    out = tmp_path / "out"
    result = call("simulate", "--years", 6, "--every", 3, "-o", out, "--species", "conifer")
    assert result.exit_code == 0, result.stderr
    pictures = [np.asarray(Image.open(out / f"year_{year:03d}.png").convert("RGB")) for year in (3, 6)]
    inked = [(picture.min(axis=2) < 200).sum() for picture in pictures]
    assert inked[1] > inked[0] > 100
    green = (pictures[1].astype(int)[..., 1] > pictures[1].astype(int)[..., 0] + 20).sum()
    assert green > 50
    with Image.open(out / "growth.gif") as film:
        assert (film.n_frames, film.info["loop"]) == (2, 0)


def test_a_machine_without_graphics_still_has_its_models(call, tmp_path, monkeypatch):
    def none():
        msg = "nothing to draw with"
        raise NoGraphicsError(msg)

    monkeypatch.setattr("pipeline.view.years.prepare", none)
    result = call("simulate", "--years", 5, "-o", tmp_path / "out")
    assert result.exit_code == 0
    assert "no pictures: nothing to draw with" in result.stderr
    assert names(tmp_path / "out") == ["year_005.ls.json", "years.json"]


@pytest.mark.parametrize("species", list(SPECIES))
def test_every_species_grows(call, tmp_path, species):
    out = tmp_path / "out"
    result = call("simulate", "--years", 9, "--every", 9, "-o", out, "--species", species, "--no-picture")
    assert (result.exit_code, result.stderr) == (0, "")
    log = json.loads((out / "years.json").read_text())
    assert log["species"] == species
    assert log["options"]
    assert log["models"][0]["branches"] > 5


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (("--years", -1), 2, "--years"),
        (("--years", 1001), 2, "--years"),
        (("--years", 2, "--every", 0), 2, "--every"),
        (("--years", 2, "--species", "popler"), 2, "unknown species 'popler', do you mean poplar"),
        (("--years", 2, "--species", "x"), 2, "known: apple, broadleaf, conifer, poplar"),
        (("--years", 2, "--set", "alpa=3"), 2, "unknown key alpa, do you mean alpha"),
        (("--years", 2, "--set", "alpha=-3"), 2, "alpha = -3 is not allowed; give a number > 0"),
        (("--years", 2, "--set", "alpha"), 2, "is not KEY=VALUE"),
        (("--years", 2, "--formats", "lsjso"), 2, "do you mean lsjson"),
        (("--years", 2, "--light", "sun"), 2, "--light"),
        (("none.ls.json", "--years", 2), 1, "none.ls.json: there is no such file"),
        (("--years", 2, "--shade", "none.laz"), 1, "none.laz"),
        (("--years", 2, "--params", "none.toml"), 1, "none.toml: there is no such file"),
        (("--years", 2, "--events", "none.toml"), 1, "none.toml: there is no such file"),
    ],
)
def test_wrong_usage(call, tmp_path, monkeypatch, arguments, code, said):
    monkeypatch.chdir(tmp_path)
    result = call("simulate", *arguments, "-o", "out", "--no-picture")
    assert (result.exit_code, said in result.stderr) == (code, True), result.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("event", "said"),
    [
        (
            'year = 9\noperation = "open-centre"',
            "an event is of year 9, but growth is from year 0 to 2; move it",
        ),
        (
            'year = 1\noperation = "cut-to-bud"\nposition = [900.0, 0.0, 2.0]',
            "event of year 1, cut-to-bud: no branch is within 0.5 m of (900.00, 0.00, 2.00); the nearest is",
        ),
        (
            'year = 2\noperation = "cut-to-bud"\norder = 12',
            "event of year 2, cut-to-bud: no branch fits order = 12; the nearest is of order ",
        ),
        ('year = 1\noperation = "cut-to-bud"\norder = 0', "the cut goes through the foot of the tree at ("),
    ],
)
def test_impossible_events_are_named(call, oak, tmp_path, event, said):
    (tmp_path / "events.toml").write_text(f"[[event]]\n{event}\n")
    given = ("--years", 2, "--events", tmp_path / "events.toml", "-o", tmp_path / "out", "--no-picture")
    result = call("simulate", oak, *given)
    assert (result.exit_code, said in result.stderr) == (2, True), result.stderr


@pytest.mark.parametrize(
    ("text", "code", "said"),
    [
        ("", 0, "events.toml: has no events, so none is done; write tables [[event]], or leave it out"),
        ("[[event]\n", 1, "events.toml: is not a file of events in TOML"),
        ('[[events]]\nyear = 1\noperation = "thin"\n', 2, "events is not known here; a file of events has"),
        ('[[event]]\nyaer = 1\noperation = "thin"\n', 2, "unknown key yaer, do you mean year?"),
        ('[[event]]\nyear = 9\noperation = "thin"\n', 2, "events.toml: an event is of year 9, but growth is"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("command", ["simulate", "grow"])
def test_files_of_events_that_say_nothing_or_something_wrong(
    call, oak, tmp_path, command, text, code, said
) -> None:
    (tmp_path / "events.toml").write_text(text)
    given = (oak, "--years", 1, "--events", tmp_path / "events.toml")
    more = ("-o", tmp_path / "out", "--no-picture")
    if command == "grow":
        more = ("-o", tmp_path / "out.ls.json", "--method", "organic")
    result = call(command, *given, *more)
    assert (result.exit_code, said in result.stderr) == (code, True), result.stderr
    assert not result.stderr.startswith(f"treepipe: {oak}")


def test_several_roots_and_folders_are_no_model(call, tmp_path):
    (tmp_path / "two.swc").write_text(
        "1 1 0 0 0 0.1 -1\n2 1 0 0 1 0.1 1\n3 1 5 0 0 0.1 -1\n4 1 5 0 1 0.1 3\n"
    )
    for name, said in (
        ("two.swc", "line 3 has no parent, but neither has line 1; keep one tree a file"),
        ("", ""),
    ):
        for words in (("simulate", "--years", 1), ("prune", "--operation", "thin")):
            result = call(words[0], tmp_path / name, *words[1:], "-o", tmp_path / "out.npz")
            assert (result.exit_code, said in result.stderr) == (1, True), result.stderr
            assert (
                name
                or "is a directory, and no model that can be read; give one of the files" in result.stderr
            )


def test_what_cannot_be_written_is_named(call, oak, tmp_path):
    (tmp_path / "file").write_text("here")
    for words, target in (
        (("simulate", oak, "--years", 1, "--no-picture"), "years"),
        (("prune", oak, "--operation", "thin"), "thin.npz"),
    ):
        result = call(*words, "-o", tmp_path / "file" / target)
        assert result.exit_code == 1
        assert "cannot be written" in result.stderr
        assert "choose another folder with -o" in result.stderr
        assert "--out" not in result.stderr


@pytest.mark.parametrize("option", ["--params", "--events"])
def test_a_directory_is_no_file_of_settings(call, tmp_path, option):
    result = call("simulate", "--years", 1, option, tmp_path, "-o", tmp_path / "out", "--no-picture")
    assert result.exit_code == 1
    assert f"is a directory; give {option} the TOML file in it" in result.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("simulate", "--years", "1", "--params", "."), "is a directory; give --params"),
        (("simulate", ".", "--years", "1"), "is a directory, and no model"),
        (("simulate", "--years", "1", "--no-picture"), "choose another folder with -o"),
    ],
)
def test_the_installed_command_names_directories(tmp_path, words, said):
    (tmp_path / "file").write_text("here")
    command = [Path(sys.executable).with_name("treepipe"), *words, "-o", "file/out"]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (result.returncode, said in result.stderr, "--out" in result.stderr) == (1, True, False), (
        result.stderr
    )


def test_a_skeleton_has_no_radii_to_grow(call, made, tmp_path):
    flat = made / "sapling" / "sapling.skeleton.ply"
    lines = flat.read_bytes()
    result = call("simulate", flat, "--years", 1, "-o", tmp_path / "out", "--no-picture")
    assert result.exit_code == 0 or "without radii" in result.stderr
    bare = tmp_path / "bare.skeleton.ply"
    bare.write_text(
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
        "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n0 0 0\n0 0 1\n0 1\n"
    )
    result = call("simulate", bare, "--years", 1, "-o", tmp_path / "bare", "--no-picture")
    assert (result.exit_code, "is a skeleton without radii" in result.stderr) == (1, True)
    assert lines == flat.read_bytes()


def test_events_are_replayed_and_told(call, oak, tmp_path):
    events = tmp_path / "events.toml"
    events.write_text('[[event]]\nyear = 2\noperation = "crown-raise"\nheight_m = 1.6\n')

    def made(name, *more):
        result = call("simulate", oak, "--years", 4, "-o", tmp_path / name, "--no-picture", *more)
        assert result.exit_code == 0, result.stderr
        log = json.loads((tmp_path / name / "years.json").read_text())
        return log["events"], read_model(tmp_path / name / "year_004.ls.json")

    (told,), raised = made("raised", "--events", events)
    again, plain = made("again", "--events", events)[1], made("plain")[1]
    assert (told["what"], told["year"], told["removed"] > 0) == ("crown-raise", 2, True)
    assert raised.skeleton.xyz.tobytes() == again.skeleton.xyz.tobytes()

    def lowest(tree):
        """Return the height of the lowest branch."""
        starts = np.flatnonzero(tree.skeleton.branch_start)
        return tree.skeleton.xyz[starts, 2].min() - tree.skeleton.xyz[0, 2]

    assert lowest(plain) < 1.6
    assert lowest(raised) > lowest(plain)
    late = call("simulate", oak, "--years", 1, "-o", tmp_path / "late", "--events", events, "--no-picture")
    assert (late.exit_code, "an event is of year 2, but growth is from year 0 to 1" in late.stderr) == (
        2,
        True,
    )


def test_growth_that_becomes_too_large_stops_with_the_number(call, tmp_path):
    out = tmp_path / "out"
    result = call("simulate", "--years", 30, "-o", out, "--set", "most_metamers=60", "--no-picture")
    assert result.exit_code == 2
    assert "more than most_metamers, 60" in result.stderr
    assert result.stderr.startswith("treepipe: growth stops before year ")
    log = json.loads((out / "years.json").read_text())
    assert 0 < log["done"] < 30
    assert "year_005.ls.json" in names(out)


def test_nothing_is_overwritten_unasked(call, tmp_path):
    arguments = ("simulate", "--years", 5, "-o", tmp_path / "out", "--no-picture")
    assert call(*arguments).exit_code == 0
    again = call(*arguments)
    assert (again.exit_code, "exists already; add --overwrite" in again.stderr) == (2, True)
    assert call(*arguments, "--overwrite").exit_code == 0


def test_a_bare_pole_is_warned_of(call, tmp_path):
    out = tmp_path / "out"
    result = call("simulate", "--years", 5, "-o", out, "--set", "alpha=1.5", "--no-picture")
    assert result.exit_code == 0
    assert "treepipe: a lateral bud in good light gets" in result.stderr
