"""What stands in the bar and on the left of the Scan tab: files, layers, options."""

from __future__ import annotations

from typing import Any

from trame.widgets import html
from trame.widgets import vuetify3 as v

from pipeline.exchange import FORMATS
from pipeline.studio.scan.actions import Actions
from pipeline.studio.scan.fields import FIELDS, STEPS, TABLES, Field

SMALL = {"size": "small", "variant": "tonal", "classes": "mx-1"}
DENSE = {"density": "compact", "hide_details": True}
ZIPPED = ("obj",)
"""Formats of several files."""

LAYERS = {
    "cloud": "Cloud",
    "leaves": "Leaves",
    "rest": "Points left out",
    "axes": "Skeleton",
    "wood": "Cylinders",
}
TITLES = {"clean": "Cleaning", "skeleton": "Skeleton", "cylinders": "Cylinders"}


def buttons(tab: Actions) -> None:
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
    html.Div("With them this command makes the model that is shown:", classes="text-caption")
    html.Code("{{ scan_command }}", id="scan-command", classes="text-caption d-block mb-3")
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


def side(tab: Actions) -> None:
    """Lay out the drawer."""
    with html.Div(classes="px-3 py-2"):
        with html.Div(classes="d-flex align-center"):
            v.VAutocomplete(
                label="Open cloud, run, model",
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
        _beside()
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


def _beside() -> None:
    """Lay out what is known of the tree beside its points."""
    html.Div("Known of the tree", classes="text-subtitle-2 mt-3")
    v.VAutocomplete(
        label="Points of the ground, if apart",
        v_model=("scan_ground",),
        items=("scan_grounds", []),
        update_modelValue="trigger('scan_know', ['ground', $event])",
        disabled=("!scan_cloud",),
        id="scan-ground",
        **DENSE,
    )
    for name, label in (("crs", "EPSG:N, if the cloud names none"), ("species", "Species")):
        v.VTextField(
            label=label,
            v_model=(f"scan_{name}",),
            change=f"trigger('scan_know', ['{name}', scan_{name}])",
            disabled=("!scan_cloud",),
            id=f"scan-{name}",
            classes="mt-2",
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
