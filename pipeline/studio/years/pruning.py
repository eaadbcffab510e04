"""What stands in the Years tab of pruning: the form of an operation, the list of events, what is picked."""

from __future__ import annotations

from typing import Any

from trame.widgets import html
from trame.widgets import vuetify3 as v

from pipeline.studio.years.actions import Actions
from pipeline.studio.years.styles import COMPACT, OVER


def form(tab: Actions) -> None:
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


def events(tab: Actions) -> None:
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


def branch(tab: Actions) -> None:
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
