"""Every stage's options in one value: read from TOML, written as TOML with units and ranges."""

from __future__ import annotations

import difflib
import hashlib
import json
import os
import tomllib
from collections.abc import Iterable, Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError
from pydantic.fields import FieldInfo

from pipeline.airborne.grid import GridOptions
from pipeline.airborne.modelling import ModelOptions
from pipeline.airborne.segmentation import SegmentationOptions
from pipeline.choosing import value_of
from pipeline.cityjson import CityjsonOptions
from pipeline.cloud import CleanOptions
from pipeline.cylinders import CylinderOptions
from pipeline.errors import UsageError
from pipeline.lsystem import LstringOptions, LsystemOptions
from pipeline.mesh import MeshOptions
from pipeline.options import Options
from pipeline.skeleton import SkeletonOptions
from pipeline.toml import allowed, to_toml
from pipeline.view import PictureOptions

HEADER = "# Every key of treepipe with its default; a file of your own needs only the keys that differ."


class Config(Options):
    """All options of a run, a table per stage."""

    clean: CleanOptions = Field(CleanOptions(), description="dropping what is not the tree, and thinning")
    skeleton: SkeletonOptions = Field(SkeletonOptions(), description="from points to a rooted graph")
    cylinders: CylinderOptions = Field(CylinderOptions(), description="radii and the breast-height diameter")
    lsystem: LsystemOptions = Field(LsystemOptions(), description="how the .ls.json is written")
    lstring: LstringOptions = Field(LstringOptions(), description="how the .lstring is written")
    cityjson: CityjsonOptions = Field(CityjsonOptions(), description="how the .city.json is written")
    mesh: MeshOptions = Field(MeshOptions(), description="how surfaces are drawn: .mesh.ply, .obj, .glb")
    picture: PictureOptions = Field(PictureOptions(), description="how the .png is drawn")
    airborne: SegmentationOptions = Field(
        SegmentationOptions(), description="which airborne points are vegetation, and whose"
    )
    airborne_models: ModelOptions = Field(ModelOptions(), description="models of trees seen from the air")
    batch: GridOptions = Field(GridOptions(), description="how airborne tiles are cut into cells")

    @property
    def config_hash(self) -> str:
        """SHA-256 of the options as canonical JSON: equal settings have equal hashes."""
        text = json.dumps(self.model_dump(mode="json"), sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()

    def to_toml(self) -> str:
        """Write every key with its unit and range as a comment; `read_config` reads it back."""
        return f"{HEADER}\n{to_toml(self)}"

    def with_settings(self, settings: Iterable[str]) -> Config:
        """Return a config with some keys replaced.

        Parameters
        ----------
        settings : iterable of str
            ``"clean.voxel_m=0.01"`` and the like; the value as in TOML, texts also without quotes.

        Raises
        ------
        UsageError
            If a setting has no ``=``, its key is unknown or its value out of range.
        """
        merged = self.model_dump()
        for setting in settings:
            key, equals, text = (part.strip() for part in setting.partition("="))
            if not equals or not key:
                msg = f"--set {setting}: is not KEY=VALUE; write for example --set picture.point_px=3"
                raise UsageError(msg)
            _put(merged, key.split("."), value_of(text))
        return _checked(merged, "--set")


def read_config(
    path: str | os.PathLike[str] | None = None, *, preset: str | None = None, settings: Iterable[str] = ()
) -> Config:
    """Gather a config: the defaults, then a preset, then a file, then single settings.

    Parameters
    ----------
    path : path-like, optional
        A TOML file with any of the keys.
    preset : str, optional
        One of `preset_names`.
    settings : iterable of str
        As for `Config.with_settings`.

    Raises
    ------
    UsageError
        If the file is missing or no TOML, the preset unknown, a key unknown or a value out of range.
    """
    merged: dict[str, Any] = {}
    if preset is not None:
        _merge(merged, _checked_tables(_preset(preset), f"preset {preset}"))
    if path is not None:
        _merge(merged, _checked_tables(_file(Path(path)), str(path)))
    return _checked(merged, "config").with_settings(settings)


def preset_names() -> list[str]:
    """Return the names of the presets that ship with treepipe."""
    return sorted(entry.name[:-5] for entry in _presets().iterdir() if entry.name.endswith(".toml"))


def _presets() -> Traversable:
    """Return the folder configs/: inside the package once installed, beside it in a source tree."""
    inside = files("pipeline") / "configs"
    return inside if inside.is_dir() else Path(__file__).resolve().parent.parent / "configs"


def _preset(name: str) -> dict[str, Any]:
    if name not in preset_names():
        msg = f"unknown preset {name!r}{_nearest(name, preset_names())}; known: {', '.join(preset_names())}"
        raise UsageError(msg)
    return tomllib.loads((_presets() / f"{name}.toml").read_text(encoding="utf-8"))


def _file(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        msg = f"{path}: no config can be read there ({error.strerror}); check the name given to --config"
        raise UsageError(msg) from error
    except ValueError as error:  # TOMLDecodeError and UnicodeDecodeError
        msg = f"{path}: is not TOML ({error}); `treepipe config show` prints a config to start from"
        raise UsageError(msg) from error


def _put(tables: dict[str, Any], keys: list[str], value: Any) -> None:
    """Set a nested key; a table that is not there is made, for the check to name."""
    for key in keys[:-1]:
        inner = tables.setdefault(key, {})
        if not isinstance(inner, dict):
            inner = tables[key] = {}
        tables = inner
    tables[keys[-1]] = value


def _merge(below: dict[str, Any], above: Mapping[str, Any]) -> None:
    """Lay the keys of `above` over those of `below`."""
    for key, value in above.items():
        if isinstance(value, dict) and isinstance(below.get(key), dict):
            _merge(below[key], value)
        else:
            below[key] = value


def _checked_tables(tables: dict[str, Any], where: str) -> dict[str, Any]:
    """Check one source by itself, so that an error names the file that holds it."""
    _checked(tables, where)
    return tables


def _checked(tables: Mapping[str, Any], where: str) -> Config:
    try:
        return Config.model_validate(tables)
    except ValidationError as error:
        raise UsageError(_explained(error, where)) from error


def _explained(error: ValidationError, where: str) -> str:
    """Say in one sentence what is wrong with the first key, and what would be right."""
    first = error.errors(include_url=False)[0]
    keys = [str(part) for part in first["loc"]]
    key = ".".join(keys)
    if first["type"] == "extra_forbidden":
        meant = _nearest(key, known_keys(Config))
        return f"{where}: unknown key {key}{meant}; `treepipe config show` lists all keys"
    if first["type"] == "model_type":
        return f"{where}: {key} is a table of keys, not {first['input']!r}; write {key}.KEY = VALUE"
    field = _field(keys)
    if first["type"] == "value_error" or field is None:  # a rule of several keys says itself what is wrong
        return f"{where}: {key}: {first['msg'].removeprefix('Value error, ')}"
    return f"{where}: {key} = {first['input']!r} is not allowed; give {allowed(field)}"


def _field(keys: Iterable[str]) -> FieldInfo | None:
    """Return the field that a path of keys leads to; places in a list belong to the list's field."""
    owner: Any = Config
    field = None
    for key in keys:
        if not hasattr(owner, "model_fields"):
            break
        field = owner.model_fields.get(key)
        owner = field.annotation if field else None
    return field


def known_keys(options: type[Options], prefix: str = "") -> list[str]:
    """Return all dotted keys, and the tables themselves."""
    keys = []
    for name, field in options.model_fields.items():
        keys.append(prefix + name)
        if isinstance(field.annotation, type) and issubclass(field.annotation, Options):
            keys += known_keys(field.annotation, f"{prefix}{name}.")
    return keys


def _nearest(name: str, known: Iterable[str]) -> str:
    """Return a hint at the key meant, by its whole name or, failing that, by its last part."""
    by_leaf = {key.rpartition(".")[2]: key for key in known}
    near = difflib.get_close_matches(name, list(known), n=1) or [
        by_leaf[leaf] for leaf in difflib.get_close_matches(name.rpartition(".")[2], list(by_leaf), n=1)
    ]
    return f", do you mean {near[0]}?" if near else ""
