"""A real PostGIS takes the trees, once, and says in a sentence what it refuses."""

from __future__ import annotations

import datetime
import traceback

import psycopg
import pytest

from pipeline.airborne.grid import Cell
from pipeline.batch.columns import MERGED
from pipeline.batch.merge import merge
from pipeline.batch.merging.database import connected, without_password
from pipeline.batch.merging.postgis import PostgisOptions
from pipeline.errors import OutputError, PipelineError, UsageError
from tests.batch.merging.fakes import cell_table, town, write_cell
from tests.batch.merging.postgres import server

SECRET = "s3cr%2Ft"


@pytest.fixture(scope="module")
def running():
    with server() as url:
        yield url


@pytest.fixture
def database(running, request):
    """A new database with PostGIS for every test."""
    name = f"t{abs(hash(request.node.name)) % 10**9}"
    with psycopg.connect(running, autocommit=True) as all_of_them:
        all_of_them.execute(f"CREATE DATABASE {name}")
    url = running.replace("/postgres?", f"/{name}?")
    with psycopg.connect(url, autocommit=True) as own:
        own.execute("CREATE EXTENSION postgis")
    return url


def ask(url, query):
    with psycopg.connect(url) as connection:
        return connection.execute(query).fetchall()


def test_every_tree_is_there_with_its_place(tmp_path, database):
    tables = town(tmp_path, count=120)
    summary = merge(tmp_path, postgis=database, drawn=False)
    count = sum(map(len, tables.values()))
    assert summary["postgis"] == {"inserted": count, "replaced": 0, "removed": 0}
    held = ask(
        database,
        "SELECT count(*), min(ST_SRID(geometry)), bool_and(ST_X(geometry) = x "
        "AND ST_Z(geometry) = z_ground), "
        "bool_and(abs(ST_Area(crown) - crown_area_m2) < 0.5 * crown_area_m2), min(ST_SRID(crown)) "
        "FROM treepipe.trees",
    )
    assert held == [(count, 7415, True, True, 7415)]
    one = next(iter(tables.values())).slice(3, 1).to_pylist()[0]
    row = ask(
        database,
        "SELECT height_m, flags, acq_date_max, crs_assumed, species, n_points FROM treepipe.trees "
        f"WHERE tree_id = '{one['tree_id']}'",
    )
    wanted = (one["height_m"], one["flags"], datetime.date(2021, 1, 17), True, None, one["n_points"])
    assert row == [wanted]


def test_the_table_has_key_indexes_and_the_dutch_view(tmp_path, database):
    town(tmp_path, columns=1, rows=1, count=40)
    merge(tmp_path, postgis=database, drawn=False)
    query = "SELECT indexdef FROM pg_indexes WHERE schemaname = 'treepipe'"
    indexes = [row[0] for row in ask(database, query)]
    assert sum("USING gist" in one for one in indexes) == 2
    assert any("UNIQUE" in one and "(tree_id)" in one for one in indexes)
    names = [
        row[0]
        for row in ask(
            database,
            "SELECT column_name FROM information_schema.columns WHERE table_name = 'trees' "
            "ORDER BY ordinal_position",
        )
    ]
    assert names == [column.name for column in MERGED]
    shown = ask(
        database,
        'SELECT "boomhoogteActueel", "kroondiameterklasseActueel", "takvrijeStam", height_m, crown_diam_m '
        "FROM treepipe.boom JOIN treepipe.trees USING (tree_id)",
    )
    assert all(abs(height - h) <= 0.5 for height, _, _, h, _ in shown)
    assert {"tot 3 m.", "5 tot 7 m.", "7 tot 10 m."} & {row[1] for row in shown}


def test_merging_again_makes_no_duplicates(tmp_path, database):
    town(tmp_path, columns=1, rows=1, count=60)
    first = merge(tmp_path, postgis=database, drawn=False)
    again = merge(tmp_path, postgis=database, drawn=False)
    assert again["postgis"] == {"inserted": 0, "replaced": first["trees"], "removed": 0}
    assert ask(database, "SELECT count(*) FROM treepipe.trees") == [(first["trees"],)]


def test_a_newer_run_replaces_the_trees_of_its_cells_and_edition(tmp_path, database):
    west, east = Cell(121_500, 487_000, 500), Cell(122_000, 487_000, 500)
    for cell in (west, east):
        write_cell(tmp_path / "one", cell, cell_table(cell, 50))
    write_cell(tmp_path / "ahn3", west, cell_table(west, 30, seed=5, edition="ahn3"))
    merge(tmp_path / "one", postgis=database, drawn=False)
    merge(tmp_path / "ahn3", postgis=database, drawn=False)
    write_cell(tmp_path / "two", west, cell_table(west, 40, seed=9))
    summary = merge(tmp_path / "two", postgis=database, drawn=False)
    assert summary["postgis"]["removed"] > 40
    by_cell = ask(
        database, "SELECT edition, cell_id, count(*) FROM treepipe.trees GROUP BY 1, 2 ORDER BY 1, 2"
    )
    lengths = [len(cell_table(*one)) for one in ((west, 30, 5, "ahn3"), (west, 40, 9), (east, 50))]
    assert [row[2] for row in by_cell] == lengths
    assert [row[:2] for row in by_cell] == [("ahn3", west.name), ("ahn4", west.name), ("ahn4", east.name)]


