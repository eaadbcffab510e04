"""`treepipe studio`: what is said before anything is served."""

import importlib.util
import socket

import pytest

from pipeline.cli.main import main
from pipeline.errors import OutputError, UsageError
from pipeline.studio.address import check_port


def outcome(capsys, *arguments):
    with pytest.raises(SystemExit) as left:
        main(["studio", "--no-browser", "--port", "0", *map(str, arguments)])
    return left.value.code, capsys.readouterr().err


def test_without_the_extra_it_says_how_to_get_it(capsys, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: None)
    code, said = outcome(capsys)
    assert code == 2
    assert 'pip install "treepipe[studio]"' in said


@pytest.mark.parametrize(
    ("name", "content", "code", "says"),
    [
        ("none.toml", None, 1, "there is no such file or folder; check the name"),
        ("odd.toml", "gnarlines = 1", 1, "unknown key gnarlines, do you mean gnarliness"),
        ("odd.toml", "iterations = 1000", 1, "iterations = 1000 is not allowed; give a whole number"),
        ("tree.obj", "v 0 0 0", 2, "opens folders and parameter files; end its name in .toml"),
    ],
)
def test_a_file_to_begin_with_is_checked(capsys, tmp_path, name, content, code, says):
    pytest.importorskip("trame_pyvista", reason='needs the modeller; pip install "treepipe[studio]"')
    if content is not None:
        (tmp_path / name).write_text(content)
    got, said = outcome(capsys, tmp_path / name)
    assert got == code
    assert says in said


def test_two_parameter_files_are_one_too_many(tmp_path):
    server = pytest.importorskip("pipeline.studio.server", reason="needs the modeller")
    files = [tmp_path / "a.toml", tmp_path / "b.toml"]
    for file in files:
        file.write_text("seed = 1")
    with pytest.raises(UsageError, match="is the second parameter file; give one"):
        server.session_of(files)
    assert server.session_of([tmp_path, files[0]]).options.seed == 1


def test_without_files_every_sitting_has_its_own_tree():
    server = pytest.importorskip("pipeline.studio.server", reason="needs the modeller")
    assert server.session_of([]).options.seed != server.session_of([]).options.seed


def test_a_port_in_use_and_a_host_elsewhere_are_named():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(OutputError, match="give another one with --port"):
            check_port("127.0.0.1", taken.getsockname()[1])
    with pytest.raises(OutputError, match=r"of 203\.0\.113\.1: cannot be served"):
        check_port("203.0.113.1", 0)


def test_other_machines_are_let_in_with_a_warning_only(capsys, tmp_path):
    _, said = outcome(capsys, "--host", "0.0.0.0", tmp_path / "none.toml")
    assert "everyone in that network can use the studio" in said
