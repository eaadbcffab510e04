"""What stands where on the page: tabs and buttons above, sliders on the left, the tree, its figures below."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from trame.ui.vuetify3 import VAppLayout
from trame.widgets import html
from trame.widgets import vuetify3 as v
from trame_pyvista.widgets import PyVistaLocalView

from pipeline.exchange import FORMATS
from pipeline.studio.files import MOST_BYTES
from pipeline.studio.parameters import PARAMETERS, Parameter
from pipeline.synthetic.colonization import PRESETS

if TYPE_CHECKING:
    from pipeline.studio.page import Page

DOWNLOADS = ("obj", *(name for name in FORMATS if name != "obj"))
SMALL = {"size": "small", "variant": "tonal", "classes": "mx-1"}
TOO_LARGE = f"this file has more than {MOST_BYTES} bytes; choose a parameter file"
"""Said in the browser, before anything is sent."""


def lay_out(page: Page) -> Any:
    """Lay the page out; return its view."""
    with VAppLayout(page.server, full_height=True), v.VLayout(style="height:100vh"):
        with v.VAppBar(density="compact", elevation=1):
            v.VAppBarTitle("treepipe studio", style="max-width:180px")
            with v.VTabs(v_model=("tab",), density="compact"):
                v.VTab("Model", value="model")
            v.VSpacer()
            _buttons(page)
        with (
            v.VNavigationDrawer(permanent=True, width=330),
            v.VWindow(v_model=("tab",)),
            v.VWindowItem(value="model"),
        ):
            _sliders(page)
        with v.VMain(style="height:100vh"), html.Div(style="position:relative;height:100%;width:100%"):
            make: Any = PyVistaLocalView
            view = make(page.scene.plotter, style="height:100%;width:100%")
            _messages(page)
            _figures()
    return view


def _buttons(page: Page) -> None:
    """Lay out what is done with one click."""

    def button(text: str, name: str, click: Any, hint: str, **more: Any) -> None:
        v.VBtn(text, click=click, title=hint, id=f"do-{name}", **SMALL, **more)

    button("New seed", "seed", lambda: page.act("new_seed"), "Another tree of the same parameters")
    button("Undo", "undo", lambda: page.act("undo"), "Take the last step back", disabled=("!can_undo",))
    button("Redo", "redo", lambda: page.act("redo"), "Do again what was undone", disabled=("!can_redo",))
    button("Reset", "reset", lambda: page.act("reset"), "All parameters as at the start; can be undone")
    button("Fit", "fit", page.fit, "Show the whole tree")
    with v.VMenu():
        with v.Template(v_slot_activator="{ props }"):
            v.VBtn("Examples", v_bind="props", id="examples", **SMALL)
        with v.VList(density="compact"):
            for name in PRESETS:
                v.VListItem(title=name, id=f"preset-{name}", click=lambda name=name: page.act("preset", name))
    with v.VMenu(close_on_content_click=False):
        with v.Template(v_slot_activator="{ props }"):
            v.VBtn("Files", v_bind="props", id="files", **SMALL)
        with v.VCard(classes="pa-3", width=340):
            _files(page)


def _files(page: Page) -> None:
    """Lay out opening, downloading and saving."""
    read = "$event.text().then((text) => trigger('open_parameters', [$event.name, text]))"
    bounded = f"$event && ($event.size > {MOST_BYTES} ? (trouble = '{TOO_LARGE}') : {read})"
    v.VFileInput(
        label="Open parameters (.toml)",
        accept=".toml",
        density="compact",
        id="open-parameters",
        update_modelValue=bounded,
    )
    save = "utils.download(stem + '.toml', trigger('save_parameters'), 'application/toml')"
    v.VBtn("Save parameters (.toml)", click=save, id="save-parameters", block=True, classes="mb-3")
    v.VSelect(label="Format", v_model=("format",), items=("formats", list(DOWNLOADS)), density="compact")
    name = "stem + suffixes[format] + (format == 'obj' ? '.zip' : '')"
    get = f"utils.download({name}, trigger('export'), 'application/octet-stream')"
    v.VBtn("Download the tree", click=get, id="download", block=True, disabled=("!shown",))
    html.Div("OBJ comes with its MTL and pictures in a .zip.", classes="text-caption my-1")
    if page.session.folders.all:
        v.VTextField(label="Name in the folder", v_model=("save_name",), density="compact", id="save-name")
        v.VBtn("Save into the folder", click=page.save, id="save", block=True)
        html.Div(str(page.session.folders.all[0]), classes="text-caption")


def _sliders(page: Page) -> None:
    """Lay out the parameters, group by group."""
    group = ""
    with html.Div(classes="px-3 pb-3"):
        for parameter in PARAMETERS:
            if parameter.group != group:
                group = parameter.group
                html.Div(group, classes="text-subtitle-2 mt-2")
            with html.Div(title=parameter.sentence, id=f"set-{parameter.name}"):
                _choice(parameter) if parameter.choices else _slider(parameter, page)


def _slider(parameter: Parameter, page: Page) -> None:
    with html.Div(classes="d-flex justify-space-between text-caption"):
        html.Span(parameter.label)
        html.Span(f"{{{{ +(+{parameter.name}).toFixed(2) }}}} {parameter.unit}")
    v.VSlider(
        v_model=(parameter.name,),
        min=parameter.low,
        max=parameter.high,
        step=parameter.step,
        density="compact",
        hide_details=True,
        start=page.hold,
        end=page.settle,
        aria_label=parameter.label,
        __properties=[("aria_label", "aria-label")],
    )


def _choice(parameter: Parameter) -> None:
    v.VSelect(
        label=parameter.label,
        v_model=(parameter.name,),
        items=(f"{parameter.name}_choices", list(parameter.choices)),
        density="compact",
        hide_details=True,
        classes="my-2",
    )


def _messages(page: Page) -> None:
    """Lay out progress and sentences over the picture."""
    with html.Div(style="position:absolute;top:8px;left:8px;right:8px;pointer-events:none"):
        alert = {"density": "compact", "closable": True, "style": "pointer-events:auto", "classes": "mb-2"}
        v.VAlert(
            "{{ trouble }}", v_if="trouble", type="warning", id="trouble", click_close="trouble = ''", **alert
        )
        v.VAlert("{{ good }}", v_if="good", type="success", id="good", click_close="good = ''", **alert)
        with html.Div(v_if="busy || doing", classes="d-flex align-center", style="pointer-events:auto"):
            v.VProgressLinear(v_if="busy", model_value=("progress",), style="max-width:240px", height=8)
            html.Span("{{ doing }}", id="doing", classes="mx-3 text-caption")
            v.VBtn("Stop", v_if="busy", click=page.stop, id="stop", size="small", color="warning")


def _figures() -> None:
    """Lay out the line of figures."""
    line = "position:absolute;bottom:0;left:0;right:0;background:rgba(255,255,255,.8)"
    with html.Div(
        id="figures",
        style=line,
        classes="px-3 py-1 text-caption",
        data_shown=("shown",),
        __properties=[("data_shown", "data-shown")],
    ):
        for name in ("nodes", "vertices", "triangles"):
            html.Span(f"{{{{ figures.{name} }}}}", id=f"figure-{name}")
            html.Span(f" {name} · ")
        html.Span("{{ figures.milliseconds }}", id="figure-milliseconds")
        html.Span(" ms · seed ")
        html.Span("{{ figures.seed }}", id="figure-seed")
        html.Span(" · ended: {{ figures.reason }}", id="figure-reason")
