"""Config: TOML in and out, presets, single settings, and errors that name the remedy."""

from __future__ import annotations

import re
import tomllib
from contextlib import suppress
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.config import Config, known_keys, preset_names, read_config
from pipeline.errors import UsageError
from pipeline.options import Options

CONFIGS = Path(__file__).resolve().parent.parent / "configs"


def test_default_toml_is_the_code():
    assert (CONFIGS / "default.toml").read_text(encoding="utf-8") == Config().to_toml()


def test_toml_comes_back():
    changed = Config().with_settings(
        ["clean.voxel_m=0.02", 'skeleton.method="mst"', "cityjson.skeleton=false"]
    )
    assert Config.model_validate(tomllib.loads(changed.to_toml())) == changed != Config()


def test_every_key_is_described():
    def described(options: type[Options]) -> bool:
        return all(field.description for field in options.model_fields.values())

    assert described(Config)
    assert all(described(type(table)) for table in Config().__dict__.values())


def test_every_line_of_the_toml_has_its_range():
    lines = Config().to_toml().splitlines()
    for before, line in pairwise(lines):
        if " = " in line and not line.startswith("#"):
            assert re.search(r"; (a |true or false|one of )", before), line


@pytest.mark.parametrize("name", ["default", "airborne", "terrestrial", "mobile"])
def test_presets_are_valid(name):
    assert isinstance(read_config(preset=name), Config)
    assert name in preset_names()


def test_file_lies_over_preset_and_settings_over_both(tmp_path):
    mine = tmp_path / "mine.toml"
    mine.write_text("[clean]\nclump_share = 0.25\n[picture]\npoint_px = 3\n")
    config = read_config(mine, preset="airborne", settings=["picture.point_px=4"])
    assert config.clean.clump_share == 0.25
    assert config.clean.voxel_m == read_config(preset="airborne").clean.voxel_m != Config().clean.voxel_m
    assert config.picture.point_px == 4


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("clean.voxle_m=1", ["clean.voxle_m", "do you mean clean.voxel_m?"]),
        ("voxel_m=1", ["voxel_m", "do you mean clean.voxel_m?"]),
        ("skeletn.graph=knn", ["do you mean skeleton"]),
        ("clean.voxel_m=5", ["clean.voxel_m = 5", "<= 1.0"]),
        ("clean.voxel_m=nan", ["clean.voxel_m", "a number"]),
        ("skeleton.graph=delauny", ['"delaunay"', "'delauny'"]),
        ("clean=3", ["clean is a table"]),
        ("cityjson.lods=[7]", ["cityjson.lods", "a list of one of"]),
        ("clean.voxel_m.deep=3", ["clean.voxel_m", "a number"]),
        ("clean.voxel_m", ["KEY=VALUE"]),
        ("=3", ["KEY=VALUE"]),
    ],
)
def test_wrong_settings_name_the_remedy(setting, words):
    with pytest.raises(UsageError) as caught:
        Config().with_settings([setting])
    for word in words:
        assert word in str(caught.value)


def test_texts_need_no_quotes():
    assert Config().with_settings(["skeleton.graph=knn"]).skeleton.graph == "knn"


def test_missing_file_is_named(tmp_path):
    with pytest.raises(UsageError, match=r"absent\.toml.*--config"):
        read_config(tmp_path / "absent.toml")


def test_damaged_file_is_named(tmp_path):
    bad = tmp_path / "bad.toml"
    bad.write_text("[clean\n")
    with pytest.raises(UsageError, match=r"bad\.toml: is not TOML.*config show"):
        read_config(bad)


def test_unknown_key_names_its_file(tmp_path):
    bad = tmp_path / "bad.toml"
    bad.write_text("[clean]\nvoxel = 1\n")
    with pytest.raises(
        UsageError, match=r"bad\.toml: unknown key clean\.voxel, do you mean clean\.voxel_m\?"
    ):
        read_config(bad)


def test_unknown_preset_lists_the_known():
    with pytest.raises(UsageError, match=r"do you mean airborne\?.*airborne, default, mobile, terrestrial"):
        read_config(preset="airbourne")


def test_hash_follows_the_settings():
    changed = Config().with_settings(["clean.voxel_m=0.02"])
    assert Config().config_hash == Config().config_hash != changed.config_hash
    assert re.fullmatch(r"[0-9a-f]{64}", changed.config_hash)


@given(st.text(max_size=30))
def test_any_setting_is_used_or_refused(text):
    with suppress(UsageError):
        assert isinstance(Config().with_settings([text]), Config)


def test_known_keys_have_tables_and_leaves():
    assert {"clean", "clean.voxel_m", "picture.width_px"} <= set(known_keys(Config))
