"""What stands where in the Scan tab: files and options on the left, the picture, the report on the right."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from trame.widgets import html
from trame.widgets import vuetify3 as v

from pipeline.exchange import FORMATS
from pipeline.studio.scan.fields import FIELDS, STEPS, TABLES, Field
from pipeline.studio.view import View

if TYPE_CHECKING:
    from pipeline.studio.scan.tab import ScanTab

SMALL = {"size": "small", "variant": "tonal", "classes": "mx-1"}
DENSE = {"density": "compact", "hide_details": True}
ZIPPED = ("obj",)
"""Formats of several files."""

PANEL_PX = 330
LAYERS = {
    "cloud": "Cloud",
    "leaves": "Leaves",
    "rest": "Points left out",
    "axes": "Skeleton",
    "wood": "Cylinders",
}
TITLES = {"clean": "Cleaning", "skeleton": "Skeleton", "cylinders": "Cylinders"}
PALE = "background:rgba(255,255,255,.85)"


def buttons(tab: ScanTab) -> None:
    """Lay out what is done with one click."""

    def button(text: str, name: str, click: Any, hint: str, **more: Any) -> None:
        v.VBtn(text, click=click, title=hint, id=f"scan-do-{name}", **SMALL, **more)

    button("Undo", "undo", tab.undo, "Take the last change of an option back", disabled=("!scan_can_undo",))
    button("Redo", "redo", tab.redo, "Do again what was undone", disabled=("!scan_can_redo",))
    button("Reset", "reset", tab.reset, "All options as at the start; can be undone")
    button("Fit", "fit", tab.fit, "Show all")
    with v.VMenu(close_on_content_click=False):
        with v.Template(v_slot_activator="{ props }"):
            v.VBtn("Files", v_bind="props", id="scan-files", **SMALL)
        with v.VCard(classes="pa-3", width=340):
            _files()


def _files() -> None:
    """Lay out what is downloaded."""
    save = "utils.download(scan_stem + '.toml', trigger('scan_config'), 'application/toml')"
    v.VBtn("Save the options (.toml)", click=save, id="scan-save", block=True, disabled=("!scan_shown",))
    html.Div("treepipe run CLOUD --config takes them and makes this model.", classes="text-caption mb-3")
    v.VSelect(label="Format", v_model=("scan_format",), items=("scan_formats", list(FORMATS)), **DENSE)
    name = f"scan_stem + scan_suffixes[scan_format] + ({list(ZIPPED)}.includes(scan_format) ? '.zip' : '')"
    get = f"utils.download({name}, trigger('scan_export'), 'application/octet-stream')"
    v.VBtn(
        "Download the model",
        click=get,
        id="scan-download",
        block=True,
        classes="mt-2",
        disabled=("!scan_tree",),
    )


def side(tab: ScanTab) -> None:
    """Lay out the drawer."""
    with html.Div(classes="px-3 py-2"):
        with html.Div(classes="d-flex align-center"):
            v.VAutocomplete(
                label="Open a cloud, a run or a model",
                v_model=("scan_chosen", None),
                items=("scan_entries", []),
                update_modelValue="$event == null || trigger('scan_open', [$event])",
                no_data_text="nothing that can be opened in the folders; start the studio with one",
                id="scan-open",
                **DENSE,
            )
            v.VBtn("↻", click=tab.list_files, title="Look into the folders again", id="scan-list", **SMALL)
        _layers()
        _comparing()
        _options()


def _layers() -> None:
    """Lay out what is shown, and in which colours."""
    html.Div("Show", classes="text-subtitle-2 mt-3")
    with html.Div(style="display:grid;grid-template-columns:1fr 1fr"):
        for name, title in LAYERS.items():
            v.VCheckbox(
                label=title,
                v_model=(f"scan_show_{name}",),
                disabled=(f"!scan_has.{name}",),
                id=f"scan-show-{name}",
                **DENSE,
            )
    v.VSelect(
        label="Colours",
        v_model=("scan_mode",),
        items=("scan_modes",),
        id="scan-mode",
        classes="mt-2",
        **DENSE,
    )


def _comparing() -> None:
    """Lay out the choice of a second model."""
    html.Div("Compare with", classes="text-subtitle-2 mt-3")
    v.VAutocomplete(
        v_model=("scan_against",),
        items=("scan_others", []),
        update_modelValue="trigger('scan_compare', [$event])",
        id="scan-against",
        **DENSE,
    )
    with (
        html.Div(v_if="scan_against != 'nothing'"),
        v.VBtnToggle(
            v_model=("scan_together",), mandatory=True, density="compact", classes="mt-2", id="scan-together"
        ),
    ):
        v.VBtn("One over the other", value="over", size="small", id="scan-over")
        v.VBtn("Side by side", value="side", size="small", id="scan-side")
    v.VCheckbox(
        label="Move the roots together first",
        v_model=("scan_aligned",),
        update_modelValue="trigger('scan_align', [$event])",
        id="scan-aligned",
        **DENSE,
    )


def _options() -> None:
    """Lay out the options, stage by stage."""
    html.Div("Options", classes="text-subtitle-2 mt-3")
    html.Div(
        "A change reconstructs again, from the stage that it changes.",
        v_if="scan_cloud",
        classes="text-caption",
    )
    html.Div(
        "There are no points to reconstruct from.", v_if="scan_shown && !scan_cloud", classes="text-caption"
    )
    with v.VExpansionPanels(variant="accordion", multiple=True, id="scan-options", disabled=("!scan_cloud",)):
        for table in TABLES:
            with v.VExpansionPanel(id=f"scan-table-{table}"):
                v.VExpansionPanelTitle(TITLES[table])
                with v.VExpansionPanelText():
                    if table == "skeleton":
                        v.VCheckbox(label="Options of all methods", v_model=("scan_all_methods",), **DENSE)
                    for field in FIELDS:
                        if field.table == table:
                            _option(field)


def _option(field: Field) -> None:
    """Lay out one option: its value, its slider where it has a range, and what it is."""
    more: dict[str, Any] = {}
    if field.methods:
        more["v_if"] = f"scan_all_methods || {list(field.methods)}.includes(scan_method)"
    with html.Div(id=f"scan-set-{field.table}-{field.name}", classes="mb-3", title=field.key, **more):
        if field.kind == "choice":
            _choice(field)
        elif field.kind == "flag":
            v.VSwitch(
                label=field.label,
                v_model=(field.state,),
                color="primary",
                update_modelValue=f"trigger('scan_set', ['{field.key}', $event])",
                **DENSE,
            )
        else:
            _number(field)
        html.Div(field.sentence, classes="text-caption text-medium-emphasis", style="line-height:1.2")


def _choice(field: Field) -> None:
    v.VSelect(
        label=field.label,
        v_model=(field.state,),
        items=(f"{field.state}_choices", list(field.choices)),
        update_modelValue=f"trigger('scan_set', ['{field.key}', $event])",
        **DENSE,
    )


def _number(field: Field) -> None:
    v.VTextField(
        label=field.label,
        v_model=(field.state,),
        suffix=field.unit,
        change=f"trigger('scan_set', ['{field.key}', {field.state}])",
        **DENSE,
    )
    if field.low is None or field.high is None:
        return
    share = f"Math.max(0, (+{field.state} - {field.low!r}) / {field.high - field.low!r})"
    v.VSlider(
        model_value=(f"Math.round({STEPS} * Math.pow({share}, {1 / field.bend!r}))",),
        min=0,
        max=STEPS,
        step=1,
        update_modelValue=f"trigger('scan_slide', ['{field.key}', $event])",
        end="trigger('scan_settle')",
        aria_label=field.label,
        __properties=[("aria_label", "aria-label")],
        **DENSE,
    )


def main(tab: ScanTab) -> Any:
    """Lay out picture, legends and report; return the view."""
    with html.Div(style="position:absolute;inset:0;display:flex"):
        with html.Div(style="position:relative;flex:1;min-width:0"):
            view = View(tab.shell, tab.scene.plotter, style="height:100%;width:100%")
            html.Div(
                "Open a cloud, the folder of a run, or a model: on the left, or on the command line.",
                v_if="!scan_shown && !scan_busy",
                style="position:absolute;top:45%;width:100%;text-align:center",
            )
            _progress(tab)
            _legends()
            _line()
        with html.Div(
            v_if="scan_shown",
            id="scan-report",
            style=f"width:{PANEL_PX}px;overflow-y:auto;background:white;flex:none",
            classes="px-3 py-2 text-body-2",
        ):
            _report()
    return view


def _progress(tab: ScanTab) -> None:
    """Lay out how far the work is."""
    with html.Div(
        v_if="scan_busy || scan_doing",
        classes="d-flex align-center px-2 py-1",
        style=f"position:absolute;top:8px;left:8px;{PALE}",
    ):
        v.VProgressLinear(v_if="scan_busy", model_value=("scan_progress",), style="width:160px", height=8)
        html.Span("{{ scan_doing }}", id="scan-doing", classes="mx-3 text-caption")
        v.VBtn("Stop", v_if="scan_busy", click=tab.stop, id="scan-stop", size="small", color="warning")


def _legends() -> None:
    """Lay out what the colours mean."""
    with (
        html.Div(
            v_if="scan_legends.length",
            id="scan-legends",
            style=f"position:absolute;bottom:34px;left:8px;width:300px;{PALE}",
            classes="px-2 py-1 text-caption",
        ),
        html.Div(v_for="(legend, k) in scan_legends", key=("k",), classes="mb-1"),
    ):
        html.Div("{{ legend.title }}")
        html.Div(v_if="legend.ramp", style=("`height:12px;background:${legend.ramp}`",))
        with html.Div(v_if="legend.ramp", classes="d-flex justify-space-between"):
            html.Span(
                "{{ tick }}{{ i == legend.ticks.length - 1 ? ' ' + legend.unit : '' }}",
                v_for="(tick, i) in legend.ticks",
                key=("i",),
            )
        with html.Div(v_for="each in legend.classes", key=("each[1]",), classes="d-flex align-center"):
            html.Span(
                style=(
                    "`display:inline-block;width:12px;height:12px;margin-right:6px;background:${each[0]}`",
                )
            )
            html.Span("{{ each[1] }}")


def _line() -> None:
    """Lay out the line below the picture."""
    html.Div(
        "{{ scan_line }}",
        id="scan-line",
        style=f"position:absolute;bottom:0;left:0;right:0;{PALE}",
        classes="px-3 py-1 text-caption",
        data_shown=("scan_shown",),
        __properties=[("data_shown", "data-shown")],
    )


def _report() -> None:
    """Lay out the report, and the comparison where there is one."""
    html.Div("{{ scan_stem }}", classes="text-subtitle-1 font-weight-bold")
    html.Div("{{ scan_from }}", classes="text-caption mb-1")
    html.Div("{{ note }}", v_for="note in scan_notes", key=("note",), classes="text-caption text-warning")
    with html.Div(classes="my-1", id="scan-flags"), html.Div(v_for="flag in scan_flags", key=("flag.name",)):
        v.VChip("{{ flag.name }}", size="small", color="warning", classes="mr-1")
        html.Span("{{ flag.says }}", classes="text-caption")
    with (
        html.Table(style="width:100%;border-collapse:collapse", classes="text-caption"),
        html.Tr(v_for="row in scan_rows", key=("row[0]",), style="border-bottom:1px solid #eee"),
    ):
        html.Td("{{ row[1] }}", style="vertical-align:top;color:#555")
        html.Td("{{ row[2] }}", id=("`scan-figure-${row[0]}`",), style="text-align:right")
    with html.Div(v_if="scan_tables.length", id="scan-tables", classes="mt-3"):
        html.Div("Compared", classes="text-subtitle-2")
        html.Div("A: {{ scan_stem }}, as shown", classes="text-caption")
        html.Div("B: {{ scan_other }}", classes="text-caption", id="scan-other")
        with (
            html.Div(v_for="table in scan_tables", key=("table.name",), style="overflow-x:auto"),
            html.Table(style="border-collapse:collapse;white-space:nowrap", classes="text-caption mt-2"),
        ):
            with html.Tr():
                html.Th("{{ table.name }}", style="text-align:left")
                html.Th(
                    "{{ head }}",
                    v_for="head in table.head",
                    key=("head",),
                    style="text-align:right;padding-left:8px",
                )
            with html.Tr(v_for="row in table.rows", key=("row[0]",), style="border-top:1px solid #eee"):
                html.Td(
                    "{{ cell }}",
                    v_for="(cell, i) in row",
                    key=("i",),
                    style=("i ? 'text-align:right;padding-left:8px' : 'color:#555'",),
                )
