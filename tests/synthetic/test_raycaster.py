"""What is said where open3d, or a library that it needs, is absent."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import MissingExtraError
from pipeline.synthetic.raycaster import Raycaster


def test_without_open3d_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "open3d", None)
    with pytest.raises(MissingExtraError, match=r'need the package open3d; pip install "treepipe\[scan\]"'):
        Raycaster(np.zeros((3, 3)), np.array([[0, 1, 2]], dtype=np.int32))


def test_without_its_library_the_system_package_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    text = "raise OSError('libusb-1.0.so.0: cannot open shared object file')"
    (tmp_path / "open3d.py").write_text(text)
    monkeypatch.delitem(sys.modules, "open3d", raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(MissingExtraError, match=r"libusb-1\.0\.so\.0: .*; install .* libusb-1\.0-0"):
        Raycaster(np.zeros((3, 3)), np.array([[0, 1, 2]], dtype=np.int32))
