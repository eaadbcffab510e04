"""What the tests of every exchange format share: trees to write, and comparisons by content."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import strategies as st

from pipeline.errors import InputFormatError
from pipeline.formats import qsm
from pipeline.model import Skeleton, TreeModel

Reader = Callable[[Path], TreeModel | Skeleton]

MICROMETRE = 1e-6

draws = st.lists(st.integers(0, 50), max_size=30)
"""What `random_tree` makes a tree of: how far back each node's parent is."""

junk = st.binary(max_size=60)


def random_tree(drawn: list[int], wide: int) -> TreeModel:
    """Return a tree of one node more than was drawn, far from the coordinates' zero."""
    generator = np.random.default_rng(len(drawn))
    count = len(drawn) + 1
    parent = np.array([-1] + [max(i - d % wide, 0) for i, d in enumerate(drawn)])
    xyz = generator.normal(0, 9, (count, 3))
    skeleton = Skeleton(xyz, parent, np.round(generator.uniform(-1e6, 1e6, 3), 1), "EPSG:28992")
    radius = generator.uniform(0, 0.5, count)
    return TreeModel(skeleton, radius, np.zeros(count), np.full(count, np.nan))


def assert_same(
    again: TreeModel | Skeleton, tree: TreeModel, *, place: float = MICROMETRE, radius: float = MICROMETRE
) -> None:
    """Compare parents and branches exactly, nodes and radii within the precision of a format."""
    assert isinstance(again, TreeModel)
    skeleton = tree.skeleton
    assert again.skeleton.parent.tolist() == skeleton.parent.tolist()
    assert again.skeleton.branch.tolist() == skeleton.branch.tolist()
    assert again.skeleton.order.tolist() == skeleton.order.tolist()
    assert np.abs(again.skeleton.world - skeleton.world).max() <= place
    assert np.abs(again.radius - tree.radius).max() <= radius
    assert again.volume.sum() == pytest.approx(tree.volume.sum(), rel=1e-3, abs=1e-6)


def assert_named(read: Reader, path: Path, text: str | bytes, says: str) -> None:
    """Read a broken file: the error names the file and says what, with a remedy."""
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(InputFormatError, match=rf"(?s){path.name}: .*({says})") as caught:
        read(path)
    assert "; " in str(caught.value)
    assert len(str(caught.value)) < 500


def damaged(read: Reader, path: Path, junk: bytes, place: int) -> None:
    """Overwrite part of a file: reading gives an error of ours, or a tree."""
    whole = bytearray(path.read_bytes())
    at = place % (len(whole) + 1)
    whole[at : at + len(junk)] = junk
    path.write_bytes(bytes(whole))
    with contextlib.suppress(InputFormatError):
        read(path)


def scored(tree: TreeModel, cloud: Path, tmp_path: Path) -> dict[str, float]:
    """Score a tree against its cloud with the independent tool beside the data."""
    tool = cloud.parent.parent.parent / "tools" / "score.py"
    if not tool.is_file():
        pytest.skip(f"the score is not at {tool}")
    table = tmp_path / "scored.qsm.csv"
    qsm.write(tree, table)
    command = [sys.executable, str(tool), str(table), "--json", "--cloud", str(cloud)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    told = json.loads(done.stdout)
    return {
        **told,
        "surface_mean_mm": told["surface_mm"]["mean"],
        "surface_median_mm": told["surface_mm"]["median"],
    }
