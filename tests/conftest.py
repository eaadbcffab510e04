"""What several tests share: where the clouds are, and small trees with known truth."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

# Machines are shared and the first call compiles: time is not what these tests are about.
settings.register_profile("calm", deadline=None, derandomize=True)
settings.load_profile("calm")

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of the real clouds and references; the test is skipped where it is absent."""
    folder = Path(os.environ.get("TREEPIPE_DATA", ROOT / ".." / "shared" / "data")).resolve()
    if not (folder / "trees").is_dir():
        pytest.skip(f"the real clouds are not at {folder}; set TREEPIPE_DATA to the folder that holds trees/")
    return folder


@pytest.fixture(scope="session")
def samples() -> Path:
    """Folder of the known-truth trees that ship with the project."""
    return ROOT / "data" / "samples"
