"""The page: what its buttons do, and what comes of the news of the worker."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from pipeline.errors import PipelineError
from pipeline.exchange import FORMATS
from pipeline.geometry.colonization import Progress
from pipeline.model import Floats
from pipeline.studio.layout import lay_out
from pipeline.studio.modelling import ENDED, Clock, Modelled, Modeller, envelope
from pipeline.studio.parameters import CROWN, PARAMETERS, Parameter
from pipeline.studio.scene import Scene
from pipeline.studio.session import Session
from pipeline.studio.worker import Worker
from pipeline.synthetic.colonization import ColonizationOptions

LINGER_S = 1.0  # how long the points of a crown stay after its last change
TELL_S = 0.1  # least time between two messages of progress
NO_FIGURES = dict.fromkeys(("nodes", "vertices", "triangles", "milliseconds", "reason", "seed"), "")


class Page:
    """Joins a session, its worker and its scene to what the browser shows.

    Parameters
    ----------
    server : trame server
    session : Session
    clock : callable
        Tells seconds.
    """

    def __init__(self, server: Any, session: Session, clock: Clock) -> None:
        self.server, self.session, self.clock = server, session, clock
        self.state = server.state
        self.scene = Scene()
        self.worker = Worker(Modeller(clock), self)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._told = 0.0
        self._fitted = self._held = False
        self._later: asyncio.TimerHandle | None = None
        self._start_state()
        self.state.change(*(parameter.name for parameter in PARAMETERS))(self._moved)
        for name in ("open_parameters", "save_parameters", "export"):
            server.controller.trigger(name)(getattr(self, f"_{name}"))
        self.view = lay_out(self)
        server.controller.on_server_ready.add(self._ready)

    # What the buttons do; each leaves the sliders and the picture as the session has them.

    def act(self, name: str, *given: Any) -> None:
        """Let the session do something, and show what comes of it; what is wrong becomes a sentence."""
        self.state.trouble = ""
        try:
            getattr(self.session, name)(*given)
        except PipelineError as error:
            self.state.trouble = str(error)
        self._show_options()
        self.worker.ask(self.session.options)

    def hold(self) -> None:
        """Begin a drag."""
        self._held = True

    def settle(self) -> None:
        """End a drag: sliders show what holds, and it is one step to undo."""
        self._held = False
        self.session.settle()
        self._show_options()

    def stop(self) -> None:
        """Stop growing; the tree that is shown stays."""
        self.worker.stop()

    def fit(self) -> None:
        """Show the whole tree."""
        self.view.reset_camera()

    def save(self) -> None:
        """Write a file into the folder that the studio was started with."""
        self.state.trouble = self.state.good = ""
        try:
            target = self.session.save(str(self.state.save_name))
            self.state.good = f"saved {target}" if target else ""
        except PipelineError as error:
            self.state.trouble = str(error)

    def _save_parameters(self) -> bytes:
        return self.session.saved()

    async def _export(self) -> bytes | None:
        """Pack the shown tree in a thread, so that the page answers meanwhile."""
        try:
            made = await asyncio.to_thread(self.session.exported, str(self.state.format))
        except PipelineError as error:
            self.state.trouble = str(error)
            return None
        return made[1] if made else None

    def _moved(self, **_state: Any) -> None:
        """Take over the sliders that were moved."""
        for parameter in PARAMETERS:
            value = self.state[parameter.name]
            value = _number(parameter, value)
            if value is None or value == getattr(self.session.options, parameter.name):
                continue
            try:
                self.session.move(parameter.name, value)
            except PipelineError as error:
                self.state.trouble = str(error)
                continue
            self.state.trouble = ""
            if parameter.choices:
                self.session.settle()
            self._show_steps()
            self.worker.ask(self.session.options)

    def _open_parameters(self, name: Any, text: Any) -> None:
        """Take the parameters of a file that the browser has read."""
        self.act("open", str(text).encode(), str(name))

    # What the worker tells, in its own thread.

    def begins(self, options: ColonizationOptions) -> None:
        """Show the points of another crown before anything grows into them."""
        shown = self.session.shown
        if shown and any(getattr(options, name) != getattr(shown.options, name) for name in CROWN):
            points = envelope(options)
            self._soon(lambda: self._shape(points))

    def growing(self, progress: Progress) -> None:
        """Tell how far the growth is, not too often."""
        now = self.clock()
        if progress.done == 1:
            self._told = now  # a growth that is over at once needs no message
        if now - self._told >= TELL_S:
            self._told = now
            text = f"growing: iteration {progress.done} of {progress.iterations}, {progress.nodes} nodes"
            share = 100 * progress.done // max(progress.iterations, 1)
            self._soon(lambda: self.state.update({"busy": True, "progress": share, "doing": text}))

    def done(self, modelled: Modelled) -> None:
        """Show a tree."""
        self._soon(lambda: self._show(modelled))

    def stopped(self) -> None:
        """Tell that growth has been stopped."""
        said = "stopped; the tree of before is shown. Move a slider or undo to go on."
        self._soon(lambda: self.state.update({"busy": False, "doing": said}))

    def failed(self, sentence: str) -> None:
        """Tell what cannot be made."""
        self._soon(lambda: self.state.update({"busy": False, "doing": "", "trouble": sentence}))

    def _soon(self, act: Callable[[], Any]) -> None:
        """Do something in the thread of the server, and tell the browser."""

        def flushed() -> None:
            with self.state:
                act()

        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(flushed)

    # What is shown.

    def _ready(self, **_state: Any) -> None:
        self._loop = asyncio.get_event_loop()
        self.worker.ask(self.session.options)

    def _start_state(self) -> None:
        self.state.update({"trame__title": "treepipe studio", "tab": "model", "trouble": "", "good": ""})
        self.state.update({"busy": True, "progress": 0, "doing": "growing"})
        self.state.update({"format": "obj", "save_name": "tree.obj", "figures": NO_FIGURES, "shown": 0})
        self.state.suffixes = {name: kind.suffix for name, kind in FORMATS.items()}
        self._show_options()

    def _show_options(self) -> None:
        for parameter in PARAMETERS:
            self.state[parameter.name] = getattr(self.session.options, parameter.name)
        self.state.stem = self.session.stem
        self._show_steps()

    def _show_steps(self) -> None:
        history = self.session.history
        self.state.update({"can_undo": bool(history.past), "can_redo": bool(history.undone)})

    def _shape(self, points: Floats | None) -> None:
        """Show the points of a crown, or none."""
        if self._later:
            self._later.cancel()
        self.scene.shape(points)
        self.view.update()

    def _linger(self) -> None:
        """Take the points of the crown away in a while; not while a slider is held."""
        if self._later:
            self._later.cancel()
        if self._loop and self.scene.shaping:
            act = self._linger if self._held else lambda: self._shape(None)
            self._later = self._loop.call_later(LINGER_S, act)

    def _show(self, modelled: Modelled) -> None:
        self.session.shown = modelled
        self.scene.show(modelled)
        self._linger()
        if not self._fitted:
            self.scene.look()
        self.view.update()
        if not self._fitted:
            self._fitted = True
            self.view.push_camera()
        self.state.figures = figures(modelled)
        self.state.update({"busy": self.worker.waiting, "progress": 100, "doing": ""})
        self.state.shown += 1


def figures(modelled: Modelled) -> dict[str, str]:
    """Return what the line below the picture tells."""
    return {
        "nodes": f"{len(modelled.tree):,}",
        "vertices": f"{modelled.vertices:,}",
        "triangles": f"{modelled.triangles:,}",
        "milliseconds": f"{modelled.milliseconds:.0f}",
        "reason": f"{modelled.reason}: {ENDED[modelled.reason]}",
        "seed": str(modelled.options.seed),
    }


def _number(parameter: Parameter, value: Any) -> Any:
    """Return a slider's value without the dust of its steps; None where it is none."""
    if parameter.choices:
        return value
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return round(value) if parameter.whole else round(float(value), 4)
