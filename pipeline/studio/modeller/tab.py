"""The Model tab: what its buttons do, and what comes of the news of the worker."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

from pipeline.errors import PipelineError, UsageError
from pipeline.exchange import FORMATS
from pipeline.model import Floats, TreeModel
from pipeline.studio.modeller import layout
from pipeline.studio.modeller.files import TOML, holds_events, open_parameters
from pipeline.studio.modeller.modelling import Modelled, Modeller, Step, envelope
from pipeline.studio.modeller.parameters import CROWN, PARAMETERS
from pipeline.studio.modeller.scene import Scene, Twigs
from pipeline.studio.modeller.session import Session, random_seed
from pipeline.studio.modeller.words import NO_FIGURES, figures_of, number_of
from pipeline.studio.shell import Shell
from pipeline.studio.worker import Worker
from pipeline.synthetic.colonization import ColonizationOptions

LINGER_S = 1.0  # how long the points of a crown stay after its last change
TELL_S = 0.12  # least time between two messages of progress; what is over sooner needs none
NODES = 20_000  # so many nodes take as long again to be shown
STOPPED = "stopped; the tree of before is shown. Move a slider or undo to go on."
FIRST = "preparing; the first start on a machine takes up to a minute"


class ModelTab:
    """Joins a session, its worker and its scene to what the browser shows.

    Parameters
    ----------
    shell : Shell
    """

    name = "model"
    title = "Model"

    def __init__(self, shell: Shell) -> None:
        self.shell, self.state = shell, shell.state
        self.session = Session(ColonizationOptions(seed=random_seed()), shell.folders)
        self.scene = Scene()
        self.worker = Worker(Modeller(shell.clock).model, self)
        self.view: Any = None
        self._told, self._wait = 0.0, TELL_S
        self._crown: Floats | None = None
        self._fitted = self._held = self._opened = False
        self._later: asyncio.TimerHandle | None = None
        self._start_state()
        self.state.change(*(parameter.name for parameter in PARAMETERS))(self._moved)
        for name in ("open_parameters", "save_parameters", "export"):
            shell.server.controller.trigger(name)(getattr(self, f"_{name}"))

    # What the shell asks for.

    def buttons(self) -> None:
        """Lay out the buttons."""
        layout.buttons(self)

    def side(self) -> None:
        """Lay out the sliders."""
        layout.sliders(self)

    def main(self) -> None:
        """Lay out the picture."""
        self.view = layout.main(self)

    def ready(self) -> None:
        """Begin to model."""
        self.view.update()  # a browser that comes before the first tree has a picture to add to
        self.worker.ask(self.session.options)

    def accepts(self, path: Path) -> bool:
        """Tell whether a file holds parameters; what is no TOML at all is explained here too."""
        return path.suffix.lower() == TOML and not holds_events(path)

    def open(self, path: Path) -> None:
        """Begin with the parameters of a file.

        Raises
        ------
        InputMissingError, InputFormatError, UsageError
            If it cannot be read, or is the second one.
        """
        if self._opened:
            msg = f"{path}: is the second parameter file; give one"
            raise UsageError(msg)
        self._opened = True
        self.session = Session(open_parameters(path, self.shell.folders), self.shell.folders)
        self._show_options()

    def undo(self) -> None:
        """Take the last step back."""
        self.act("undo")

    def redo(self) -> None:
        """Do again what was undone."""
        self.act("redo")

    @property
    def tree(self) -> TreeModel | None:
        """The tree that is shown."""
        return self.session.shown.tree if self.session.shown else None

    # What the buttons do; each leaves the sliders and the picture as the session has them.

    def act(self, name: str, *given: Any) -> None:
        """Let the session do something, and show what comes of it; what is wrong becomes a sentence."""
        self.shell.trouble("")
        try:
            getattr(self.session, name)(*given)
        except PipelineError as error:
            self.shell.trouble(str(error))
        else:
            self.worker.ask(self.session.options)
        self._show_options()

    def hold(self) -> None:
        """Begin a drag."""
        self._held = True

    def settle(self) -> None:
        """End a drag: sliders show what holds, and it is one step to undo."""
        self._held = False
        self.session.settle()
        self._show_options()

    def stop(self) -> None:
        """Stop growing, and show the tree of before at once."""
        self.worker.stop()
        self._end(STOPPED)

    def fit(self) -> None:
        """Show the whole tree."""
        self.view.reset_camera()

    def save(self) -> None:
        """Write a file into the folder that the studio was started with."""
        self.shell.trouble("")
        try:
            target = self.session.save(str(self.state.save_name))
            self.shell.good(f"saved {target}" if target else "")
        except PipelineError as error:
            self.shell.trouble(str(error))

    def _save_parameters(self) -> bytes:
        return self.session.saved()

    async def _export(self) -> bytes | None:
        """Pack the shown tree in a thread, so that the page answers meanwhile."""
        try:
            made = await asyncio.to_thread(self.session.exported, str(self.state.format))
        except PipelineError as error:
            self.shell.trouble(str(error))
            return None
        return made[1] if made else None

    def _moved(self, **_state: Any) -> None:
        """Take over the sliders that were moved."""
        for parameter in PARAMETERS:
            value = self.state[parameter.name]
            value = number_of(parameter, value)
            if value is None or value == getattr(self.session.options, parameter.name):
                continue
            try:
                self.session.move(parameter.name, value)
            except PipelineError as error:
                self.shell.trouble(str(error))
                continue
            self.shell.trouble("")
            if parameter.choices:
                self.session.settle()
            self._show_steps()
            self.worker.ask(self.session.options)

    def _open_parameters(self, name: Any, text: Any) -> None:
        """Take the parameters of a file that the browser has read."""
        self.act("open", str(text).encode(), str(name))

    # What the worker tells, in its own thread.

    def begins(self, options: ColonizationOptions) -> None:
        """Remember the points of another crown, to show them with its tree, or before if that takes long."""
        self._told, self._wait = self.shell.clock(), TELL_S
        shown = self.session.shown
        if shown and any(getattr(options, name) != getattr(shown.options, name) for name in CROWN):
            self._crown = envelope(options)

    def growing(self, step: Step) -> None:
        """Tell how far it is, not too often, and show what has grown; of many nodes less often still."""
        now = self.shell.clock()
        if now - self._told < self._wait:
            return
        self._told = now
        crown, self._crown = self._crown, None
        if isinstance(step, str):
            self.shell.soon(lambda: self._tell(step, 100))
            return
        self._wait = TELL_S * (1.0 + step.nodes / NODES)
        text = f"growing: iteration {step.done} of {step.iterations}, {step.nodes:,} nodes"
        share = 100 * step.done // max(step.iterations, 1)
        self.shell.soon(lambda: self._tell(text, share, (step.xyz, step.parent), crown))

    def done(self, modelled: Modelled) -> None:
        """Show a tree, with the points of its crown where that is another one."""
        crown, self._crown = self._crown, None
        self.scene.prepare(modelled)
        self.shell.soon(lambda: self._show(modelled, crown))

    def stopped(self) -> None:
        """Be told that growth has ended; the page has said so when it was asked."""

    def failed(self, sentence: str) -> None:
        """Tell what cannot be made."""
        self.shell.soon(lambda: self._end("", sentence))

    # What is shown.

    def _start_state(self) -> None:
        self.state.update({"busy": True, "progress": 0, "doing": FIRST})
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

    def _tell(
        self,
        text: str,
        share: int,
        nodes: Twigs | None = None,
        crown: Floats | None = None,
    ) -> None:
        """Say how far it is, and show what there is; nothing once it was stopped."""
        if self.worker.stopping:
            return
        self.state.update({"busy": True, "progress": share, "doing": text})
        if crown is not None:
            self.scene.shape(crown)
        if nodes is not None:
            self.scene.grow(nodes)
            self.view.update()

    def _end(self, said: str, trouble: str = "") -> None:
        """Show the tree of before again, and say why."""
        if trouble:
            self.shell.trouble(trouble)
        self.state.update({"busy": self.worker.busy, "doing": said})
        if self.scene.growing or self.scene.shaping:
            self.scene.grow(None)
            self.scene.shape(None)
            self.view.update()

    def _unshape(self) -> None:
        """Take the points of the crown away."""
        self.scene.shape(None)
        self.view.update()

    def _linger(self) -> None:
        """Take the points of the crown away in a while; not while a slider is held."""
        if self._later:
            self._later.cancel()
        if self.scene.shaping:
            act = self._linger if self._held else self._unshape
            self._later = self.shell.later(LINGER_S, act)

    def _show(self, modelled: Modelled, crown: Floats | None) -> None:
        self.session.shown = modelled
        self.scene.show(modelled)
        if crown is not None:
            self.scene.shape(crown)
        self._linger()
        if not self._fitted:
            self.scene.look()
        self.view.update()
        if not self._fitted:
            self._fitted = True
            self.view.push_camera()
        self.state.figures = figures_of(modelled)
        self.state.update({"busy": self.worker.busy, "progress": 100, "doing": ""})
        self.state.shown += 1
