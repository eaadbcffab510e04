"""What the Years tab shows: the state of the page, and the picture, as the session has them."""

from __future__ import annotations

from typing import Any

from pipeline.errors import UsageError
from pipeline.exchange import FORMATS
from pipeline.studio.shell import Shell
from pipeline.studio.years.forms import fields_of, first_values, looked_at, operations
from pipeline.studio.years.growing import Story
from pipeline.studio.years.parameters import CHOICES, SLIDERS
from pipeline.studio.years.plan import species_choices
from pipeline.studio.years.scene import Scene
from pipeline.studio.years.session import Session
from pipeline.studio.years.words import NO_FIGURES, branch_words, figures_of, progress_words

NEW = -1
"""Number of the event that is edited, where it is a new one."""
FIRST = "cut-to-bud"
PRUNE, EVENTS = 1, 2
"""Parts of the drawer that are unfolded at first; growth, the one before them, is not."""


class Board:
    """Shows a session on the page.

    Parameters
    ----------
    shell : Shell
    session : Session
    scene : Scene

    Attributes
    ----------
    view : PyVistaLocalView
        Is set once the page is laid out.
    fits : bool
        Whether the camera stands for the tree that is shown.
    """

    def __init__(self, shell: Shell, session: Session, scene: Scene) -> None:
        self.shell, self.state, self.session, self.scene = shell, shell.state, session, scene
        self.view: Any = None
        self.fits = False
        self._known_wrong: set[str] = set()
        self._filled: dict[str, str] = {}
        self.start_state()

    def start_state(self) -> None:
        """Give every variable of the page its first value."""
        self.state.update({"years_busy": False, "years_progress": 0, "years_doing": "", "years_note": ""})
        self.state.update({"years_year": 0, "years_last": 0, "years_playing": False, "years_shown": 0})
        self.state.update({"years_figures": NO_FIGURES, "years_branch": None, "years_colouring": "age"})
        self.state.update({"years_format": "lsjson", "years_files": [], "years_file": ""})
        self.state.years_panels = [PRUNE, EVENTS]
        self.state.years_suffixes = {name: kind.suffix for name, kind in FORMATS.items()}
        self.state.years_all_species = [{"value": k, "title": t} for k, t in species_choices().items()]
        self.state.update({"years_operations": operations(), "years_operation": FIRST, "years_editing": NEW})
        self.show_plan()
        self.show_form()

    def show_plan(self) -> None:
        """Show the plan: what it begins with, its years, parameters and events."""
        plan = self.session.plan
        for slider in SLIDERS:
            self.state[slider.key] = getattr(plan.options, slider.name)
        for name in CHOICES:
            self.state[f"years_{name}"] = getattr(plan.options, name)
        self.state.update({"years_span": plan.years, "years_seed": plan.seed})
        self.state.years_species = plan.species or ""
        self.state.years_file = str(plan.start.path or "")
        self.state.years_start = plan.start.name
        self.state.years_kind = "bud" if plan.start.is_bud else "file" if plan.start.path else "model"
        self.state.update({"years_stem": self.session.stem, "years_command": self.session.command})
        self.show_steps()

    def show_steps(self) -> None:
        """Show what can be undone, the list of events, and the command."""
        history = self.session.history
        self.state.update({"years_can_undo": bool(history.past), "years_can_redo": bool(history.undone)})
        self.state.update({"years_stem": self.session.stem, "years_command": self.session.command})
        self.state.years_rows = self.session.rows()

    def show_form(self, values: dict[str, Any] | None = None) -> None:
        """Show the fields of the operation, with what is known of a new event or the values of an old one."""
        operation = str(self.state.years_operation)
        try:
            fields = fields_of(operation)
        except UsageError as error:
            self.shell.trouble(str(error))
            return
        if values is None:
            values = first_values(operation, self._number, self.session.place)
        self._filled = looked_at(self._number, self.session.place)
        self.state.update({"years_fields": fields, "years_values": values})

    def fill_in(self) -> None:
        """Give a new event the year and the place that are looked at since; what was typed stays."""
        seen, typed = looked_at(self._number, self.session.place), dict(self.state.years_values)
        new = {key: value for key, value in seen.items() if key in typed and value != self._filled.get(key)}
        self._filled = seen
        if new:
            self.state.years_values = typed | new

    def show_story(self, story: Story) -> None:
        """Show years that have grown; those of a plan that is no longer wanted are passed over."""
        if story.plan is not self.session.plan:
            return
        self.session.tell(story)
        share, doing = progress_words(story)
        self.state.years_last = max(len(story.years) - 1, 0)
        busy = not story.whole
        self.state.update({"years_busy": busy, "years_progress": share, "years_doing": doing if busy else ""})
        if not self.fits:
            self.show_year(fit=True)
            self.fits = story.whole
        else:
            self.show_year()
        if story.whole:
            self.tell_end(story)

    def tell_end(self, story: Story) -> None:
        """Say what went wrong, and what has come of the events."""
        self.show_steps()
        wrong = {sentence for _, sentence in story.misfits().values()}
        new, self._known_wrong = sorted(wrong - self._known_wrong), wrong
        if story.ended or new:
            self.shell.trouble(story.ended or f"{new[-1]}; it is left out, in this year and later")
        self.state.years_shown += 1

    def show_year(self, *, fit: bool = False) -> None:
        """Show the year of the session."""
        year, story = self.session.year, self.session.story
        if year is None or story is None:
            return
        self.scene.show(year, self.state.years_colouring)
        if fit and len(year.tree) > 1:
            self.scene.look()
        self.state.years_year = year.number
        self.state.years_figures = figures_of(year, story)
        self.show_branch()
        if fit and len(year.tree) > 1:
            self.view.push_camera()

    def show_branch(self) -> None:
        """Show what is picked, and draw."""
        branch, year = self.session.branch, self.session.year
        self.scene.mark(year.limbs if year else None, branch)
        self.state.years_branch = branch_words(branch) if branch else None
        if self.state.years_editing == NEW:
            self.fill_in()
        self.view.update()

    @property
    def _number(self) -> int:
        """The year that is shown."""
        return self.session.year.number if self.session.year else 0

    def look(self) -> None:
        """Stand where the whole tree is seen."""
        self.scene.look()
        self.view.push_camera()
