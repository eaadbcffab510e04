"""What stands in the middle of the Scan tab and on its right: the picture with its legends, the report."""

from __future__ import annotations

from typing import Any

from trame.widgets import html
from trame.widgets import vuetify3 as v

from pipeline.studio.scan.actions import Actions
from pipeline.studio.view import View

PANEL_PX = 330
PALE = "background:rgba(255,255,255,.85)"


def main(tab: Actions) -> Any:
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


def _progress(tab: Actions) -> None:
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
