"""What stands where in the Years tab: buttons above, start, growth and events on the left, the tree."""

from __future__ import annotations

from typing import Any

from trame.widgets import html
from trame.widgets import vuetify3 as v

from pipeline.exchange import FORMATS
from pipeline.studio.view import View
from pipeline.studio.years import pruning
from pipeline.studio.years.actions import Actions
from pipeline.studio.years.listing import MOST_BYTES
from pipeline.studio.years.parameters import CHOICES, SLIDERS, Slider, choices_of
from pipeline.studio.years.scene import COLOURINGS
from pipeline.studio.years.styles import COMPACT, OVER, SMALL

CLICK_PX = 4
"""A pointer that moves farther turns the tree, and picks nothing."""
TOO_LARGE = f"this file has more than {MOST_BYTES} bytes; choose a file of events or parameters"


def main(tab: Actions) -> Any:
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
    pruning.branch(tab)
    with html.Div(style=f"position:absolute;bottom:0;left:0;right:0;{OVER}"):
        _progress(tab)
        _slider_of_years(tab)
        _figures()
    return view


def buttons(tab: Actions) -> None:
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


def side(tab: Actions) -> None:
    """Lay out the drawer."""
    with html.Div(classes="px-3 pb-3"):
        _start(tab)
        with v.VExpansionPanels(
            multiple=True, variant="accordion", v_model=("years_panels",), classes="mt-2"
        ):
            with _panel("Growth", "years-panel-growth"):
                _growth(tab)
            with _panel("Prune", "years-panel-prune"):
                pruning.form(tab)
            with _panel("Events", "years-panel-events"):
                pruning.events(tab)


def _panel(title: str, name: str) -> Any:
    """Lay out a part of the drawer that can be folded; return what it holds."""
    panel = v.VExpansionPanel(id=name)
    with panel:
        v.VExpansionPanelTitle(title, classes="py-1", style="min-height:36px")
        return v.VExpansionPanelText(eager=True)


def _start(tab: Actions) -> None:
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


def _growth(tab: Actions) -> None:
    """Lay out the parameters of growth."""
    for slider in SLIDERS:
        with html.Div(title=slider.sentence, id=f"years-set-{slider.name}"):
            _slider(slider, tab)
    for name, label in CHOICES.items():
        items = (f"years_{name}_choices", choices_of(name))
        v.VSelect(label=label, v_model=(f"years_{name}",), items=items, classes="my-2", **COMPACT)
    html.Div("{{ years_note }}", v_if="years_note", id="years-note", classes="text-caption text-warning")


def _slider(slider: Slider, tab: Actions) -> None:
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


def _files(tab: Actions) -> None:
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


def _progress(tab: Actions) -> None:
    """Lay out how far a growth is."""
    with html.Div(v_if="years_busy || years_doing", classes="d-flex align-center px-2"):
        v.VProgressLinear(v_if="years_busy", model_value=("years_progress",), style="width:240px", height=8)
        html.Span("{{ years_doing }}", id="years-doing", classes="mx-3 text-caption")
        v.VBtn("Stop", v_if="years_busy", click=tab.stop, id="years-stop", size="small", color="warning")


def _slider_of_years(tab: Actions) -> None:
    """Lay out the slider of years, the film, and the colours."""
    with html.Div(classes="d-flex align-center px-3", id="years-slider"):
        v.VBtn(
            "{{ years_playing ? '❚❚' : '▶' }}", click=tab.film.play, id="years-play", title="Film", **SMALL
        )
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
