"""Files are written whole or not at all, and errors name the file that they are about."""

from __future__ import annotations

import json
import os
from errno import EACCES, ENOSPC

import pytest

from pipeline.errors import OutputError
from pipeline.output import whole_file, write_text


def test_a_full_disk_is_told_of_the_file_that_is_written(tmp_path):
    with (
        pytest.raises(OutputError, match=r"tree\.json: cannot be written .* another folder$"),
        whole_file(tmp_path / "tree.json"),
    ):
        raise OSError(ENOSPC, "No space left on device")
    assert not list(tmp_path.iterdir())


def test_who_may_not_write_is_not_told_to_free_space(tmp_path):
    with (
        pytest.raises(OutputError, match=r"\(Permission denied\); name a folder that you may write to$"),
        whole_file(tmp_path / "tree.json"),
    ):
        raise PermissionError(EACCES, "Permission denied")


def test_a_name_that_is_no_text_comes_back_from_json(tmp_path):
    name = os.fsdecode(b"\xe4.laz")
    write_text(tmp_path / "a.json", json.dumps(name, ensure_ascii=False))
    assert json.loads((tmp_path / "a.json").read_text(encoding="utf-8")) == name


def test_a_file_that_is_missing_elsewhere_is_not_blamed_on_the_result(tmp_path):
    elsewhere = tmp_path / "cache" / "kernel.nbi"
    with pytest.raises(FileNotFoundError, match="kernel"), whole_file(tmp_path / "out" / "tree.json"):
        elsewhere.read_bytes()
    assert not list((tmp_path / "out").iterdir())
