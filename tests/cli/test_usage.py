"""Wrong usage is found before any work and exits with 2; help is instant."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib

import pytest

import pipeline
from pipeline.cli.main import COMMANDS
from pipeline.exchange import DEFAULT_FORMATS, FORMATS
from pipeline.skeleton import METHODS

HEAVY = ("numpy", "scipy", "numba", "laspy", "pydantic", "pyvista", "multiprocessing.context")


def test_help_imports_nothing_heavy():
    code = (
        "import sys\nfrom pipeline.cli.main import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit as end:\n    assert end.code == 0\n"
        f"print([name for name in {HEAVY} if name in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.splitlines()[-1] == "[]"


def test_the_module_is_the_command():
    result = subprocess.run(
        [sys.executable, "-m", "pipeline", "--version"], capture_output=True, text=True, check=True
    )
    assert result.stdout == f"treepipe {pipeline.__version__}\n"


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_command_explains_itself(call, name):
    assert call(name, "--help").exit_code == 0
    assert f"  {name} " in call("--help").stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["rum"], "treepipe --help"),
        (["run"], "CLOUD"),
        (["run", "{cloud}"], "--out"),
        (["run", "{cloud}", "--out", "{out}", "--colour"], "--colour"),
        (["run", "{cloud}", "--out", "{out}", "--formats", "obi"], "obi"),
        (["run", "{cloud}", "--out", "{out}", "--set", "clean.voxl_m=1"], "clean.voxel_m"),
        (["run", "{cloud}", "--out", "{out}", "--set", "clean.voxel_m=-1"], "clean.voxel_m"),
        (["run", "{cloud}", "--out", "{out}", "--preset", "nonsense"], "nonsense"),
        (["run", "{cloud}", "--out", "{out}", "--config", "{out}.toml"], "--config"),
        (
            ["run", "{cloud}", "--out", "{out}", "--method", "magic"],
            "--method 'magic' is not allowed",
        ),
        (["run", "{cloud}", "--out", "{out}", "--crs", "28992"], "EPSG:28992"),
        (["run", "{cloud}", "--out", "{out}", "--crs", "EPSG:1"], "EPSG:28992"),
        (["run", "{cloud}", "--out", "{out}", "--workers", "0"], "--workers"),
        (["run", "{cloud}", "--out", "{out}", "-v", "-q"], "exclude"),
        (["run", "{cloud}", "{cloud}", "--out", "{out}"], "same name"),
        (["clean", "{cloud}", "-o", "{out}.doc"], ".laz"),
        (["skeleton", "{cloud}", "-o", "{out}.laz"], ".ply"),
        (["fit", "{cloud}", "--cloud", "{cloud}", "-o", "{out}.doc"], ".npz"),
        (["export", "{cloud}", "-o", "{out}", "--formats", "lsjson,gbl"], "gbl"),
        (["validate", "{cloud}"], ".city.json"),
    ],
)
def test_wrong_usage(call, tmp_path, sapling, arguments, words):
    out = tmp_path / "out"
    result = call(*(text.format(cloud=sapling, out=out) for text in arguments))
    assert result.exit_code == 2, result.output
    assert result.stderr.startswith("treepipe: ")
    assert len(result.stderr.splitlines()) == 1
    assert words in result.stderr
    assert not out.exists()


def test_help_names_every_format_and_method(call):
    told = " ".join(call("run", "--help").stdout.split())
    named = re.search(r"Comma list of (.*?)\. +\[default: (\S+)\]", told)
    assert set(named[1].split(", ")) == set(FORMATS)
    assert tuple(named[2].split(",")) == DEFAULT_FORMATS
    assert all(method in told.replace("- ", "-") for method in METHODS)  # a line may end in a hyphen


def test_results_are_not_overwritten_unasked(call, made, sapling):
    before = (made / "summary.json").read_bytes()
    result = call("run", sapling, "--out", made)
    assert result.exit_code == 2
    assert "--overwrite" in result.stderr
    assert (made / "summary.json").read_bytes() == before


def test_config_show_is_a_config(call, tmp_path):
    shown = call("config", "show", "--set", "clean.voxel_m=0.02")
    assert tomllib.loads(shown.stdout)["clean"]["voxel_m"] == 0.02
    (tmp_path / "my.toml").write_text(shown.stdout)
    assert call("config", "show", "--config", tmp_path / "my.toml").stdout == shown.stdout


def test_a_log_holds_the_messages(call, tmp_path):
    log = tmp_path / "logs" / "a.log"
    call("run", tmp_path / "gone.xyz", "--out", tmp_path / "out", "--log", log, "-q")
    assert "ERROR" in log.read_text()
    assert "gone.xyz" in log.read_text()


def test_a_log_that_cannot_be_written(call, tmp_path):
    result = call("info", tmp_path / "a.xyz", "--log", tmp_path)
    assert result.exit_code == 1
    assert "--log" in result.stderr
