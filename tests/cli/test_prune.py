"""`treepipe prune`: one operation on a model, as a person asks for it."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.cli.prune import ABOUT, parsed
from pipeline.errors import UsageError
from pipeline.exchange import read_model
from pipeline.formats.model_npz import write
from pipeline.growth import GrowthOptions, grow
from tests.growth.pruning.test_operations import EXAMPLES


@pytest.fixture
def oak(made):
    """A reconstructed sapling, 3 m high."""
    return made / "sapling" / "sapling.ls.json"


def rows(tree):
    """Return what a tree holds, node by node, to the last bit."""
    return {
        (*xyz, radius) for xyz, radius in zip(tree.skeleton.world.tolist(), tree.radius.tolist(), strict=True)
    }


def test_a_raised_crown_leaves_the_rest_as_it_was(call, oak, tmp_path) -> None:
    out = tmp_path / "out.npz"
    result = call("prune", oak, "--operation", "crown-raise", "--height-m", 1.5, "-o", out)
    assert result.exit_code == 0, result.stderr
    before, after = read_model(oak), read_model(out)
    assert rows(after) < rows(before)
    low = after.skeleton.world[:, 2] < before.skeleton.world[0, 2] + 1.5
    assert (after.skeleton.order[low] == 0).all()
    assert len(after) < len(before)
    assert " cuts, " in result.stdout
    gone = before.skeleton.length.sum() - after.skeleton.length.sum()
    assert f"{gone:.2f} m of {before.skeleton.length.sum():.2f} m of wood gone" in result.stdout


@pytest.mark.parametrize("name", [name for name in ABOUT if name != "espalier"])
def test_every_operation_answers(name, call, oak, tmp_path) -> None:
    more = []
    for key, value in EXAMPLES[name].items():
        shown = ",".join(map(str, value)) if isinstance(value, tuple) else value
        more += ["--all"] if value is True else [f"--{key.replace('_', '-')}", shown]
    more += ["--thickest-m", 0.5] if name == "bend-and-tie" else []
    out = tmp_path / "out.ls.json"
    result = call("prune", oak, "--operation", name, *more, "-o", out)
    assert result.exit_code == 0, result.stderr
    assert len(read_model(out)) > 1


def test_an_espalier_is_trained_from_a_young_tree_only(call, oak, tmp_path) -> None:
    young, out = tmp_path / "young.npz", tmp_path / "out.npz"
    write(grow(GrowthOptions(), 6, seed=1).to_model(), young)
    result = call("prune", young, "--operation", "espalier", "--tiers", 2, "-o", out)
    assert result.exit_code == 0, result.stderr
    assert len(read_model(out)) < len(read_model(young))
    result = call("prune", oak, "--operation", "espalier", "-o", out, "--overwrite")
    assert result.exit_code == 2
    assert "trained from a young tree; this one would be cut where it is" in result.stderr


def test_a_cut_between_nodes_adds_one_and_moves_none(call, oak, tmp_path) -> None:
    out = tmp_path / "out.npz"
    result = call("prune", oak, "--operation", "cut-to-bud", "--order", 0, "--length-m", 2, "-o", out)
    assert result.exit_code == 0, result.stderr
    before, after = read_model(oak), read_model(out)
    assert len(rows(after) - rows(before)) <= 1
    stem = after.skeleton.paths[0]
    assert 1.85 < after.skeleton.length[stem].sum() <= 2.0 + 1e-9


def test_a_position_is_in_the_coordinates_of_the_file(call, oak, tmp_path) -> None:
    before = read_model(oak)
    longest = max(before.skeleton.paths[1:], key=len)
    place = ",".join(f"{value:.4f}" for value in before.skeleton.world[longest[1]])
    out = tmp_path / "out.npz"
    result = call("prune", oak, "--operation", "cut-to-bud", f"--position={place}", "-o", out)
    assert result.exit_code == 0, result.stderr
    assert set(read_model(out).skeleton.world[:, 2]) < set(before.skeleton.world[:, 2]) | {None}


def test_ties_are_said_to_need_growth_and_idle_work_is_told(call, oak, tmp_path) -> None:
    out = tmp_path / "out.npz"
    result = call("prune", oak, "--operation", "stake", "-o", out)
    assert result.exit_code == 0
    assert "ties act as the tree grows" in result.stderr
    assert rows(read_model(out)) == rows(read_model(oak))
    result = call("prune", oak, "--operation", "limit-length", "--length-m", 50, "-o", out, "--overwrite")
    assert result.exit_code == 0
    assert "limit-length finds nothing to do" in result.stderr
    assert "It looks for wood farther than length_m from where its branch begins; give a" in result.stderr


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--operation", "thinn"], "unknown operation 'thinn', do you mean thin?"),
        (["--operation", "thin", "--shar", 0.1], "thin: unknown key shar, do you mean share?"),
        (["--operation", "thin", "--share", 0.9], "share = 0.9 is not allowed"),
        (["--operation", "cut-to-bud", "--position", "-9,0,0"], "no branch is within 0.5 m of (-9.00, "),
        (["--operation", "cut-to-bud", "--order", 0], "goes through the foot"),
        (["--operation", "cut-to-bud", "--order", 9], "no branch fits order = 9; the nearest is of order "),
        (["--operation", "stake", "--direction", "1,0"], "direction = 1,0 is not allowed; give three"),
        (["--operation", "facing-bud"], "must know which branches are meant"),
        (["--operation", "thin", "--share"], "--share has no value"),
        ([], "Missing option '--operation'"),
    ],
)  # fmt: skip
def test_wrong_usage_exits_2_with_the_remedy(words, told, call, oak, tmp_path) -> None:
    result = call("prune", oak, "-o", tmp_path / "out.npz", *words)
    assert result.exit_code == 2, result.stderr
    assert told in result.stderr
    assert not (tmp_path / "out.npz").exists()


def test_results_are_not_overwritten_unasked(call, oak, tmp_path) -> None:
    out = tmp_path / "out.npz"
    out.write_text("mine")
    result = call("prune", oak, "--operation", "thin", "-o", out)
    assert result.exit_code == 2
    assert out.read_text() == "mine"


def test_words_are_told_apart() -> None:
    path, values = parsed(["--position", "-1,2,3", "a.npz", "--shape", "box", "--share=0.1"])
    assert path.name == "a.npz"
    assert values == {"position": [-1, 2, 3], "shape": "box", "share": 0.1}
    with pytest.raises(UsageError, match="takes one model, not 2"):
        parsed(["a.npz", "b.npz"])


def test_help_lists_the_operations(call) -> None:
    text = " ".join(call("prune", "--help").stdout.split())
    for name, about in ABOUT.items():
        assert f"{name} {about}" in text.replace("- ", "-"), name
    assert np.all(
        [word in text for word in ("--position", "--lowest-m", "--order", "--azimuth-deg", "--all")]
    )
