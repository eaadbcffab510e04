"""One sitting with the years of a tree: the plan with its history, what grew of it, what is picked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.errors import UsageError
from pipeline.growth.events import Programme
from pipeline.model import Floats, TreeModel
from pipeline.output import write_bytes
from pipeline.studio.folders import Folders
from pipeline.studio.history import History
from pipeline.studio.years.files import (
    EVENTS,
    PARAMETERS,
    check_is_tree,
    command_of,
    open_start,
    packed,
    read_growth,
)
from pipeline.studio.years.forms import programme_from
from pipeline.studio.years.growing import Story, Year
from pipeline.studio.years.limbs import Branch, branch_at
from pipeline.studio.years.listing import read_programmes, row, written
from pipeline.studio.years.picking import picked, ray_of
from pipeline.studio.years.plan import Plan, Start
from pipeline.toml import to_toml

MOST_SEED = 2**31


class Session:
    """What a person has done with the years, without a browser.

    Parameters
    ----------
    folders : Folders
    plan : Plan, optional
        The first one.

    Attributes
    ----------
    history : History of Plan
    story : Story or None
        The years that grew last; they may be of the plan before while another one grows.
    wanted : int or None
        The year to be shown; None for the last one.
    branch : Branch or None
        What is picked in the year that is shown.
    """

    def __init__(self, folders: Folders, plan: Plan | None = None) -> None:
        self.folders = folders
        self.history: History[Plan] = History(plan or Plan())
        self.story: Story | None = None
        self.wanted: int | None = None
        self.branch: Branch | None = None

    @property
    def plan(self) -> Plan:
        """The present plan."""
        return self.history.present

    # What changes the plan.

    def begin_with_bud(self) -> None:
        """Let a tree grow from a bud."""
        self._begin(Start())

    def begin_with(self, tree: TreeModel | None, name: str) -> None:
        """Let a tree grow on.

        Raises
        ------
        UsageError
            If there is none.
        """
        if tree is None or len(tree) < 2:
            msg = "there is no tree in the Model tab yet; wait until it has grown"
            raise UsageError(msg)
        self._begin(Start(name, tree))

    def begin_with_file(self, path: str | Path, *, keep: bool = False) -> None:
        """Let the tree of a file grow on; the events of another tree are kept if they are to be.

        Raises
        ------
        PipelineError
            If it lies outside the folders, or holds no tree with radii.
        """
        self._begin(open_start(Path(path), self.folders), self.plan.programmes if keep else ())

    def species(self, name: str) -> None:
        """Take the parameters of a species; of no name, the defaults."""
        self._record(self.plan.of_species(name))

    def set(self, name: str, value: Any) -> None:
        """Give a parameter of growth, `years` or `seed` another value, as part of one gesture."""
        if name in {"years", "seed"}:
            self._record(self.plan.with_(**{name: value}), name)
        else:
            self._record(self.plan.with_options(**{name: value}), name)

    def new_seed(self) -> None:
        """Draw another seed."""
        self._record(self.plan.with_(seed=int(np.random.default_rng().integers(MOST_SEED))))

    def settle(self) -> None:
        """End the gesture: what follows is another step to undo."""
        self.history = self.history.settled()

    def add(self, operation: str, values: Mapping[str, Any]) -> None:
        """Do an operation, in the year that its values tell."""
        self._record(self.plan.adding([programme_from(operation, values)]).long_enough())

    def change(self, number: int, operation: str, values: Mapping[str, Any]) -> None:
        """Replace an event."""
        self._record(self.plan.changing(number, programme_from(operation, values)).long_enough())

    def remove(self, number: int) -> None:
        """Leave an event out."""
        self._record(self.plan.without(number))

    def move(self, number: int, by: int) -> None:
        """Move an event in the list; of those of one year, the upper one is done first."""
        self._record(self.plan.moved(number, by))

    def open_events(self, content: bytes, name: str) -> None:
        """Take the events of a file, and years enough for them.

        Raises
        ------
        InputFormatError, UsageError
            If it holds anything else.
        """
        self._record(self.plan.with_(programmes=read_programmes(content, name)).long_enough())

    def open_parameters(self, content: bytes, name: str) -> None:
        """Take the parameters of growth of a file.

        Raises
        ------
        InputFormatError
            If it holds anything else.
        """
        self._record(self.plan.with_(options=read_growth(content, name)))

    def undo(self) -> None:
        """Take the last step back."""
        self.history = self.history.undo()

    def redo(self) -> None:
        """Do what was undone last."""
        self.history = self.history.redo()

    # What is shown.

    def tell(self, story: Story) -> None:
        """Take over years that have grown; what was picked stays picked where its year is the same."""
        before = self.year
        self.story = story
        if self.year is not before:
            self.branch = None

    @property
    def year(self) -> Year | None:
        """The year that is shown."""
        if self.story is None or not self.story.years:
            return None
        last = len(self.story.years) - 1
        return self.story.years[last if self.wanted is None else min(self.wanted, last)]

    def look_at(self, year: int) -> None:
        """Show another year."""
        before = self.year
        self.wanted = max(year, 0)
        if self.year is not before:
            self.branch = None

    def pick(self, camera: Mapping[str, Any], place: Sequence[Any], size: Sequence[Any]) -> Branch | None:
        """Pick what stands at a place of the picture; nothing there picks nothing.

        Raises
        ------
        UsageError
            If the browser does not tell where.
        """
        self.branch = None
        year = self.year
        if year is not None and (hit := picked(year.limbs, ray_of(camera, place, size))) is not None:
            self.branch = branch_at(year.limbs, *hit, year.tree)
        return self.branch

    @property
    def place(self) -> Floats | None:
        """(3,) what is picked, in the coordinates of the tree."""
        if self.branch is None:
            return None
        return np.asarray(self.branch.place + self.plan.start.tree.skeleton.origin)

    def rows(self) -> list[dict[str, Any]]:
        """Return the list of events as people read it; what came of them where that is known."""
        grown = self.story if self.story is not None and self.story.plan is self.plan else None
        return [row(one, number, grown) for number, one in enumerate(self.plan.programmes)]

    # What is saved.

    @property
    def stem(self) -> str:
        """Name of files without a suffix."""
        return f"{self.plan.start.name}-{self.plan.seed}"

    @property
    def command(self) -> str:
        """The command that grows the same years from what is saved here."""
        return command_of(self.plan, self.stem)

    def saved_events(self) -> bytes:
        """Return the events as the file that `treepipe simulate` replays.

        Raises
        ------
        UsageError
            While it is not known which of them fit.
        """
        if self.story is None or self.story.plan is not self.plan or not self.story.whole:
            msg = "the years still grow, and only then tell which events fit; wait or press Grow, then save"
            raise UsageError(msg)
        return written(self.story)

    def saved_parameters(self) -> bytes:
        """Return all parameters of growth as TOML, every key explained."""
        return to_toml(self.plan.options).encode()

    def saved_start(self) -> bytes:
        """Return the tree of year 0, as it was given, as .npz.

        Raises
        ------
        UsageError
            If that is a bud.
        """
        return packed(self.plan.start.tree, "npz", f"{self.stem}-start")[1]

    def exported(self, format_name: str) -> tuple[str, bytes]:
        """Return name and content of the shown year's tree in a format, as `treepipe simulate` writes it.

        Raises
        ------
        UsageError
            If there is no wood yet.
        """
        year = self.year
        if year is None:
            msg = "no year has grown yet; press Grow"
            raise UsageError(msg)
        return packed(year.tree, format_name, f"year_{year.number:03d}")

    def save(self) -> list[Path]:
        """Write events, parameters and, if it comes from no file, the tree of year 0 into the first folder.

        Raises
        ------
        UsageError, OutputError, OutputExistsError
            If they cannot go there.
        """
        held = {
            f"{self.stem}{EVENTS}": self.saved_events(),
            f"{self.stem}{PARAMETERS}": self.saved_parameters(),
        }
        if not self.plan.start.is_bud and self.plan.start.path is None:
            check_is_tree(self.plan.start.tree)
            held[f"{self.stem}-start.npz"] = self.saved_start()
        targets = [self.folders.to_write(name) for name in held]
        for target, content in zip(targets, held.values(), strict=True):
            write_bytes(target, content)
        return targets

    def _begin(self, start: Start, programmes: tuple[Programme, ...] = ()) -> None:
        self._record(self.plan.from_start(start).with_(programmes=programmes).long_enough())
        self.wanted = None

    def _record(self, plan: Plan, gesture: str | None = None) -> None:
        self.history = self.history.record(plan, gesture)
