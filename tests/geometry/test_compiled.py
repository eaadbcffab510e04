"""Machine code on disk: kept while somebody may still write into it, removed when nobody has for long."""

from __future__ import annotations

import os
import time

from pipeline.geometry import compiled


def test_code_of_other_sources_is_kept_while_it_may_be_in_use(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    now = compiled._cache_folder()
    assert now is not None
    place = now.name.split("-")[0]
    lately, long_ago, elsewhere = (now.parent / name for name in (f"{place}-1", f"{place}-2", "other-3"))
    for folder in (lately, long_ago, elsewhere):
        folder.mkdir()
        (folder / "kernel.nbi").write_text("code")
    past = time.time() - 2 * compiled.KEPT_S
    for folder in (long_ago, elsewhere):
        os.utime(folder, (past, past))
    now.rmdir()
    assert compiled._cache_folder() == now
    assert (lately / "kernel.nbi").exists(), "a run that began on other sources is still writing there"
    assert not long_ago.exists()
    assert elsewhere.exists(), "the code of another installation"


def test_code_in_use_does_not_grow_old(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    now = compiled._cache_folder()
    assert now is not None
    past = time.time() - 2 * compiled.KEPT_S
    os.utime(now, (past, past))
    compiled._cache_folder()
    assert time.time() - now.stat().st_mtime < compiled.KEPT_S / 2
