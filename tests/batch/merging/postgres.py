"""A PostgreSQL of our own for tests: made in a folder, started without network, stopped at the end."""

from __future__ import annotations

import os
import pwd
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

USER = "postgres"


def binaries() -> Path:
    """Folder of initdb and pg_ctl; the test is skipped where there is none, or no PostGIS."""
    folders = [Path(found).resolve().parent] if (found := shutil.which("initdb")) else []
    folders += sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    wanted = ("initdb", "pg_ctl", "pg_config", "postgres")
    folder = next((one for one in folders if all((one / name).is_file() for name in wanted)), None)
    if folder is None:
        pytest.skip("no PostgreSQL; install the packages postgresql and postgis to test the database")
    shared = subprocess.run([folder / "pg_config", "--sharedir"], capture_output=True, text=True, check=False)
    if not (Path(shared.stdout.strip()) / "extension" / "postgis.control").is_file():
        pytest.skip("no PostGIS; install the package postgresql-postgis to test the database")
    return folder


def runner(folder: Path) -> tuple[list[str], str]:
    """How the server is run and by whom: it refuses root."""
    if os.geteuid() != 0:
        return [], pwd.getpwuid(os.geteuid()).pw_name
    if shutil.which("runuser") is None or not any(one.pw_name == USER for one in pwd.getpwall()):
        pytest.skip("PostgreSQL does not run as root; run the tests as another user")
    shutil.chown(folder, USER)
    return ["runuser", "-u", USER, "--"], USER


@contextmanager
def server() -> Iterator[str]:
    """Start a server that listens on a socket in its own folder; give the address of its database."""
    programs = binaries()
    with tempfile.TemporaryDirectory(prefix="treepipe-pg-") as name:
        folder = Path(name)
        folder.chmod(0o755)
        as_user, user = runner(folder)
        data = folder / "data"

        def run(program: str, *arguments: str) -> None:
            done = subprocess.run(
                [*as_user, str(programs / program), *arguments],
                cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False,
                timeout=60,
            )  # fmt: skip
            assert done.returncode == 0, done.stderr

        run("initdb", "-D", str(data), "-A", "trust", "--no-sync", "-E", "UTF8", "--locale=C")
        settings = f"-c listen_addresses='' -k {folder} -c fsync=off -c shared_buffers=16MB"
        run("pg_ctl", "-D", str(data), "-l", str(folder / "log"), "-w", "-o", settings, "start")
        try:
            yield f"postgresql://{user}@/postgres?host={folder}"
        finally:
            run("pg_ctl", "-D", str(data), "-m", "immediate", "-w", "stop")
