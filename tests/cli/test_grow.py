"""`treepipe grow --method organic`: new shoots on the wood that stands."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.exchange import read_model


@pytest.fixture
def oak(made):
    """A reconstructed sapling."""
    return made / "sapling" / "sapling.ls.json"


def test_shoots_grow_and_what_stands_stays(call, oak, tmp_path):
    older = tmp_path / "older.ls.json"
    more = ("--species", "broadleaf", "--set", "shed_threshold=0", "--seed", 3)
    result = call("grow", oak, "-o", older, "--method", "organic", "--years", 4, *more)
    assert result.exit_code == 0, result.stderr
    before, after = read_model(oak), read_model(older)
    assert f"{len(before)} -> {len(after)} nodes" in result.stdout
    assert after.skeleton.length.sum() > 1.2 * before.skeleton.length.sum()
    off = np.linalg.norm(after.skeleton.world[:, None] - before.skeleton.world[None], axis=2).min(axis=0)
    assert off.max() < 0.0013
    assert after.trunk.dbh_m >= before.trunk.dbh_m - 1e-4


def test_no_year_is_the_same_tree(call, oak, tmp_path):
    again = tmp_path / "again.ls.json.zst"
    assert call("grow", oak, "-o", again, "--method", "organic", "--years", 0).exit_code == 0
    before, after = read_model(oak), read_model(again)
    assert len(before) == len(after)
    np.testing.assert_allclose(after.skeleton.world, before.skeleton.world, atol=0.0013)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--method", "organic", "--years", 2, "--speed", 0.2), "--speed goes with --method scale"),
        (("--years", 2, "--species", "apple"), "--species goes with --method organic"),
        (("--years", 2, "--set", "alpha=2"), "--set goes with --method organic"),
        (("--years", 2, "--seed", 0), "--seed goes with --method organic"),
        (("--years", 0), "--years 0: growth by scale needs a year"),
        (("--method", "organic", "--years", -2), "--years"),
        (("--method", "organic", "--years", 2, "--species", "oak"), "unknown species 'oak'"),
        (("--method", "organic", "--years", 2, "--set", "most_metamers=5"), "than most_metamers, 5"),
    ],
)
def test_wrong_usage(call, oak, tmp_path, arguments, said):
    result = call("grow", oak, "-o", tmp_path / "x.ls.json", *arguments)
    assert (result.exit_code, said in result.stderr) == (2, True), result.stderr
    assert not (tmp_path / "x.ls.json").exists()


def test_missing_files(call, oak, tmp_path):
    more = ("-o", tmp_path / "x.ls.json", "--method", "organic", "--years", 1)
    result = call("grow", tmp_path / "none.ls.json", *more)
    assert (result.exit_code, "none.ls.json" in result.stderr) == (1, True)
    result = call("grow", oak, *more, "--events", tmp_path / "none.toml")
    assert (result.exit_code, "there is no such file; check the name given to --events" in result.stderr) == (
        1,
        True,
    )
