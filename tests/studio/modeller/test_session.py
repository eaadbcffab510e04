"""A sitting without a browser: steps, files, and what is refused."""

import io
import zipfile

import numpy as np
import pytest

from pipeline.errors import InputFormatError, InputMissingError, OutputExistsError, UsageError
from pipeline.exchange import FORMATS, read_model
from pipeline.studio.folders import Folders
from pipeline.studio.modeller.files import MOST_BYTES, open_parameters
from pipeline.studio.modeller.modelling import Modeller
from pipeline.studio.modeller.session import Session
from pipeline.synthetic.colonization import PRESETS, ColonizationOptions, grow_colonization

SMALL = ColonizationOptions(iterations=6, crown_width_m=2, crown_height_m=3, crown_depth_m=2, seed=5)


@pytest.fixture
def session(tmp_path):
    made = Session(SMALL, Folders([tmp_path]))
    made.shown = Modeller(lambda: 0.0).model(SMALL)
    return made


def test_everything_can_be_undone_the_seed_too(session):
    session.move("gnarliness", 0.5)
    session.move("gnarliness", 0.4)
    session.settle()
    session.new_seed()
    seeded = session.options
    assert (seeded.gnarliness, seeded.seed != 5) == (0.4, True)
    session.preset("bush")
    assert session.options == ColonizationOptions(**PRESETS["bush"], seed=seeded.seed)
    session.reset()
    assert session.options == ColonizationOptions(seed=seeded.seed)
    for _ in range(3):
        session.undo()
    assert session.options == SMALL.model_copy(update={"gnarliness": 0.4})
    session.undo()
    assert session.options == SMALL
    session.undo()
    assert session.options == SMALL
    for _ in range(2):
        session.redo()
    assert session.options == seeded


def test_a_refused_value_changes_nothing(session):
    with pytest.raises(UsageError, match="sum must be below"):
        session.move("cutoff_top", 0.9)
    assert session.options == SMALL


def test_parameters_come_back_as_they_were_saved(session, tmp_path):
    session.save("mine.toml")
    assert open_parameters(tmp_path / "mine.toml", session.folders) == SMALL
    session.reset()
    session.open((tmp_path / "mine.toml").read_bytes(), "mine.toml")
    assert session.options == SMALL


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"gnarlines = 1", "x.toml: unknown key gnarlines, do you mean gnarliness"),
        (b"iterations = 1000", "x.toml: iterations = 1000 is not allowed; give a whole number"),
        (b"[clean]\nvoxel_m = 1", "x.toml: unknown key clean"),
        (b"\x00\xff", "x.toml: is no TOML"),
        (b"not toml", "x.toml: is no TOML"),
        (b"#" * (MOST_BYTES + 1), "more than the"),
        (b'leaf_picture = "/etc/hostname"', "outside the folders"),
        (b'bark_picture = "../secret.png"', "outside the folders"),
    ],
)
def test_a_file_from_elsewhere_is_explained_and_changes_nothing(session, content, says):
    with pytest.raises(InputFormatError, match=says):
        session.open(content, "x.toml")
    assert session.options == SMALL


def test_obj_comes_with_materials_and_pictures(session):
    name, content = session.exported("obj")
    assert name == "tree-5.obj.zip"
    with zipfile.ZipFile(io.BytesIO(content)) as bundle:
        assert bundle.namelist() == ["tree-5.mtl", "tree-5.obj", "tree-5_bark.png", "tree-5_leaf.png"]
        lines = bundle.read("tree-5.obj").decode().splitlines()
    assert sum(line.startswith("f ") for line in lines) == session.shown.triangles


@pytest.mark.parametrize("name", [name for name, kind in FORMATS.items() if kind.read and not kind.loses])
def test_a_model_is_read_back_from_every_format_that_keeps_it(session, tmp_path, name):
    file, content = session.exported(name)
    (tmp_path / file).write_bytes(content)
    tree = read_model(tmp_path / file)
    height = np.ptp(grow_colonization(SMALL).skeleton.xyz[:, 2])
    z = tree.skeleton.xyz[:, 2] + tree.skeleton.origin[2]
    assert np.ptp(z) == pytest.approx(height, abs=0.02)


def test_saving_stays_in_the_folder_and_overwrites_nothing(session, tmp_path):
    assert session.save("oak.obj") == (tmp_path / "oak.obj").resolve()
    with pytest.raises(OutputExistsError, match="give another name"):
        session.save("oak.obj")
    for name in ("../oak.obj", "/tmp/oak.obj", "a/b.obj", "..", "", ".hidden.obj", "a\\b.obj"):
        with pytest.raises(UsageError, match="no plain name"):
            session.save(name)
    with pytest.raises(UsageError, match="suffix names no format"):
        session.save("oak.docx")
    with pytest.raises(UsageError, match="without a folder"):
        Session(SMALL, Folders([])).save("oak.obj")


def test_a_link_does_not_lead_out_of_the_folder(tmp_path):
    inside, outside = tmp_path / "in", tmp_path / "out.toml"
    inside.mkdir()
    outside.write_text("seed = 3")
    (inside / "link.toml").symlink_to(outside)
    with pytest.raises(UsageError, match="outside the folders"):
        open_parameters(inside / "link.toml", Folders([inside]))


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(InputMissingError, match="no such file or folder"):
        Folders([tmp_path / "none"])
