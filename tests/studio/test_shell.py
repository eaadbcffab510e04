"""The shell: which tab a file goes to, what the keys do, and what becomes of whatever goes wrong."""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from threading import Thread

import pytest

pytest.importorskip("trame_pyvista", reason='needs the modeller; pip install "treepipe[studio]"')

from trame.app import get_server  # after the skip

from pipeline.errors import InputFormatError, UsageError
from pipeline.studio.folders import Folders
from pipeline.studio.shell import Shell


class Tab:
    """A tab that takes files of one suffix, and keeps what it is asked for."""

    def __init__(self, name, suffix):
        self.name = self.title = name
        self.suffix, self.asked = suffix, []

    def buttons(self):
        """Lay out nothing."""

    side = main = buttons

    def ready(self):
        """Keep that it has begun."""
        self.asked.append("ready")

    def accepts(self, path):
        """Tell by the suffix."""
        return path.suffix == self.suffix

    def open(self, path):
        """Refuse what is empty."""
        if path.is_file() and not path.read_text():
            msg = f"{path}: is empty; give another one"
            raise InputFormatError(msg)
        self.asked.append(path.name)


class Undoing(Tab):
    """A tab that takes steps back."""

    def undo(self):
        """Keep that it was asked."""
        self.asked.append("undo")

    def redo(self):
        """Keep that it was asked."""
        self.asked.append("redo")


@pytest.fixture
def said():
    return []


@pytest.fixture
def shell(request, tmp_path, said):
    server = get_server(name=request.node.name, client_type="vue3")
    made = Shell(server, Folders([tmp_path]), lambda: 0.0, said.append)
    made.lay_out([Undoing("model", ".toml"), Tab("scan", ".laz"), Tab("late", ".laz")])
    return made


def asked(shell):
    return [tab.asked for tab in shell.tabs]


def test_a_file_goes_to_the_first_tab_that_takes_it(shell, tmp_path):
    (tmp_path / "run.laz").mkdir()
    (tmp_path / "oak.toml").write_text("seed = 1")
    shell.open([tmp_path, tmp_path / "oak.toml", tmp_path / "run.laz"])
    assert asked(shell) == [["oak.toml"], ["run.laz"], []]
    assert shell.state.tab == "scan"


def test_a_file_that_no_tab_takes_is_refused(shell, tmp_path):
    (tmp_path / "oak.docx").write_text("x")
    with pytest.raises(UsageError, match=r"oak\.docx: is nothing that the studio opens; give parameters"):
        shell.open([tmp_path / "oak.docx"])


def test_a_file_that_its_tab_cannot_open_is_an_error(shell, tmp_path):
    (tmp_path / "oak.laz").touch()
    with pytest.raises(InputFormatError, match="is empty; give another one"):
        shell.open([tmp_path / "oak.laz"])


def test_keys_reach_the_tab_that_is_shown(shell):
    undo_redo = shell.server.controller.trigger_fn("keys")
    undo_redo("undo")
    undo_redo("redo")
    shell.state.tab = "scan"
    undo_redo("undo")
    assert asked(shell) == [["undo", "redo"], [], []]


def test_trouble_is_on_the_page_and_in_the_log(shell, said):
    shell.good("saved")
    shell.trouble("cannot; do that")
    assert (shell.state.trouble, shell.state.good, said) == ("cannot; do that", "", ["cannot; do that"])
    shell.good("saved")
    assert (shell.state.trouble, shell.state.good) == ("", "saved")
    shell.trouble("")
    assert said == ["cannot; do that"]


def test_what_a_thread_brings_runs_in_the_loop_and_its_errors_are_sentences(shell, said):
    done = []

    def broken():
        int("odd")

    async def serve():
        shell.server.controller.on_server_ready()
        loop = asyncio.get_running_loop()
        over = asyncio.Event()
        acts = (broken, lambda: done.append(asyncio.get_running_loop() is loop), over.set)
        Thread(target=lambda: [shell.soon(act) for act in acts]).start()
        await asyncio.wait_for(over.wait(), 30)

    shell.soon(broken)  # before there is a loop nothing runs
    with ThreadPoolExecutor(1) as elsewhere:  # browser tests leave a loop running in this thread
        elsewhere.submit(lambda: asyncio.run(serve())).result()
    assert done == [True]
    assert len(said) == 1
    assert said[0].startswith("unexpected ValueError: invalid literal")
    assert "(test_shell.py, line " in said[0]
    assert shell.state.trouble == said[0]
    assert asked(shell) == [["ready"]] * 3


def test_what_a_button_does_wrong_is_a_sentence_too(shell, said):
    shell.server.controller.on_exception(UsageError("no; do that"))
    assert said == ["no; do that"]
