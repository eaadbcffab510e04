"""What stands where in the Model tab: buttons above, sliders on the left, the tree, its figures below."""

from __future__ import annotations

from typing import Any

from trame.widgets import html
from trame.widgets import vuetify3 as v

from pipeline.exchange import FORMATS
from pipeline.studio.modeller.actions import Actions
from pipeline.studio.modeller.files import MOST_BYTES
from pipeline.studio.modeller.parameters import PARAMETERS, Parameter
from pipeline.studio.view import View
from pipeline.synthetic.colonization import PRESETS

DOWNLOADS = ("obj", *(name for name in FORMATS if name != "obj"))
SMALL = {"size": "small", "variant": "tonal", "classes": "mx-1"}
TOO_LARGE = f"this file has more than {MOST_BYTES} bytes; choose a parameter file"
"""Said in the browser, before anything is sent."""


def main(tab: Actions) -> Any:
    """Lay out the picture with what stands over it; return its view."""
    view = View(tab.shell, tab.scene.plotter, style="height:100%;width:100%")
    _progress(tab)
    _figures()
    return view


def buttons(tab: Actions) -> None:
    """Lay out what is done with one click."""

    def button(text: str, name: str, click: Any, hint: str, **more: Any) -> None:
        v.VBtn(text, click=click, title=hint, id=f"do-{name}", **SMALL, **more)

    button("New seed", "seed", lambda: tab.act("new_seed"), "Another tree of the same parameters")
    button("Undo", "undo", lambda: tab.act("undo"), "Take the last step back", disabled=("!can_undo",))
    button("Redo", "redo", lambda: tab.act("redo"), "Do again what was undone", disabled=("!can_redo",))
    button("Reset", "reset", lambda: tab.act("reset"), "All parameters as at the start; can be undone")
    button("Fit", "fit", tab.fit, "Show the whole tree")
    with v.VMenu():
        with v.Template(v_slot_activator="{ props }"):
            v.VBtn("Examples", v_bind="props", id="examples", **SMALL)
        with v.VList(density="compact"):
            for name in PRESETS:
                v.VListItem(title=name, id=f"preset-{name}", click=lambda name=name: tab.act("preset", name))
    with v.VMenu(close_on_content_click=False):
        with v.Template(v_slot_activator="{ props }"):
            v.VBtn("Files", v_bind="props", id="files", **SMALL)
        with v.VCard(classes="pa-3", width=340):
            _files(tab)


def _files(tab: Actions) -> None:
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
    if tab.shell.folders.all:
        v.VTextField(label="Name in the folder", v_model=("save_name",), density="compact", id="save-name")
        v.VBtn("Save into the folder", click=tab.save, id="save", block=True)
        html.Div(str(tab.shell.folders.all[0]), classes="text-caption")


def sliders(tab: Actions) -> None:
    """Lay out the parameters, group by group."""
    group = ""
    with html.Div(classes="px-3 pb-3"):
        for parameter in PARAMETERS:
            if parameter.group != group:
                group = parameter.group
                html.Div(group, classes="text-subtitle-2 mt-2")
            with html.Div(title=parameter.sentence, id=f"set-{parameter.name}"):
                _choice(parameter) if parameter.choices else _slider(parameter, tab)


def _slider(parameter: Parameter, tab: Actions) -> None:
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
        start=tab.hold,
        end=tab.settle,
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


def _progress(tab: Actions) -> None:
    """Lay out how far a growth is, below the sentences."""
    with html.Div(
        v_if="busy || doing",
        classes="d-flex align-center px-2",
        style="position:absolute;bottom:36px;left:8px;background:rgba(255,255,255,.8)",
    ):
        v.VProgressLinear(v_if="busy", model_value=("progress",), style="width:240px", height=8)
        html.Span("{{ doing }}", id="doing", classes="mx-3 text-caption")
        v.VBtn("Stop", v_if="busy", click=tab.stop, id="stop", size="small", color="warning")


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
