"""Options of a reconstruction as fields of a form: ranges, units and sentences as the options have them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, get_args, get_origin

import annotated_types
from pydantic.fields import FieldInfo

from pipeline.choosing import chosen, value_of
from pipeline.cloud import CleanOptions
from pipeline.config import Config
from pipeline.cylinders import CylinderOptions
from pipeline.errors import UsageError
from pipeline.options import Options
from pipeline.skeleton import SkeletonOptions
from pipeline.skeleton.geodesic import GeodesicOptions
from pipeline.skeleton.greedy import GreedyOptions
from pipeline.skeleton.minimal_length import MinimalOptions
from pipeline.skeleton.mst import MstOptions
from pipeline.skeleton.space_colonization import SpaceColonizationOptions
from pipeline.toml import allowed

Kind = Literal["number", "whole", "flag", "choice", "list"]

TABLES: Mapping[str, type[Options]] = {
    "clean": CleanOptions,
    "skeleton": SkeletonOptions,
    "cylinders": CylinderOptions,
}
"""The tables of a config that a reconstruction reads, in the order of its stages."""

READ_BY: Mapping[str, type[Options]] = {
    "geodesic": GeodesicOptions,
    "greedy": GreedyOptions,
    "mst": MstOptions,
    "space-colonization": SpaceColonizationOptions,
    "minimal-length": MinimalOptions,
}
"""Which options of the skeleton each of its methods reads."""

UNITS = {"_m": "m", "_deg": "°", "_sd": "standard deviations"}
"""Units by the end of a name; the other values are counts, shares and factors."""

MIDDLE = 0.4
"""Where on its slider a default stands, so that small values have room: of 0 to 1."""

MOST_BENT = 6.0
DIGITS = 3
STEPS = 1000


class Field(NamedTuple):
    """One option on the page.

    Attributes
    ----------
    table, name, label : str
    kind : {"number", "whole", "flag", "choice", "list"}
    sentence : str
        What it is, with its range.
    default : object
    unit : str
        Nothing for counts, shares and factors.
    low, high : float or None
        Ends of the slider; there is none where one of them is not known.
    bend : float
        The slider at t of 0 to 1 means ``low + (high - low) * t ** bend``.
    choices : tuple of str
        The values of a choice.
    methods : tuple of str
        Methods of the skeleton that read it; empty where all do.
    """

    table: str
    name: str
    label: str
    kind: Kind
    sentence: str
    default: Any
    unit: str = ""
    low: float | None = None
    high: float | None = None
    bend: float = 1.0
    choices: tuple[str, ...] = ()
    methods: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """Name with its table, as in a config."""
        return f"{self.table}.{self.name}"

    @property
    def state(self) -> str:
        """Name of its value on the page."""
        return f"scan_{self.table}_{self.name}"

    @property
    def slides(self) -> bool:
        """Whether it has a slider."""
        return self.low is not None and self.high is not None

    def value_at(self, step: float) -> float:
        """Return the value of the slider at a step of 0 to `STEPS`.

        Values keep three digits; whole numbers are whole.
        """
        if self.low is None or self.high is None:
            msg = f"{self.key}: has no slider; type the value"
            raise UsageError(msg)
        share = min(max(step / STEPS, 0.0), 1.0)
        value = self.low + (self.high - self.low) * share**self.bend
        value = round(value) if self.kind == "whole" else float(f"{value:.{DIGITS}g}")
        return min(max(value, self.low), self.high)

    def taken(self, given: Any) -> Any:
        """Return what a form gives as the option wants it; texts are read as TOML reads values."""
        if self.kind == "list":
            return value_of(f"[{str(given).strip().strip('[]')}]")
        if self.kind == "whole" and isinstance(given, float) and given.is_integer():
            return int(given)
        if self.kind in {"number", "whole"} and isinstance(given, str):
            return value_of(given.strip().replace(",", ".") or "nothing")
        return given

    def shown(self, value: Any) -> Any:
        """Return the value of an option as the form shows it."""
        return ", ".join(f"{part:g}" for part in value) if self.kind == "list" else value


def _field(table: str, name: str, field: FieldInfo) -> Field:
    low, high = _bounds(field)
    kind = _kind(field)
    methods = tuple(method for method, options in READ_BY.items() if name in options.model_fields)
    made = Field(
        table,
        name,
        label=_label(name),
        kind=kind,
        sentence=f"{field.description}; {allowed(field)}",
        default=field.default,
        unit=next((unit for end, unit in UNITS.items() if name.endswith(end)), ""),
        choices=get_args(field.annotation) if kind == "choice" else (),
        methods=methods if table == "skeleton" else (),
    )
    if kind not in {"number", "whole"} or low is None or high is None:
        return made
    return made._replace(low=low, high=high, bend=_bend(low, high, float(field.default)))


def _label(name: str) -> str:
    for end in UNITS:
        name = name.removesuffix(end)
    return name.replace("_", " ").capitalize()


def _kind(field: FieldInfo) -> Kind:
    if get_origin(field.annotation) is Literal:
        return "choice"
    kinds: dict[Any, Kind] = {bool: "flag", int: "whole", float: "number"}
    return kinds.get(field.annotation, "list")


def _bounds(field: FieldInfo) -> tuple[float | None, float | None]:
    """Return the ends of a slider; above a bound that is left out it begins at a twentieth of the default."""
    low = high = None
    for bound in field.metadata:
        if isinstance(bound, annotated_types.Ge):
            low = _plain(bound.ge)
        elif isinstance(bound, annotated_types.Gt):
            low = float(f"{_plain(bound.gt) + float(field.default) / 20:.{DIGITS}g}")
        elif isinstance(bound, annotated_types.Le):
            high = _plain(bound.le)
    return low, high


def _plain(bound: Any) -> float:
    return float(bound)


def _bend(low: float, high: float, default: float) -> float:
    """Return the bend that puts the default near `MIDDLE`; never one that cramps large values."""
    share = (default - low) / (high - low)
    return min(max(math.log(share) / math.log(MIDDLE), 1.0), MOST_BENT) if 0 < share < 1 else 1.0


FIELDS: tuple[Field, ...] = tuple(
    _field(table, name, field)
    for table, options in TABLES.items()
    for name, field in sorted(options.model_fields.items(), key=lambda item: item[0] != "method")
)
"""All of them, by stage; the method of the skeleton stands first in its table."""

_BY_KEY = {field.key: field for field in FIELDS}


def changed(config: Config, key: str, given: Any) -> Config:
    """Return a config with another value.

    Parameters
    ----------
    config : Config
    key : str
        Of `FIELDS`.
    given : object
        As a form gives it: lists, and numbers that were typed, may be texts.

    Raises
    ------
    UsageError
        If the value is not allowed, with what is.
    """
    if key not in _BY_KEY:
        msg = f"{key}: is no option of a reconstruction; `treepipe config show` lists all keys"
        raise UsageError(msg)
    field = _BY_KEY[key]
    before: Options = getattr(config, field.table)
    after = chosen(TABLES[field.table], {**before.model_dump(), field.name: field.taken(given)})
    return config.model_copy(update={field.table: after})


def reset(config: Config, start: Config) -> Config:
    """Return a config with the reconstruction's tables of another one."""
    return config.model_copy(update={table: getattr(start, table) for table in TABLES})


def values_of(config: Config) -> dict[str, Any]:
    """Return the values of all fields as the form shows them, by the name of their state."""
    return {field.state: field.shown(getattr(getattr(config, field.table), field.name)) for field in FIELDS}
