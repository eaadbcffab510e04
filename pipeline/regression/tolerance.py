"""How far each figure may be off: defaults, and what a file beside the references says."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from pipeline.errors import InputFormatError

FILE = "tolerances.toml"

Share = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class Tolerance(BaseModel):
    """The larger one of an absolute and a relative deviation is let pass."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    absolute: Share = 0.0
    relative: Share = 0.0

    def room(self, reference: float) -> float:
        """Return how far a figure may be from `reference`."""
        return max(self.absolute, self.relative * abs(reference))


DEFAULTS: Mapping[str, Tolerance] = {
    "height_m": Tolerance(absolute=0.02, relative=0.002),
    "dbh_cm": Tolerance(absolute=0.1, relative=0.01),
    "volume_l": Tolerance(absolute=0.5, relative=0.03),
    "stem_volume_l": Tolerance(absolute=0.5, relative=0.03),
    "branch_volume_l": Tolerance(absolute=0.5, relative=0.04),
    "length_m": Tolerance(absolute=0.1, relative=0.02),
    "crown_diameter_m": Tolerance(absolute=0.05, relative=0.01),
    "branches": Tolerance(absolute=2, relative=0.04),
    "nodes": Tolerance(absolute=5, relative=0.05),
    "max_order": Tolerance(absolute=1),
    "points_used": Tolerance(absolute=5, relative=0.005),
    "surface_mm.mean": Tolerance(absolute=0.5, relative=0.05),
    "file_volume_l": Tolerance(absolute=0.5, relative=0.03),
    "file_length_m": Tolerance(absolute=0.1, relative=0.02),
    "moved_median_mm": Tolerance(absolute=3),
    "moved_p95_mm": Tolerance(absolute=40),
}
"""Measures that are checked: keys of report.json; volume and length of the model as its file has it,
and how far its axes have moved, both ways.

Not bytes, because processors differ; a hair's breadth can change which of two equal twigs is kept.
"""


class _File(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    default: dict[str, Tolerance] = Field(default_factory=dict)
    trees: dict[str, dict[str, Tolerance]] = Field(default_factory=dict)


class Tolerances(NamedTuple):
    """Tolerances of all trees, and those of some that differ."""

    default: Mapping[str, Tolerance] = DEFAULTS
    trees: Mapping[str, Mapping[str, Tolerance]] = {}

    def of(self, name: str) -> dict[str, Tolerance]:
        """Return the tolerance of every measure for one tree."""
        return {**self.default, **self.trees.get(name, {})}

    @classmethod
    def read(cls, folder: Path) -> Tolerances:
        """Read the tolerances of a folder of references; where it has none, the defaults.

        Raises
        ------
        InputFormatError
            If the file is no TOML, or names what is not measured.
        """
        path = folder / FILE
        if not path.is_file():
            return cls()
        try:
            told = _File.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
        except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            msg = f"{path}: cannot be read as TOML ({error}); mend it"
            raise InputFormatError(msg) from error
        except ValidationError as error:
            first = error.errors(include_url=False, include_input=False)[0]
            msg = (
                f"{path}: {'.'.join(map(str, first['loc']))}: {first['msg']}; mend it as docs/regress.md says"
            )
            raise InputFormatError(msg) from None
        for measures in (told.default, *told.trees.values()):
            for measure in set(measures) - set(DEFAULTS):
                msg = f"{path}: {measure!r} is not measured; known: {', '.join(DEFAULTS)}"
                raise InputFormatError(msg)
        return cls({**DEFAULTS, **told.default}, told.trees)
