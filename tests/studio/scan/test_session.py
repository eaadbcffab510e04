"""A sitting without a browser: options with their history, what is saved, and what is refused."""

import shlex
import tomllib

import pytest
from click.testing import CliRunner

from pipeline.cli.main import main
from pipeline.config import Config
from pipeline.errors import PipelineError, UsageError
from pipeline.exchange import FORMATS, read_model
from pipeline.studio.folders import Folders
from pipeline.studio.scan.beside import NOTHING_BESIDE, command_of, species, system
from pipeline.studio.scan.making import Maker
from pipeline.studio.scan.session import ScanSession, packed
from pipeline.studio.scan.telling import files_of


@pytest.fixture
def session(folder):
    """A sitting with twig.laz shown."""
    made = ScanSession(Folders([folder]))
    made.maker = Maker(made.folders)
    made.open(folder / "twig.laz")
    show(made)
    return made


def show(session):
    session.take(session.maker.make(session.wish(), lambda _stage: None))


def test_nothing_is_wished_for_before_something_is_opened(folder):
    session = ScanSession(Folders([folder]))
    assert session.wish() is None
    with pytest.raises(UsageError, match="open a cloud first"):
        session.change("clean.voxel_m", 0.1)


def test_options_change_by_gestures_and_come_back(session):
    assert session.change("cylinders.rounds", 3)
    assert session.change("cylinders.rounds", 1)
    session.settle()
    assert session.change("cylinders.stiffness", 2.0)
    assert not session.change("cylinders.stiffness", 2.0)
    session.undo()
    assert (session.config.cylinders.rounds, session.config.cylinders.stiffness) == (1, 1.0)
    session.undo()
    assert session.config == Config()
    session.redo()
    assert session.config.cylinders.rounds == 1
    session.reset()
    assert session.config == Config()
    session.undo()
    assert session.config.cylinders.rounds == 1


def test_lists_made_anew_keep_what_is_compared(session, folder):
    def shown(*paths):
        return files_of(session, {path: number for number, path in enumerate(paths)})["scan_against"]

    cloud, truth = folder / "twig.laz", folder / "twig.truth.npz"
    assert shown(cloud, truth) == "nothing"
    session.compare(truth)
    assert shown(cloud, truth) == 1
    assert shown(folder / "new.laz", cloud, truth) == 2
    assert shown(cloud) == "nothing"
    session.compare("start")
    assert shown(cloud, truth) == "start"


def test_a_refused_value_changes_nothing(session):
    with pytest.raises(UsageError, match="is not allowed"):
        session.change("clean.voxel_m", -1)
    assert session.config == Config()


def test_the_result_before_the_last_change_is_compared_with(session):
    session.compare("before")
    assert session.wish().other is None
    session.change("cylinders.rounds", 1)
    session.settle()
    session.change("cylinders.stiffness", 5.0)
    assert session.wish().other.cylinders.rounds == 1
    assert session.wish().other.cylinders.stiffness == 1.0
    session.compare("start")
    assert session.wish().other == Config()


def test_files_outside_are_refused(session, tmp_path):
    (tmp_path / "x.laz").write_bytes(b"")
    for act in (session.open, session.compare):
        with pytest.raises(UsageError, match="outside the folders"):
            act(tmp_path / "x.laz")
    assert session.path.name == "twig.laz"


def test_after_a_file_that_cannot_be_opened_all_is_as_before(session, folder):
    session.change("cylinders.rounds", 1)
    before = session.history
    session.open(folder / "three.xyz")
    session.fail()
    session.fail()
    assert (session.path.name, session.history) == ("twig.laz", before)
    assert session.wish().turn == session.shown.wish.turn
    session.compare(folder / "torn.ls.json")
    session.fail()
    assert session.against is None


def test_what_was_asked_for_before_another_file_is_late(session, folder):
    late = session.shown
    session.open(folder / "twig.truth.npz")
    assert session.is_late(late)
    show(session)
    assert not session.is_late(session.shown)
    assert session.stem == "twig.truth"


