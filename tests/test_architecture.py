"""The floors: imports run downward only, heavy packages stay in their rooms, files stay short."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "pipeline"
FILES = sorted(PACKAGE.rglob("*.py"))

FLOORS = (
    ("errors", "version"),
    ("model", "options", "output", "shipped", "toml", "choosing"),
    ("geometry", "cloud"),
    ("skeleton", "cylinders", "lsystem", "growth", "mesh"),
    ("formats", "cityjson", "synthetic", "accuracy", "airborne"),
    ("config", "view", "report", "exchange"),
    ("run", "store"),
    ("batch", "jobs", "regression", "studio"),
    ("cli", "__main__"),
)
FLOOR = {name: number for number, names in enumerate(FLOORS) for name in names}

STAGES = {"cloud", "skeleton", "cylinders", "lsystem", "cityjson", "growth"}

ROOMS = {
    "laspy": ("cloud/las.py", "cloud/tiles.py"),
    "psycopg": "batch/",
    "matplotlib": "view/",
    "dask": "batch/",
    "distributed": "batch/",
    "pyvista": ("view/", "studio/"),
    "trame": "studio/",
    "open3d": "synthetic/",
    "click": "cli/",
    "logging": ("cli/", "run.py", "jobs/", "batch/"),
}
"""Packages that one part alone may import."""

CLOCK_ROOMS = ("store.py", "cli/", "jobs/", "batch/", "regression/")

MOST_LINES = 400
MOST_CODE_LINES = 60


def name_of(file: Path) -> str:
    return file.relative_to(PACKAGE).as_posix()


def room_of(file: Path) -> str:
    """Return the floor's name: the folder of a file, or the file itself."""
    return file.relative_to(PACKAGE).parts[0].removesuffix(".py")


@cache
def tree_of(file: Path) -> ast.Module:
    return ast.parse(file.read_text(encoding="utf-8"))


def imports(file: Path) -> Iterator[str]:
    """Yield the dotted name of every import, wherever it stands; those for type checkers too."""
    for node in ast.walk(tree_of(file)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name_of(file)}: write imports in full"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif (
            isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "import_module"
        ):
            yield from (arg.value for arg in node.args if isinstance(arg, ast.Constant))


def ours(file: Path) -> set[str]:
    """Return the rooms that a file imports from."""
    parts = (name.split(".") for name in imports(file))
    return {part[1] for part in parts if part[0] == "pipeline" and len(part) > 1}


inner = [file for file in FILES if room_of(file) != "__init__"]


@pytest.mark.parametrize("file", inner, ids=name_of)
def test_imports_run_downward(file):
    here = room_of(file)
    assert here in FLOOR, f"{name_of(file)} stands on no floor; add it to FLOORS"
    for other in ours(file):
        assert FLOOR[other] <= FLOOR[here], f"{name_of(file)} imports {other} from a higher floor"


@pytest.mark.parametrize("file", [file for file in inner if room_of(file) in STAGES], ids=name_of)
def test_stages_do_not_know_each_other(file):
    assert ours(file) & STAGES <= {room_of(file)}


def test_rooms_do_not_import_in_circles():
    below = {room: set[str]() for room in FLOOR}
    for file in inner:
        below[room_of(file)] |= ours(file) - {room_of(file)}
    done: list[str] = []
    while ready := [room for room in below if room not in done and below[room] <= set(done)]:
        done += ready
    assert set(done) == set(below), f"circle among {sorted(set(below) - set(done))}"


@pytest.mark.parametrize("package", ROOMS)
def test_packages_stay_in_their_rooms(package):
    users = [name_of(file) for file in FILES if package in {name.split(".")[0] for name in imports(file)}]
    assert not [user for user in users if not user.startswith(ROOMS[package])]


def test_only_some_look_at_the_clock():
    users = [name_of(file) for file in FILES if "time" in {name.split(".")[0] for name in imports(file)}]
    users += [name_of(file) for file in FILES if attributes(file) & {"now", "today", "utcnow"}]
    assert not [user for user in users if not user.startswith(CLOCK_ROOMS)]


def attributes(file: Path) -> set[str]:
    return {node.attr for node in ast.walk(tree_of(file)) if isinstance(node, ast.Attribute)}


@pytest.mark.parametrize("file", FILES, ids=name_of)
def test_a_file_says_what_it_is_for_and_is_short(file):
    text = file.read_text(encoding="utf-8")
    assert ast.get_docstring(tree_of(file)), f"{name_of(file)} begins without a docstring"
    assert text.count("\n") <= MOST_LINES
    long = {name: count for name, count in functions(file) if count > MOST_CODE_LINES}
    assert not long


def functions(file: Path) -> Iterator[tuple[str, int]]:
    """Yield the name of every function and its lines of code, without docstring and blank lines."""
    lines = file.read_text(encoding="utf-8").splitlines()
    for node in ast.walk(tree_of(file)):
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        first = node.body[0]
        if ast.get_docstring(node) is not None:
            begin = (first.end_lineno or first.lineno) + 1
        else:
            begin = first.lineno
        body = lines[begin - 1 : node.end_lineno]
        yield node.name, sum(bool(line.strip()) and not line.strip().startswith("#") for line in body)


def test_the_median_function_is_short():
    counts = sorted(count for file in FILES for _, count in functions(file))
    assert counts[len(counts) // 2] <= 10
    assert counts[int(0.95 * len(counts))] <= 35


def test_the_face_costs_nothing():
    """Importing the package loads none of the heavy libraries."""
    code = (
        "import sys, pipeline; print([m for m in ('numpy', 'scipy', 'numba', 'pyvista') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip() == "[]"


def test_every_name_of_the_face_resolves():
    import pipeline

    assert all(getattr(pipeline, name) is not None for name in pipeline.__all__)
    assert set(pipeline.__all__) <= set(dir(pipeline))
    with pytest.raises(AttributeError, match="nonsense"):
        _ = pipeline.nonsense
