"""The Years tab: what its buttons do, and what comes of what the browser changes."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pipeline.errors import PipelineError
from pipeline.growth import bare_pole
from pipeline.model import TreeModel
from pipeline.studio.shell import Shell
from pipeline.studio.worker import Worker
from pipeline.studio.years import layout
from pipeline.studio.years.board import NEW, Board
from pipeline.studio.years.files import holds_events, is_model, models_in, read_bounded
from pipeline.studio.years.film import Film
from pipeline.studio.years.forms import values_of
from pipeline.studio.years.growing import Grower
from pipeline.studio.years.news import News
from pipeline.studio.years.parameters import CHOICES, SLIDERS, number_of
from pipeline.studio.years.scene import Scene
from pipeline.studio.years.session import Session


class YearsTab:
    """Joins a session, its worker and its scene to what the browser shows.

    Parameters
    ----------
    shell : Shell
    model : callable
        Returns the tree that the Model tab shows, None before there is one.
    """

    name = "years"
    title = "Years"

    def __init__(self, shell: Shell, model: Callable[[], TreeModel | None]) -> None:
        self.shell, self.state, self._model = shell, shell.state, model
        self.session = Session(shell.folders)
        self.board = Board(shell, self.session, Scene())
        self.film = Film(shell, self._turn_to, self.name)
        self.worker = Worker(Grower(shell.clock).grow, News(shell, self.board))
        self._runs = self._asked = self._refused = False
        self.state.change(*(slider.key for slider in SLIDERS))(self._moved)
        self.state.change(*(f"years_{name}" for name in (*CHOICES, "span", "seed")))(self._moved)
        self.state.change("years_year")(self._year_moved)
        self.state.change("years_species", "years_file")(self._chosen)
        self.state.change("years_operation")(self._operation_chosen)
        self.state.change("years_colouring")(self._recolour)
        self.state.change("tab")(self._tab_shown)
        for name in ("pick", "apply", "open", "save_events", "save_parameters", "save_start", "export"):
            shell.server.controller.trigger(f"years_{name}")(getattr(self, f"_{name}"))

    # What the shell asks for.

    def buttons(self) -> None:
        """Lay out the buttons."""
        layout.buttons(self)

    def side(self) -> None:
        """Lay out start, parameters and events."""
        layout.side(self)

    def main(self) -> None:
        """Lay out the picture."""
        self.board.view = layout.main(self)

    def ready(self) -> None:
        """Begin to grow, if the tab is shown."""
        self._runs = True
        self.board.view.update()  # a browser that comes before the first tree has a picture to add to
        self._tab_shown()

    def accepts(self, path: Path) -> bool:
        """Tell whether a file holds events, or a tree to begin with."""
        return holds_events(path) or is_model(path)

    def open(self, path: Path) -> None:
        """Begin with the tree of a file, or take its events.

        Raises
        ------
        PipelineError
            If it holds neither.
        """
        if path.suffix.lower() == ".toml":
            self.session.open_events(read_bounded(path, self.shell.folders), str(path))
        else:
            self.session.begin_with_file(path, keep=True)
        self.board.show_plan()

    def undo(self) -> None:
        """Take the last step back."""
        self.act("undo")

    def redo(self) -> None:
        """Do again what was undone."""
        self.act("redo")

    # What the buttons do; each leaves the page as the session has it.

    def act(self, name: str, *given: Any) -> bool:
        """Let the session do something, and grow what comes of it; what is wrong becomes a sentence."""
        self.shell.trouble("")
        start = self.session.plan.start
        try:
            getattr(self.session, name)(*given)
        except PipelineError as error:
            self.shell.trouble(str(error))
            self.board.show_plan()
            return False
        if self.session.plan.start is not start:
            self.board.fits = False
        self.board.show_plan()
        self.grow()
        return True

    def grow(self) -> None:
        """Let the years of the plan grow, as far as they have not."""
        self._asked = True
        note = bare_pole(self.session.plan.options)
        self.state.years_note = f"{note[0].upper()}{note[1:]}." if note else ""
        self.worker.ask(self.session.plan)

    def begin_with_model(self) -> None:
        """Begin with the tree of the Model tab."""
        self.act("begin_with", self._model(), "model")

    def settle(self) -> None:
        """End a drag: it is one step to undo."""
        self.session.settle()
        self.board.show_plan()

    def stop(self) -> None:
        """Stop growing; the years that are there stay."""
        self.worker.stop()

    def fit(self) -> None:
        """Show the whole tree."""
        self.board.look()

    def unpick(self) -> None:
        """Pick nothing."""
        self.session.branch = None
        self.board.show_branch()

    def edit(self, number: int) -> None:
        """Edit an event of the list in the form; its year is shown."""
        if not 0 <= number < len(self.session.plan.programmes):
            return
        one = self.session.plan.programmes[number]
        self.unpick()
        self._turn_to(one.timing.year)
        self.state.update({"years_operation": one.operation.name, "years_editing": number})
        self.board.show_form(values_of(one))

    def new_event(self) -> None:
        """Edit no event, but prepare another one."""
        self.state.years_editing = NEW
        self.board.show_form()

    def save(self) -> None:
        """Write what replays these years into the folder that the studio was started with."""
        self.shell.trouble("")
        try:
            targets = self.session.save()
        except PipelineError as error:
            self.shell.trouble(str(error))
            return
        self.shell.good(f"saved {', '.join(target.name for target in targets)} in {targets[0].parent}")

    def refresh(self) -> None:
        """List the models in the folders anew."""
        self.state.years_files = models_in(self.shell.folders)

    def _pick(self, camera: Any, place: Any, size: Any) -> None:
        """Pick what was clicked."""
        self.shell.trouble("")
        try:
            self.session.pick(camera if isinstance(camera, dict) else {}, place, size)
        except PipelineError as error:
            self.shell.trouble(str(error))
        self.board.show_branch()

    def _apply(self, operation: Any, values: Any) -> None:
        """Do the operation of the form, or replace the event that is edited."""
        said = (str(operation), values if isinstance(values, dict) else {})
        number = int(self.state.years_editing)
        is_done = self.act("add", *said) if number == NEW else self.act("change", number, *said)
        if is_done:
            self.state.years_editing = NEW
            self._turn_to(int(number_of(said[1].get("year"), whole=True) or 0))
            self.board.show_form()

    def _open(self, kind: Any, name: Any, text: Any) -> None:
        """Take the events or the parameters of a file that the browser has read."""
        act = "open_events" if kind == "events" else "open_parameters"
        self.act(act, str(text).encode(), str(name))

    async def _save_events(self) -> bytes | None:
        return await self._packed(self.session.saved_events)

    async def _save_parameters(self) -> bytes | None:
        return await self._packed(self.session.saved_parameters)

    async def _save_start(self) -> bytes | None:
        return await self._packed(self.session.saved_start)

    async def _export(self) -> bytes | None:
        name = str(self.state.years_format)
        return await self._packed(lambda: self.session.exported(name)[1])

    async def _packed(self, make: Callable[[], bytes]) -> bytes | None:
        """Make a download in a thread, so that the page answers meanwhile."""
        try:
            return await asyncio.to_thread(make)
        except PipelineError as error:
            self.shell.trouble(str(error))
            return None

    # What the browser changes.

    def _moved(self, **_state: Any) -> None:
        """Take over the sliders and choices that were moved; a complaint goes when it is put right."""
        was_refused, self._refused = self._refused, False
        plan, grown = self.session.plan, {"span": "years"}
        for name in (*(slider.name for slider in SLIDERS), *CHOICES, "span", "seed"):
            value: Any = self.state[f"years_{name}"]
            now = getattr(plan if name in {"span", "seed"} else plan.options, grown.get(name, name))
            if name not in CHOICES:
                value = number_of(value, whole=name in {"span", "seed"})
            if value is None or value == now:
                continue
            self._set(grown.get(name, name), value, settled=name in CHOICES)
        if was_refused and not self._refused:
            self.shell.trouble("")

    def _set(self, name: str, value: Any, *, settled: bool) -> None:
        try:
            self.session.set(name, value)
        except PipelineError as error:
            self._refused = True
            self.shell.trouble(str(error))
            return
        self.shell.trouble("")
        if settled:
            self.session.settle()
        self.board.show_steps()
        self.grow()

    def _year_moved(self, **_state: Any) -> None:
        """Show the year of the slider."""
        year = number_of(self.state.years_year, whole=True)
        shown = self.session.year
        if year is None or shown is None or shown.number == year:
            return
        self.session.look_at(int(year))
        self.board.show_year()

    def _chosen(self, **_state: Any) -> None:
        """Take a species, or a file to begin with."""
        species, file = str(self.state.years_species or ""), str(self.state.years_file or "")
        if species != (self.session.plan.species or ""):
            self.act("species", species)
        if file and file != str(self.session.plan.start.path or ""):
            self.act("begin_with_file", file)

    def _operation_chosen(self, **_state: Any) -> None:
        """Show the fields of another operation, unless it is that of the event that is edited."""
        number = int(self.state.years_editing)
        held = self.session.plan.programmes
        if 0 <= number < len(held) and held[number].operation.name == self.state.years_operation:
            return
        self.board.show_form()

    def _recolour(self, **_state: Any) -> None:
        self.board.show_year()

    def _tab_shown(self, **_state: Any) -> None:
        """Grow once somebody looks, and draw: a picture that was hidden had no size."""
        if self.state.tab != self.name or not self._runs:
            return
        if not self._asked:
            self.refresh()
            self.grow()
        elif self.session.year is not None:
            self.board.show_year()

    def _turn_to(self, year: int) -> None:
        self.session.look_at(year)
        self.board.show_year()
