"""What is opened and downloaded, and what is not."""

import io
import zipfile
from dataclasses import replace

import pytest

from pipeline.errors import InputFormatError, InputMissingError, PipelineError, UsageError
from pipeline.exchange import FORMATS, read_model, write
from pipeline.growth import GrowthOptions
from pipeline.jobs.simulation import bud
from pipeline.studio.folders import Folders
from pipeline.studio.years.files import (
    command_of,
    holds_events,
    is_model,
    models_in,
    open_start,
    packed,
    read_bounded,
    read_growth,
)
from pipeline.studio.years.plan import Plan, Start
from pipeline.toml import to_toml


@pytest.mark.parametrize("name", FORMATS)
def test_a_tree_is_packed_in_every_format(standing, name):
    file, content = packed(standing, name, "oak-year003")
    assert content
    if name == "obj":
        assert file == "oak-year003.obj.zip"
        assert zipfile.ZipFile(io.BytesIO(content)).testzip() is None
    else:
        assert file == f"oak-year003{FORMATS[name].suffix}"


def test_a_bud_is_no_download_and_a_format_has_a_name(standing):
    with pytest.raises(UsageError, match="choose a later year"):
        packed(bud(), "npz", "bud")
    with pytest.raises(UsageError, match="do you mean lsjson"):
        packed(standing, "lsjsn", "oak")


def test_models_in_the_folders_are_listed_and_opened(standing, tmp_path):
    (tmp_path / "run" / "oak").mkdir(parents=True)
    write(standing, tmp_path / "run" / "oak" / "oak.ls.json")
    write(standing, tmp_path / "run" / "oak.npz")
    (tmp_path / "run" / "cloud.laz").touch()
    folders = Folders([tmp_path / "run"])
    assert models_in(folders) == [str(tmp_path / "run" / name) for name in ("oak.npz", "oak/oak.ls.json")]
    start = open_start(tmp_path / "run" / "oak.npz", folders)
    assert (start.name, len(start.tree)) == ("oak", len(standing))


def test_nothing_outside_the_folders_is_opened(standing_file, tmp_path):
    (tmp_path / "link.npz").symlink_to(standing_file)
    folders = Folders([tmp_path])
    for path in (standing_file, tmp_path / "link.npz"):
        with pytest.raises(UsageError, match="lies outside the folders"):
            open_start(path, folders)
    assert models_in(folders) == []
    with pytest.raises(UsageError, match="lies outside"):
        read_bounded(standing_file, folders)


def test_what_is_no_tree_is_a_sentence(tmp_path):
    (tmp_path / "odd.npz").write_bytes(b"nothing")
    folders = Folders([tmp_path])
    with pytest.raises(PipelineError, match=r"odd\.npz"):
        open_start(tmp_path / "odd.npz", folders)
    with pytest.raises(InputMissingError, match="no such file; choose another"):
        open_start(tmp_path / "gone.npz", folders)
    write(bud(), tmp_path / "one.npz")
    with pytest.raises(InputFormatError, match="a tree of one node"):
        open_start(tmp_path / "one.npz", folders)


def test_files_are_told_apart(standing_file, samples, tmp_path):
    (tmp_path / "events.toml").write_text('[[event]]\nyear = 1\noperation = "thin"')
    (tmp_path / "tree.toml").write_text("seed = 3")
    (tmp_path / "broken.toml").write_text("[[event]")
    assert is_model(standing_file)
    assert not is_model(samples / "oak.laz")
    assert not is_model(samples)
    assert [holds_events(tmp_path / f"{name}.toml") for name in ("events", "tree", "broken")] == [
        True,
        False,
        False,
    ]


def test_parameters_come_back_and_others_are_explained():
    options = GrowthOptions(alpha=2.75, light="space")
    assert read_growth(to_toml(options).encode(), "x.toml") == options
    for text, says in (
        (b"alhpa = 3", "do you mean alpha"),
        (b"alpha", "is no TOML"),
        (b"#" * 1_000_001, "choose"),
    ):
        with pytest.raises(InputFormatError, match=f"odd.toml: .*{says}"):
            read_growth(text, "odd.toml")


def test_the_command_names_the_files_that_are_saved(standing, standing_file, event):
    plan = Plan(
        Start("oak", standing, standing_file), years=3, species="apple", programmes=(event("thin", year=1),)
    )
    assert command_of(plan, "oak-0") == (
        f"treepipe simulate {standing_file} --years 3 --seed 0 --species apple --params oak-0.growth.toml "
        "--events oak-0.events.toml --every 1 -o years"
    )
    assert "oak-0-start.npz" in command_of(replace(plan, start=Start("oak", standing)), "oak-0")
    assert read_model(standing_file)
