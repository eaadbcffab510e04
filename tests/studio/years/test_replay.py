"""What the page has grown and pruned is what `treepipe simulate` grows of the saved files, byte by byte."""

import pytest
from click.testing import CliRunner

from pipeline.cli.main import main
from pipeline.exchange import FORMATS
from pipeline.studio.folders import Folders
from pipeline.studio.years.session import Session

BYTES = ("lsjson", "npz", "qsm")
CAMERA = {
    "position": [0.0, -8.0, 0.5],
    "focalPoint": [0.0, 0.0, 0.5],
    "viewUp": [0.0, 0.0, 1.0],
    "viewAngle": 30,
}


@pytest.fixture
def sitting(plan, grower, tmp_path):
    session = Session(Folders([tmp_path]), plan(years=9))

    def grow():
        session.tell(grower.grow(session.plan, lambda _: None))

    session.grow = grow
    return session


def prune_a_little(sitting):
    """Do what a person does: prune, think again, prune where it does not fit, look at years."""
    sitting.grow()
    sitting.look_at(7)
    sitting.pick(CAMERA, (400, 330), (800, 600))
    place = ", ".join(f"{value:.3f}" for value in sitting.place)
    sitting.add("cut-to-bud", {"year": "7", "position": place})
    sitting.grow()
    sitting.add("limit-length", {"year": "4", "until": "8", "every": "2", "length_m": "0.4"})
    sitting.grow()
    sitting.add("stake", {"year": "2", "direction": "1, 0, 1", "years": "4"})
    sitting.add("cut-to-bud", {"year": "5", "position": "7, 7, 7"})
    sitting.grow()
    sitting.remove(0)
    sitting.grow()
    sitting.undo()
    sitting.grow()
    assert len(sitting.story.misfits()) == 1


def replayed(sitting, folder, formats):
    """Run the command that the page shows, in the folder that it has saved to."""
    sitting.save()
    words = sitting.command.split()[1:]
    words[words.index("years")] = str(folder / "years")
    words = [str(folder / word) if (folder / word).is_file() else word for word in words]
    words += ["--formats", ",".join(formats), "--no-picture"]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.output
    return folder / "years"


def check_same_bytes(sitting, folder, formats=BYTES):
    made = replayed(sitting, folder, formats)
    for year in (3, 7, 9):
        sitting.look_at(year)
        for name in formats:
            file = made / f"year_{year:03d}{FORMATS[name].suffix}"
            assert sitting.exported(name)[1] == file.read_bytes(), (year, name)


def test_from_a_bud(sitting, tmp_path):
    prune_a_little(sitting)
    check_same_bytes(sitting, tmp_path, (*BYTES, "cityjson"))


def test_from_a_bud_of_a_species_with_a_parameter_of_its_own(sitting, tmp_path):
    sitting.species("apple")
    sitting.set("alpha", 2.6)
    sitting.set("seed", 11)
    prune_a_little(sitting)
    check_same_bytes(sitting, tmp_path)


def test_from_the_tree_of_the_model_tab(sitting, standing, tmp_path):
    sitting.begin_with(standing, "model")
    sitting.set("years", 9)
    prune_a_little(sitting)
    check_same_bytes(sitting, tmp_path)


def test_from_a_file(sitting, standing_file, tmp_path):
    sitting.folders = Folders([tmp_path, standing_file])
    sitting.begin_with_file(standing_file)
    sitting.set("years", 9)
    prune_a_little(sitting)
    check_same_bytes(sitting, tmp_path)
