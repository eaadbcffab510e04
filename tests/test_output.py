"""Files are written whole or not at all, and errors name the file that they are about."""

from __future__ import annotations

from errno import ENOSPC

import pytest

from pipeline.errors import OutputError
from pipeline.output import whole_file


def test_a_full_disk_is_told_of_the_file_that_is_written(tmp_path):
    with (
        pytest.raises(OutputError, match=r"tree\.json: cannot be written .* another folder$"),
        whole_file(tmp_path / "tree.json"),
    ):
        raise OSError(ENOSPC, "No space left on device")
    assert not list(tmp_path.iterdir())


def test_a_file_that_is_missing_elsewhere_is_not_blamed_on_the_result(tmp_path):
    elsewhere = tmp_path / "cache" / "kernel.nbi"
    with pytest.raises(FileNotFoundError, match="kernel"), whole_file(tmp_path / "out" / "tree.json"):
        elsewhere.read_bytes()
    assert not list((tmp_path / "out").iterdir())
