"""What stands where in the Years tab: buttons above, start, growth and events on the left, the tree."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from trame.widgets import html
from trame.widgets import vuetify3 as v

from pipeline.exchange import FORMATS
from pipeline.studio.view import View
from pipeline.studio.years.listing import MOST_BYTES
from pipeline.studio.years.parameters import CHOICES, SLIDERS, Slider, choices_of
from pipeline.studio.years.scene import COLOURINGS

if TYPE_CHECKING:
    from pipeline.studio.years.tab import YearsTab

SMALL = {"size": "small", "variant": "tonal", "classes": "mx-1"}
COMPACT: dict[str, Any] = {"density": "compact", "hide_details": True}
CLICK_PX = 4
"""A pointer that moves farther turns the tree, and picks nothing."""
TOO_LARGE = f"this file has more than {MOST_BYTES} bytes; choose a file of events or parameters"
OVER = "background:rgba(255,255,255,.85)"


def main(tab: YearsTab) -> Any:
    """Lay out the picture with what stands over it; return its view."""
    plotter = tab.board.scene.plotter
    ref = f"view_{plotter._id_name}"  # the view names itself after it
    place = "[$event.clientX - $event.currentTarget.getBoundingClientRect().left, "
    place += "$event.clientY - $event.currentTarget.getBoundingClientRect().top]"
    size = "[$event.currentTarget.clientWidth, $event.currentTarget.clientHeight]"
    still = "Math.hypot($event.clientX - window.treepipeDown[0], $event.clientY - window.treepipeDown[1])"
    camera = f"window.trame.refs['{ref}'].getCamera()"
    with html.Div(
        id="years-view",
        style="height:100%;width:100%",
        pointerdown="window.treepipeDown = [$event.clientX, $event.clientY]",
        click=f"{still} < {CLICK_PX} && trigger('years_pick', [{camera}, {place}, {size}])",
        __events=["pointerdown"],
    ):
        view = View(tab.shell, plotter, style="height:100%;width:100%")
    _branch(tab)
    with html.Div(style=f"position:absolute;bottom:0;left:0;right:0;{OVER}"):
        _progress(tab)
        _slider_of_years(tab)
        _figures()
    return view


def buttons(tab: YearsTab) -> None:
    """Lay out what is done with one click."""

    def button(text: str, name: str, click: Any, hint: str, **more: Any) -> None:
        v.VBtn(text, click=click, title=hint, id=f"years-{name}", **SMALL, **more)

    button("Grow", "grow", tab.grow, "Grow what has not grown yet", disabled=("years_busy",), color="primary")
    button("New seed", "new-seed", lambda: tab.act("new_seed"), "Another tree of the same parameters")
    button("Undo", "undo", tab.undo, "Take the last step back", disabled=("!years_can_undo",))
    button("Redo", "redo", tab.redo, "Do again what was undone", disabled=("!years_can_redo",))
    button("Fit", "fit", tab.fit, "Show the whole tree")
    with v.VMenu(close_on_content_click=False):
        with v.Template(v_slot_activator="{ props }"):
            v.VBtn("Files", v_bind="props", id="years-files", **SMALL)
        with v.VCard(classes="pa-3", width=360):
            _files(tab)


def side(tab: YearsTab) -> None:
    """Lay out the drawer."""
    with html.Div(classes="px-3 pb-3"):
        _start(tab)
        with v.VExpansionPanels(multiple=True, variant="accordion", model_value=("[1, 2]",), classes="mt-2"):
            with _panel("Growth", "years-panel-growth"):
                _growth(tab)
            with _panel("Prune", "years-panel-prune"):
                _form(tab)
            with _panel("Events", "years-panel-events"):
                _events(tab)


def _panel(title: str, name: str) -> Any:
    """Lay out a part of the drawer that can be folded; return what it holds."""
    panel = v.VExpansionPanel(id=name)
    with panel:
        v.VExpansionPanelTitle(title, classes="py-1", style="min-height:36px")
        return v.VExpansionPanelText(eager=True)


def _start(tab: YearsTab) -> None:
    """Lay out what the years begin with, and how many there are."""
    html.Div("Begin with", classes="text-subtitle-2 mt-2")
    with html.Div(classes="d-flex"):
        begin: dict[str, Any] = {"size": "small", "variant": "tonal"}
        lit = "years_kind == '{}' ? 'primary' : undefined"
        with_bud = {"color": (lit.format("bud"),), "click": lambda: tab.act("begin_with_bud")}
        v.VBtn("A bud", id="years-bud", classes="mr-2", **begin, **with_bud)
        with_model = {"color": (lit.format("model"),), "click": tab.begin_with_model}
        v.VBtn("The Model tab's tree", id="years-model", **begin, **with_model)
    with html.Div(v_if="years_files.length || years_file", classes="d-flex align-center mt-2"):
        short = "years_files.map((file) => ({value: file, title: file.split(/[\\\\/]/).slice(-2).join('/')}))"
        v.VSelect(
            label="A model of the folders",
            v_model=("years_file",),
            items=(short,),
            id="years-file",
            **COMPACT,
        )
        v.VBtn("↻", click=tab.refresh, title="Look again", size="small", variant="text")
    with html.Div(classes="d-flex mt-2"):
        number = {"type": "number", "min": 0, **COMPACT}
        v.VTextField(label="Years", v_model=("years_span",), id="years-span", classes="mr-2", **number)
        v.VTextField(label="Seed", v_model=("years_seed",), id="years-seed", **number)
    v.VSelect(
        label="Species",
        v_model=("years_species",),
        items=("years_all_species",),
        id="years-species",
        classes="mt-2",
        **COMPACT,
    )


def _growth(tab: YearsTab) -> None:
    """Lay out the parameters of growth."""
    for slider in SLIDERS:
        with html.Div(title=slider.sentence, id=f"years-set-{slider.name}"):
            _slider(slider, tab)
    for name, label in CHOICES.items():
        items = (f"years_{name}_choices", choices_of(name))
        v.VSelect(label=label, v_model=(f"years_{name}",), items=items, classes="my-2", **COMPACT)
    html.Div("{{ years_note }}", v_if="years_note", id="years-note", classes="text-caption text-warning")


def _slider(slider: Slider, tab: YearsTab) -> None:
    with html.Div(classes="d-flex justify-space-between text-caption"):
        html.Span(slider.label)
        html.Span(f"{{{{ +(+{slider.key}).toFixed(4) }}}} {slider.unit}")
    v.VSlider(
        v_model=(slider.key,),
        min=slider.low,
        max=slider.high,
        step=slider.step,
        end=tab.settle,
        aria_label=slider.label,
        __properties=[("aria_label", "aria-label")],
        **COMPACT,
    )


def _form(tab: YearsTab) -> None:
    """Lay out an operation with its fields."""
    with html.Div(v_if="years_editing >= 0", classes="text-caption text-primary", id="years-editing"):
        html.Span("Event {{ years_editing + 1 }} is edited. ")
        html.A("A new one instead", click=tab.new_event, style="cursor:pointer;text-decoration:underline")
    v.VSelect(
        label="Operation",
        v_model=("years_operation",),
        items=("years_operations",),
        id="years-operation",
        **COMPACT,
    )
    about = "{{ (years_operations.find((one) => one.value == years_operation) || {}).about }}"
    html.Div(about, classes="text-caption mb-2")
    _fields("f.group != 'which' && f.name != 'until' && f.name != 'every'")
    _fields("f.name == 'position'")
    html.Div(
        "Click a branch in the picture to fill the position in; empty it for the whole tree.",
        v_if="years_fields.some((f) => f.name == 'position')",
        classes="text-caption",
    )
    with html.Details(classes="my-2 text-caption"):
        html.Summary("Repeat, and other branches", style="cursor:pointer")
        _fields("f.name == 'until' || f.name == 'every' || (f.group == 'which' && f.name != 'position')")
    text = "{{ years_editing >= 0 ? 'Change the event' : 'Do it in year ' + years_values.year }}"
    apply = "trigger('years_apply', [years_operation, years_values])"
    v.VBtn(text, click=apply, id="years-apply", block=True, size="small", color="primary")


def _fields(which: str) -> None:
    """Lay out some of the fields; they are edited in the browser, and sent when the button is pressed."""
    kept = {"v_model": ("years_values[f.name]",), "update_modelValue": "flushState('years_values')"}
    label = ("f.label + (f.must ? ' *' : '')",)
    common: dict[str, Any] = {**COMPACT, "classes": "mb-1", "title": ("f.sentence",), "label": label}
    named = {"id": ("'years-field-' + f.name",)}
    with v.Template(v_for="f in years_fields", key="f.name"), html.Div(v_if=which):
        v.VSelect(v_if="f.kind == 'choice'", items=("f.choices",), **common, **kept, **named)
        v.VCheckbox(v_if="f.kind == 'flag'", **common, **kept, **named)
        v.VTextField(v_if="f.kind == 'number' || f.kind == 'text'", **common, **kept, **named)


def _events(tab: YearsTab) -> None:
    """Lay out the list of events."""
    html.Div("Nothing is done to the tree yet.", v_if="!years_rows.length", classes="text-caption")
    with html.Div(
        v_for="row in years_rows",
        key="row.number",
        classes="py-1 years-event",
        style="border-top:1px solid #ddd",
        id=("'years-event-' + row.number",),
    ):
        with html.Div(classes="d-flex align-center"):
            html.Div("{{ row.when }} · {{ row.operation }}", classes="text-body-2 flex-grow-1")
            for text, hint, name, act in (
                ("↑", "Earlier in the list", "up", lambda number: tab.act("move", number, -1)),
                ("↓", "Later in the list", "down", lambda number: tab.act("move", number, 1)),
                ("✎", "Edit", "edit", tab.edit),
                ("✕", "Leave out", "remove", lambda number: tab.act("remove", number)),
            ):
                v.VBtn(
                    text,
                    click=(act, "[row.number]"),
                    title=hint,
                    size="x-small",
                    variant="text",
                    style="min-width:26px;padding:0",
                    id=(f"'years-{name}-' + row.number",),
                )
        html.Div("{{ row.told }}", classes="text-caption", v_if="row.told")
        html.Div("{{ row.came }}", classes="text-caption text-success", v_if="row.came")
        html.Div("{{ row.wrong }}", classes="text-caption text-error", v_if="row.wrong")


def _files(tab: YearsTab) -> None:
    """Lay out opening, downloading and saving."""
    for kind, label in (("events", "Open events (.toml)"), ("parameters", "Open parameters (.toml)")):
        read = f"$event.text().then((text) => trigger('years_open', ['{kind}', $event.name, text]))"
        bounded = f"$event && ($event.size > {MOST_BYTES} ? (trouble = '{TOO_LARGE}') : {read})"
        v.VFileInput(
            label=label, accept=".toml", density="compact", id=f"years-open-{kind}", update_modelValue=bounded
        )

    def download(text: str, name: str, file: str, **more: Any) -> None:
        keep = f"made && utils.download({file}, made, 'application/octet-stream')"
        get = f"trigger('years_{name}').then((made) => {keep})"
        v.VBtn(text, click=get, id=f"years-{name}", block=True, size="small", classes="mb-2", **more)

    download("Save events (.toml)", "save_events", "years_stem + '.events.toml'")
    download("Save parameters (.toml)", "save_parameters", "years_stem + '.growth.toml'")
    from_model = {"v_if": "years_kind == 'model'"}
    download("Save the tree of year 0 (.npz)", "save_start", "years_stem + '-start.npz'", **from_model)
    v.VSelect(label="Format", v_model=("years_format",), items=("years_formats", list(FORMATS)), **COMPACT)
    zipped = "(years_format == 'obj' ? '.zip' : '')"
    number = "String(years_year).padStart(3, '0')"
    file = f"years_stem + '-year' + {number} + years_suffixes[years_format] + {zipped}"
    html.Div(classes="mb-2")
    download("Download the tree of year {{ years_year }}", "export", file, disabled=("!years_shown",))
    if tab.shell.folders.all:
        v.VBtn(
            "Save events and parameters into the folder",
            click=tab.save,
            id="years-save",
            block=True,
            size="small",
        )
        html.Div(str(tab.shell.folders.all[0]), classes="text-caption")
    html.Div("The same years, without this page:", classes="text-caption mt-2")
    html.Code("{{ years_command }}", id="years-command", classes="text-caption")


def _branch(tab: YearsTab) -> None:
    """Lay out what is picked."""
    style = f"position:absolute;top:8px;right:8px;width:250px;{OVER}"
    with v.VCard(v_if="years_branch", id="years-branch", style=style, classes="pa-2 text-caption"):
        with html.Div(classes="d-flex justify-space-between"):
            html.B("{{ years_branch.title }}")
            html.A("✕", click=tab.unpick, style="cursor:pointer", id="years-unpick")
        html.Div("{{ years_branch.length }} long, {{ years_branch.base }} thick where it begins")
        html.Div(
            "at the click: {{ years_branch.here }} thick, {{ years_branch.bears }} of wood from there on"
        )
        html.Div("this wood {{ years_branch.born }}")
        html.Div("radii: {{ years_branch.known }}")
        html.Div("Red is the branch, orange what it bears beyond the click.", classes="text-disabled")


def _progress(tab: YearsTab) -> None:
    """Lay out how far a growth is."""
    with html.Div(v_if="years_busy || years_doing", classes="d-flex align-center px-2"):
        v.VProgressLinear(v_if="years_busy", model_value=("years_progress",), style="width:240px", height=8)
        html.Span("{{ years_doing }}", id="years-doing", classes="mx-3 text-caption")
        v.VBtn("Stop", v_if="years_busy", click=tab.stop, id="years-stop", size="small", color="warning")


def _slider_of_years(tab: YearsTab) -> None:
    """Lay out the slider of years, the film, and the colours."""
    with html.Div(classes="d-flex align-center px-3", id="years-slider"):
        v.VBtn("{{ years_playing ? '❚❚' : '▶' }}", click=tab.play, id="years-play", title="Film", **SMALL)
        v.VSlider(
            v_model=("years_year",),
            min=0,
            max=("Math.max(years_last, 1)",),
            step=1,
            thumb_label=True,
            aria_label="Year",
            __properties=[("aria_label", "aria-label")],
            **COMPACT,
        )
        html.Span("Year {{ years_year }}", classes="text-body-2 mx-3", style="white-space:nowrap")
        items = ("years_colourings", [{"value": key, "title": title} for key, title in COLOURINGS.items()])
        v.VSelect(
            v_model=("years_colouring",),
            items=items,
            style="max-width:150px",
            id="years-colouring",
            **COMPACT,
        )


def _figures() -> None:
    """Lay out the line of figures."""
    with html.Div(
        id="years-figures",
        classes="px-3 py-1 text-caption",
        data_shown=("years_shown",),
        __properties=[("data_shown", "data-shown")],
    ):
        for name, before, after in (
            ("year", "year ", ""),
            ("metamers", "", " metamers"),
            ("height", "height ", ""),
            ("dbh", "DBH ", ""),
            ("crown", "crown ", ""),
            ("volume", "wood ", ""),
            ("milliseconds", "grown in ", " ms"),
        ):
            html.Span(f" · {before}" if name != "year" else before)
            html.Span(f"{{{{ years_figures.{name} }}}}", id=f"years-figure-{name}")
            html.Span(after)
