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
        ("tree.docx", "v 0 0 0", 2, "is nothing that the studio opens; give parameters"),
    ],
)
def test_a_file_to_begin_with_is_checked(capsys, tmp_path, name, content, code, says):
    pytest.importorskip("trame_pyvista", reason='needs the modeller; pip install "treepipe[studio]"')
    if content is not None:
        (tmp_path / name).write_text(content)
    got, said = outcome(capsys, tmp_path / name)
    assert got == code
    assert says in said


@pytest.fixture
def page(request):
    """Return what makes a page of files, with a server of its own, never started."""
    server = pytest.importorskip("pipeline.studio.server", reason="needs the modeller")
    names = (f"{request.node.name}-{number}" for number in range(9))

    def make(*files):
        return server.page_server(files, clock=lambda: 0.0, log=lambda _sentence: None, name=next(names))

    return make


def test_two_parameter_files_are_one_too_many(page, tmp_path):
    files = [tmp_path / "a.toml", tmp_path / "b.toml"]
    for file in files:
        file.write_text("seed = 1")
    with pytest.raises(UsageError, match="is the second parameter file; give one"):
        page(*files)
    assert page(tmp_path, files[0]).state.stem == "tree-1"


def test_without_files_every_sitting_has_its_own_tree(page):
    assert page().state.stem != page().state.stem


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
