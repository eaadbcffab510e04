"""The shell: one page with tabs, what they share, and sentences that every tab may say.

A tab is whatever follows `Tab`. Its state variables, triggers and elements begin with its name. It reacts to
the browser in the server's thread; from a thread of its own it comes back by `Shell.soon`.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from trame.ui.vuetify3 import VAppLayout
from trame.widgets import client, html
from trame.widgets import vuetify3 as v

from pipeline.errors import UsageError
from pipeline.studio.folders import Folders
from pipeline.studio.worker import sentence_of

Clock = Callable[[], float]
Log = Callable[[str], object]

DRAWER_PX = 330
FULL = "position:relative;height:100%;width:100%"


class Tab(Protocol):
    """One of the page's tabs."""

    name: str
    title: str

    def buttons(self) -> None:
        """Lay out what stands in the bar above while the tab is shown."""

    def side(self) -> None:
        """Lay out the left drawer."""

    def main(self) -> None:
        """Lay out the picture and the line of its figures."""

    def ready(self) -> None:
        """Begin to work: the server's loop runs."""

    def accepts(self, path: Path, /) -> bool:
        """Tell whether a file or folder of the command line is this tab's."""

    def open(self, path: Path, /) -> None:
        """Open it; raises a PipelineError if it cannot be."""


@runtime_checkable
class Undoing(Protocol):
    """A tab that Ctrl+Z and Ctrl+Y reach while it is shown."""

    def undo(self) -> None:
        """Take the last step back."""

    def redo(self) -> None:
        """Do again what was undone."""


class Shell:
    """What tabs share.

    Parameters
    ----------
    server : trame server
    folders : Folders
        Where files may be opened and written.
    clock : callable
        Tells seconds.
    log : callable
        Is told every sentence that says what went wrong.

    Attributes
    ----------
    state : trame state
    tabs : tuple of Tab
        Those that `lay_out` was given.
    """

    def __init__(self, server: Any, folders: Folders, clock: Clock, log: Log) -> None:
        self.server, self.state = server, server.state
        self.folders, self.clock, self._log = folders, clock, log
        self.tabs: tuple[Tab, ...] = ()
        self._loop: asyncio.AbstractEventLoop | None = None
        self.state.update({"trame__title": "treepipe studio", "tab": "model", "trouble": "", "good": ""})

    # What tabs call.

    def soon(self, act: Callable[[], Any]) -> None:
        """Do something in the thread of the server, and tell the browser; callable from any thread."""

        def flushed() -> None:
            try:
                with self.state:
                    act()
            except Exception as error:  # whatever a tab does wrong, the others go on
                self._unexpected(error)

        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(flushed)

    def later(self, seconds: float, act: Callable[[], Any]) -> asyncio.TimerHandle | None:
        """Do something in the thread of the server after a while; None before it runs."""
        return self._loop.call_later(seconds, self.soon, act) if self._loop else None

    def trouble(self, sentence: str) -> None:
        """Say over the picture and in the log what is wrong and what helps; nothing takes it away."""
        self.state.trouble = sentence
        if sentence:
            self.state.good = ""
            self._log(sentence)

    def good(self, sentence: str) -> None:
        """Say over the picture what went well."""
        self.state.good = sentence
        if sentence:
            self.state.trouble = ""

    # What the server calls.

    def lay_out(self, tabs: Sequence[Tab]) -> None:
        """Lay the page out."""
        self.tabs = tuple(tabs)
        self.server.controller.trigger("keys")(self._keys)
        self.server.controller.on_server_ready.add(self._ready)
        self.server.controller.on_exception.add(self._unexpected)
        with VAppLayout(self.server, full_height=True), v.VLayout(style="height:100vh"):
            client.ClientTriggers(mounted=KEYS, ref="keys")
            with v.VAppBar(density="compact", elevation=1):
                self._bar()
            with v.VNavigationDrawer(permanent=True, width=DRAWER_PX), v.VWindow(v_model=("tab",)):
                for tab in self.tabs:
                    with v.VWindowItem(
                        value=tab.name, eager=True, transition=False, reverse_transition=False
                    ):
                        tab.side()
            with v.VMain(style="height:100vh"), html.Div(style=FULL):
                for tab in self.tabs:
                    with html.Div(v_show=f"tab == '{tab.name}'", style=FULL):
                        tab.main()
                _messages()

    def open(self, files: Sequence[Path]) -> None:
        """Give every file to the first tab that takes it; a folder that none takes is only allowed.

        Raises
        ------
        PipelineError
            If none takes a file, or the one that takes it cannot open it.
        """
        for path in files:
            tab = next((tab for tab in self.tabs if tab.accepts(path)), None)
            if tab is not None:
                tab.open(path)
                self.state.tab = tab.name
            elif path.is_file():
                msg = f"{path}: is nothing that the studio opens; give {OPENS}"
                raise UsageError(msg)

    def _bar(self) -> None:
        v.VAppBarTitle("treepipe studio", style="max-width:180px")
        with v.VTabs(v_model=("tab",), density="compact", mandatory="force"):
            for tab in self.tabs:
                v.VTab(tab.title, value=tab.name, id=f"tab-{tab.name}")
        v.VSpacer()
        for tab in self.tabs:
            with html.Div(v_if=f"tab == '{tab.name}'", classes="d-flex align-center"):
                tab.buttons()

    def _ready(self, **_state: Any) -> None:
        self._loop = asyncio.get_event_loop()
        for tab in self.tabs:
            tab.ready()

    def _keys(self, act: Any) -> None:
        """Undo or redo in the tab that is shown."""
        tab: object = next((tab for tab in self.tabs if tab.name == self.state.tab), None)
        if isinstance(tab, Undoing):
            tab.redo() if act == "redo" else tab.undo()

    def _unexpected(self, error: BaseException, **_more: Any) -> None:
        """Say what no tab has caught."""
        with self.state:
            self.trouble(sentence_of(error))


OPENS = "parameters or events (.toml), a model, a cloud, the folder of a run, or a folder for results"

KEYS = """
window.treepipeKeys || (window.treepipeKeys = true, window.addEventListener('keydown', (event) => {
  const typing = event.target.matches('input:not([readonly]), textarea');
  if (typing || event.altKey || !(event.ctrlKey || event.metaKey)) return;
  const key = event.key.toLowerCase();
  if (key !== 'z' && key !== 'y') return;
  event.preventDefault();
  trigger('keys', [key === 'y' || event.shiftKey ? 'redo' : 'undo']);
}))
"""
"""Ctrl+Z, Ctrl+Shift+Z and Ctrl+Y, but not where text is typed; there they are the browser's."""


def _messages() -> None:
    """Lay out sentences over the picture."""
    with html.Div(style="position:absolute;top:8px;left:8px;right:8px;pointer-events:none"):
        alert = {"density": "compact", "closable": True, "style": "pointer-events:auto", "classes": "mb-2"}
        v.VAlert(
            "{{ trouble }}", v_if="trouble", type="warning", id="trouble", click_close="trouble = ''", **alert
        )
        v.VAlert("{{ good }}", v_if="good", type="success", id="good", click_close="good = ''", **alert)