def test_saved_options_make_the_same_bytes_on_the_command_line(session, folder, tmp_path):
    session.change("cylinders.rounds", 1)
    session.change("clean.voxel_m", 0.01)
    show(session)
    (tmp_path / "mine.toml").write_bytes(session.saved())
    made = {
        name: packed(session.shown.result.tree, name, "twig", session.config)[1]
        for name in ("lsjson", "qsm", "cityjson")
    }
    arguments = ["run", str((folder / "twig.laz").resolve()), "--config", str(tmp_path / "mine.toml")]
    arguments += ["--out", str(tmp_path / "out"), "--formats", ",".join(made), "--no-picture"]
    outcome = CliRunner().invoke(main, arguments)
    assert outcome.exit_code == 0, outcome.output
    for name, content in made.items():
        assert (tmp_path / "out" / "twig" / f"twig{FORMATS[name].suffix}").read_bytes() == content
    assert tomllib.loads(session.saved().decode())["cylinders"]["rounds"] == 1


def test_what_is_known_beside_the_points_makes_the_same_bytes_on_the_command_line(session, folder, tmp_path):
    session.open(folder / "bare.laz")
    show(session)
    before = session.shown.result
    session.know(ground=folder / "floor.laz")
    session.know(crs="EPSG:28992")
    session.know(species="Tilia cordata")
    show(session)
    (tmp_path / "bare.toml").write_bytes(session.saved())
    result = session.shown.result
    assert result.figures["crs"] == "EPSG:28992"
    assert result.tree.metadata["ground_source"] == "file" != before.tree.metadata["ground_source"]
    made = {name: packed(result.tree, name, "bare", session.config)[1] for name in ("lsjson", "cityjson")}
    words = shlex.split(command_of(folder / "bare.laz", str(tmp_path / "bare"), session.beside))
    words = [*words[1:-1], str(tmp_path / "out"), "--formats", ",".join(made), "--no-picture"]
    outcome = CliRunner().invoke(main, words)
    assert outcome.exit_code == 0, outcome.output
    for name, content in made.items():
        assert (tmp_path / "out" / "bare" / f"bare{FORMATS[name].suffix}").read_bytes() == content
    session.know(ground=None, crs=None, species=None)
    show(session)
    assert session.shown.result.figures["crs"] is None
    assert session.shown.result.figures["nodes"] == before.figures["nodes"]


def test_what_cannot_be_known_is_a_sentence_and_is_taken_back(session, folder, tmp_path):
    (tmp_path / "floor.laz").write_bytes(b"")
    with pytest.raises(UsageError, match="outside the folders"):
        session.know(ground=tmp_path / "floor.laz")
    session.know(ground=folder / "empty.laz")
    with pytest.raises(PipelineError, match="is empty"):
        show(session)
    session.fail()
    assert session.beside == NOTHING_BESIDE
    session.know(species="Tilia")
    session.open(folder / "twig.truth.npz")
    assert session.beside == NOTHING_BESIDE
    show(session)
    session.know(species="Tilia")
    with pytest.raises(PipelineError, match="has no points"):
        show(session)


def test_typed_systems_and_species_are_checked():
    assert (system(" "), system("epsg:28992"), species(" ")) == (None, "EPSG:28992", None)
    with pytest.raises(UsageError, match=r"^RD: is not of the form EPSG:N; give for example"):
        system("RD")
    with pytest.raises(UsageError, match="at most 100"):
        species("x" * 101)


def test_saved_options_are_those_of_what_is_shown(session):
    session.change("cylinders.rounds", 1)
    assert tomllib.loads(session.saved().decode())["cylinders"]["rounds"] == 2


@pytest.mark.parametrize("name", [name for name, kind in FORMATS.items() if kind.read and not kind.loses])
def test_a_model_is_read_back(session, tmp_path, name):
    tree = session.shown.result.tree
    file, content = packed(tree, name, "twig", Config())
    (tmp_path / file).write_bytes(content)
    assert len(read_model(tmp_path / file)) == pytest.approx(len(tree), rel=0.02)


def test_several_files_are_packed_into_one(session):
    name, content = packed(session.shown.result.tree, "obj", "twig", Config())
    assert name == "twig.obj.zip"
    assert content[:2] == b"PK"
    with pytest.raises(UsageError, match="unknown format 'docx'"):
        packed(session.shown.result.tree, "docx", "twig", Config())