def test_a_cell_that_has_no_tree_any_more_is_emptied(tmp_path, database):
    cell = Cell(121_500, 487_000, 500)
    write_cell(tmp_path, cell, cell_table(cell, 20))
    trees = merge(tmp_path, postgis=database, drawn=False)["trees"]
    write_cell(tmp_path, cell, cell_table(cell, 20).slice(0, 0), edition="ahn4")
    summary = merge(tmp_path, postgis=database, drawn=False)
    assert summary["postgis"] == {"inserted": 0, "replaced": 0, "removed": trees}


def test_schema_and_table_can_be_named(tmp_path, database):
    town(tmp_path, columns=1, rows=1, count=20)
    into = PostgisOptions(schema_name='my "own"', table="Bomen 2026")
    trees = merge(tmp_path, postgis=database, into=into, drawn=False)["trees"]
    assert ask(database, 'SELECT count(*) FROM "my ""own"""."Bomen 2026"') == [(trees,)]
    assert ask(database, 'SELECT count(*) FROM "my ""own"""."Bomen 2026_boom"') == [(trees,)]


def test_a_table_of_an_earlier_version_gets_the_new_columns(tmp_path, database):
    town(tmp_path, columns=1, rows=1, count=20)
    merge(tmp_path, postgis=database, drawn=False)
    with psycopg.connect(database) as connection:
        connection.execute("ALTER TABLE treepipe.trees DROP COLUMN agb_lo_kg")
    merge(tmp_path, postgis=database, drawn=False)
    assert ask(database, "SELECT count(agb_lo_kg) > 10 FROM treepipe.trees") == [(True,)]


def test_another_reference_system_is_refused_and_nothing_changes(tmp_path, database):
    cell = Cell(121_500, 487_000, 500)
    write_cell(tmp_path / "a", cell, cell_table(cell, 20))
    write_cell(tmp_path / "b", cell, cell_table(cell, 25, seed=3), crs="EPSG:32631")
    trees = merge(tmp_path / "a", postgis=database, drawn=False)["trees"]
    with pytest.raises(OutputError, match=r"reference system 7415.*32631.*give another table"):
        merge(tmp_path / "b", postgis=database, drawn=False)
    assert ask(database, "SELECT count(*) FROM treepipe.trees") == [(trees,)]


def test_a_table_of_something_else_is_left_alone(tmp_path, database):
    town(tmp_path, columns=1, rows=1, count=20)
    with psycopg.connect(database) as connection:
        connection.execute("CREATE SCHEMA treepipe; CREATE TABLE treepipe.trees (name text)")
    with pytest.raises(OutputError, match="something else than trees; give another schema or table"):
        merge(tmp_path, postgis=database, drawn=False)


def test_no_postgis_and_no_rights_are_told_with_their_remedy(running, database):
    with pytest.raises(OutputError, match=r"has no PostGIS.*CREATE EXTENSION postgis"), connected(running):
        pass
    with psycopg.connect(database, autocommit=True) as connection:
        connection.execute("DROP ROLE IF EXISTS guest; CREATE ROLE guest LOGIN")
    guest = f"postgresql://guest:{SECRET}@{database.partition('@')[2]}"
    with pytest.raises(OutputError, match="ask for the rights CREATE") as caught, connected(guest) as cursor:
        cursor.execute("CREATE SCHEMA treepipe")
    assert "guest@" in str(caught.value)
    assert_no_secret(caught.value)


@pytest.mark.parametrize(
    ("url", "says"),
    [
        (f"postgresql://ann:{SECRET}@127.0.0.1:1/trees", "cannot be reached.*check that it runs"),
        (f"postgresql://ann:{SECRET}@nowhere.invalid/trees", "cannot be reached"),
        (f"postgresql://ann:{SECRET}@127.0.0.1:1/trees?nonsense=1", "no address of a database"),
        (f"postgresql://ann:{SECRET}@host:port/trees", "no address of a database"),
        (f"postgresql://ann:a@{SECRET}@host/trees", "%40 for an @"),
        (f"mysql://ann:{SECRET}@host/trees", "give it as postgresql://"),
        (f"host=127.0.0.1 password={SECRET}", "give it as postgresql://"),
        (f"postgresql:///trees?host=/nowhere&password={SECRET}", "cannot be reached"),
        (f"postgresql://ann:a#{SECRET}@host/trees", "%23 for a #"),
    ],
)
def test_a_wrong_address_is_told_without_the_password(url, says):
    with pytest.raises(PipelineError, match=says) as caught, connected(url):
        pass
    assert_no_secret(caught.value)


def assert_no_secret(error):
    told = "".join(traceback.format_exception(error))
    told = told.replace(SECRET_LINE, "")
    assert not any(secret in told for secret in ("s3cr%2Ft", "s3cr/t"))


SECRET_LINE = f'SECRET = "{SECRET}"'


def test_an_address_is_checked_before_any_work(tmp_path):
    with pytest.raises(UsageError, match="give it as postgresql://"):
        merge(tmp_path, postgis="trees")


def test_an_address_is_shown_without_options():
    assert without_password("postgres://h:5/d?password=x") == "postgres://h:5/d"


def test_trees_without_a_reference_system_are_refused(tmp_path, database):
    cell = Cell(121_500, 487_000, 500)
    write_cell(tmp_path, cell, cell_table(cell, 20), crs=None)
    with pytest.raises(UsageError, match="no EPSG number"):
        merge(tmp_path, postgis=database, drawn=False)
