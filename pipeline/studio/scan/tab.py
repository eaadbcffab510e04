"""The Scan tab: what its buttons do, and what is shown then."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

from pipeline.errors import PipelineError
from pipeline.model import TreeModel
from pipeline.studio.scan import layout, panels
from pipeline.studio.scan.beside import species, system
from pipeline.studio.scan.elsewhere import Elsewhere
from pipeline.studio.scan.fields import FIELDS
from pipeline.studio.scan.listing import Entry, entries, kind_of
from pipeline.studio.scan.making import Maker, Shown, Wish
from pipeline.studio.scan.news import News
from pipeline.studio.scan.scene import LAYERS, ScanScene
from pipeline.studio.scan.session import Against, ScanSession, packed
from pipeline.studio.scan.stages import Stage
from pipeline.studio.scan.telling import (
    NOTHING,
    START,
    files_of,
    lists_of,
    options_of,
    picture_of,
    result_of,
)
from pipeline.studio.shell import Shell
from pipeline.studio.worker import Worker

GATHER_S = 0.3  # a slider that is dragged makes many wishes; a reconstruction takes seconds
TYPED = {"crs": system, "species": species}
BY_KEY = {field.key: field for field in FIELDS}


class ScanTab:
    """Joins a session, its worker and its scene to what the browser shows.

    Parameters
    ----------
    shell : Shell
    """

    name = "scan"
    title = "Scan"

    def __init__(self, shell: Shell) -> None:
        self.shell, self.state = shell, shell.state
        self.session = ScanSession(shell.folders)
        self.scene = ScanScene()
        self.elsewhere, self.packer = Elsewhere(), Elsewhere()
        self.worker: Worker[Wish, Stage, Shown] = Worker(
            Maker(shell.folders, self.elsewhere.call).make, News(shell, self), GATHER_S
        )
        self.view: Any = None
        self._entries: list[Entry] = []
        self.state.update(START)
        self._show_options()
        self.state.change(*(f"scan_show_{name}" for name in LAYERS))(self._switched)
        self.state.change("scan_mode")(self._recoloured)
        self.state.change("scan_together")(self._moved_apart)
        self.state.change("tab")(self._turned_to)
        for name in ("open", "set", "slide", "settle", "compare", "align", "know", "config", "export"):
            shell.server.controller.trigger(f"scan_{name}")(getattr(self, f"_{name}"))

    # What the shell asks for.

    def buttons(self) -> None:
        """Lay out the buttons."""
        layout.buttons(self)

    def side(self) -> None:
        """Lay out files, layers and options."""
        layout.side(self)

    def main(self) -> None:
        """Lay out picture and report."""
        self.view = panels.main(self)

    def ready(self) -> None:
        """Begin with what the command line gave."""
        self.list_files()
        self.view.update()  # a browser that comes before the first result has a picture to add to
        self._ask()

    def accepts(self, path: Path) -> bool:
        """Tell whether a file is a cloud, or a folder that of a run."""
        return kind_of(path) in {"cloud", "run"}

    def open(self, path: Path) -> None:
        """Begin with a cloud, a model or the folder of a run; it is read as soon as the server runs.

        Raises
        ------
        UsageError
            If it lies outside the folders.
        """
        self.session.open(path)
        self._show_options()
        self._ask()

    # What the buttons do.

    def list_files(self) -> None:
        """Look what the folders hold."""
        self._entries = entries(self.shell.folders)
        self.state.update(lists_of(self._entries))
        self._show_options()

    def undo(self) -> None:
        """Take the last change of an option back."""
        self._step("undo")

    def redo(self) -> None:
        """Do again what was undone."""
        self._step("redo")

    def reset(self) -> None:
        """Give all options the values of the start."""
        self._step("reset")

    def stop(self) -> None:
        """Stop what is being made; what is shown stays."""
        self.worker.stop()

    def fit(self) -> None:
        """Show all."""
        self.view.reset_camera()

    def _step(self, name: str) -> None:
        self.shell.trouble("")
        getattr(self.session, name)()
        self._show_options()
        self._ask()

    def _open(self, number: Any) -> None:
        """Open a file of the list."""
        self._try(lambda: self.open(self._entries[int(number)].path))

    def _set(self, key: Any, value: Any) -> None:
        """Take a value that was typed or chosen."""
        self._change(str(key), value)
        self.session.settle()
        self._show_options()

    def _slide(self, key: Any, step: Any) -> None:
        """Take the place of a slider."""
        field = BY_KEY.get(str(key))
        if field is not None:
            self._change(field.key, field.value_at(float(step)))

    def _settle(self) -> None:
        """End a drag."""
        self.session.settle()
        self._show_options()

    def _change(self, key: str, given: Any) -> None:
        def act() -> None:
            if self.session.change(key, given):
                self._ask()

        self._try(act)
        self._show_options()

    def _compare(self, choice: Any) -> None:
        """Take a second model of the list, or an earlier result."""

        def act() -> None:
            against: Against = None
            if choice in {"before", "start"}:
                against = choice
            elif choice not in {None, NOTHING}:
                against = self._entries[int(choice)].path
            if against is not None and self.session.against is None:  # points would hide what differs
                self.state.update({"scan_show_cloud": False, "scan_show_leaves": False})
            self.session.compare(against)
            self._ask()

        self._try(act)
        self._show_options()

    def _know(self, name: Any, given: Any) -> None:
        """Take a file of the ground, a reference system or a species."""

        def act() -> None:
            if name == "ground":
                ground = None if given in {None, NOTHING} else self._entries[int(given)].path
                self.session.know(ground=ground)
            elif name in TYPED:
                self.session.know(**{name: TYPED[name](str(given or ""))})
            self._ask()

        self._try(act)
        self._show_options()

    def _align(self, wanted: Any) -> None:
        self.session.aligned = bool(wanted)
        self._ask()

    def _try(self, act: Any) -> None:
        """Do something; what is wrong with it becomes a sentence."""
        self.shell.trouble("")
        try:
            act()
        except PipelineError as error:
            self.shell.trouble(str(error))

    def _config(self) -> bytes:
        return self.session.saved()

    async def _export(self) -> bytes | None:
        """Pack the shown model elsewhere, so that the page answers meanwhile."""
        shown = self.session.shown
        if shown is None or not isinstance(shown.result.tree, TreeModel):
            return None
        tree, config, stem = shown.result.tree, shown.result.config, self.session.stem
        name = str(self.state.scan_format)
        try:
            made = await asyncio.to_thread(
                lambda: self.packer.call(packed, lambda: None, tree, name, stem, config)
            )
        except PipelineError as error:
            self.shell.trouble(str(error))
            return None
        return made[1]

    def _ask(self) -> None:
        wish = self.session.wish()
        if wish is not None:
            self.worker.ask(wish)

    # What is shown.

    def show(self, shown: Shown) -> None:
        """Show a result; another file is looked at as a whole."""
        if self.session.is_late(shown):
            return
        new = self.session.take(shown)
        self._draw()
        if new:
            self.scene.look()
        self.view.update()
        if new:
            self.view.push_camera()
        self._show_options()
        self.state.update(result_of(shown))
        self.state.scan_shown += 1
        self._rest("")

    def _draw(self) -> None:
        shown = self.session.shown
        if shown is not None:
            drawn = self.scene.show(shown, self.state.scan_mode, self.state.scan_together)
            self.state.update(picture_of(shown, drawn, self.scene.has()))
            self._switch()

    def _switch(self) -> None:
        self.scene.switch({name: bool(self.state[f"scan_show_{name}"]) for name in LAYERS})

    def _switched(self, **_state: Any) -> None:
        """Show and hide layers."""
        self._switch()
        self.view.update()

    def _recoloured(self, **_state: Any) -> None:
        """Colour what is shown in another way."""
        self._draw()
        self.view.update()

    def _moved_apart(self, **_state: Any) -> None:
        """Put two models side by side or one over the other, and stand where both are seen."""
        self._draw()
        self.scene.look()
        self.view.update()
        self.view.push_camera()

    def _turned_to(self, tab: str, **_state: Any) -> None:
        """Draw once more when the tab comes up: a hidden picture has no size."""
        if tab == self.name and self.view is not None:
            self.view.resize()
            self.view.update()

    def _show_options(self) -> None:
        self.state.update(options_of(self.session))
        numbers = {each.path: number for number, each in enumerate(self._entries)}
        self.state.update(files_of(self.session, numbers))

    def _rest(self, said: str) -> None:
        self.state.update({"scan_busy": self.worker.busy, "scan_doing": said})

    def give_up(self, said: str, trouble: str = "") -> None:
        """Go back to what is shown, and say why; options stay as they are, they can be undone."""
        self.session.fail()
        self._show_options()
        self._rest(said)
        if trouble:
            self.shell.trouble(trouble)
