"""Reaching a PostGIS database: its address, one transaction, and errors that tell no password."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import parse_qs, unquote, urlsplit

from pipeline.batch.merging.packages import package
from pipeline.errors import OutputError, UsageError

EXAMPLE = "postgresql://user@host:5432/database"

SECONDS_TO_CONNECT = 15

REMEDIES = {
    "28": "check the user and the password, or put the password in ~/.pgpass",  # not authorised
    "3D": "create the database, or check its name",  # no such database
    "42501": "ask for the rights CREATE on the schema and INSERT, UPDATE and DELETE on its tables",
    "53": "free space on the database's disk, or ask for more",  # resources
    "57": "the server stopped or cancelled it; try again",
}
"""What helps, by the beginning of PostgreSQL's code of an error."""


@contextmanager
def connected(url: str) -> Iterator[Any]:
    """Give a cursor in one transaction, which is committed at the end and undone where something fails.

    Parameters
    ----------
    url : str
        ``postgresql://user@host:port/database``; a password is better put in ~/.pgpass or PGPASSWORD.

    Raises
    ------
    UsageError
        If it is no such address.
    OutputError
        If the database cannot be reached, has no PostGIS, or refuses a command.
    MissingExtraError
        If psycopg is not installed.
    """
    psycopg = package("psycopg")
    shown = without_password(url)
    try:
        connection = psycopg.connect(url, connect_timeout=SECONDS_TO_CONNECT)
    except psycopg.ProgrammingError:  # its text repeats the address
        msg = f"{shown}: is no address of a database; give it as {EXAMPLE}, with %40 for an @ in a password"
        raise UsageError(msg) from None
    except psycopg.OperationalError as error:
        why = _reason(error, url)
        msg = f"{shown}: cannot be reached ({why}); check that it runs and that the address is right"
        raise OutputError(msg) from None
    try:
        with connection, connection.cursor() as cursor:
            _check_postgis(cursor, shown)
            yield cursor
    except psycopg.Error as error:
        code = error.sqlstate or ""
        known = (text for start, text in REMEDIES.items() if code.startswith(start))
        helps = next(known, "see the log of the server")
        msg = f"{shown}: refuses the trees ({_reason(error, url)}); {helps}"
        raise OutputError(msg) from None
    finally:
        connection.close()


def without_password(url: str) -> str:
    """Return an address to show, without password and options.

    Raises
    ------
    UsageError
        If it is no address.

    Examples
    --------
    >>> without_password("postgresql://ann:secret@db.example:5433/trees?sslmode=require")
    'postgresql://ann@db.example:5433/trees'
    """
    try:
        parts = urlsplit(url)
        strange = parts.scheme not in {"postgresql", "postgres"} or parts.netloc.count("@") > 1
        port = "" if strange or parts.port is None else f":{parts.port}"
    except ValueError:
        strange, port = True, ""
    if strange or "#" in url:
        msg = (
            f"--postgis: its value is no address of a database; give it as {EXAMPLE}, with %40 for an @, "
            "%2F for a / and %23 for a # in a password"
        )
        raise UsageError(msg)
    user = f"{parts.username}@" if parts.username else ""
    return f"{parts.scheme}://{user}{parts.hostname or ''}{port}{parts.path}"


def srid_of(cursor: Any, crs: str | None) -> int:
    """Return the number of the reference system in the database; of its horizontal part if it has no other.

    Raises
    ------
    UsageError
        If the system has no EPSG number.
    OutputError
        If the database does not know it.
    """
    numbers = _numbers(crs)
    for number in numbers:
        cursor.execute("SELECT 1 FROM spatial_ref_sys WHERE srid = %s", (number,))
        if cursor.fetchone():
            return number
    msg = f"the database's spatial_ref_sys knows none of EPSG {numbers}; add it, or update PostGIS"
    raise OutputError(msg)


def quoted(name: str) -> str:
    """Return a name as SQL has it.

    Examples
    --------
    >>> print(quoted('the "old" trees'))
    "the ""old"" trees"
    """
    return '"' + name.replace('"', '""') + '"'


def _check_postgis(cursor: Any, shown: str) -> None:
    cursor.execute("SELECT 1 FROM pg_extension WHERE extname = 'postgis'")
    if not cursor.fetchone():
        msg = (
            f"{shown}: has no PostGIS; let its administrator run CREATE EXTENSION postgis in it "
            "(the package is called postgresql-15-postgis-3 on Debian)"
        )
        raise OutputError(msg)


def _numbers(crs: str | None) -> list[int]:
    """Return the EPSG numbers of a system: its own, then that of its horizontal part."""
    from pyproj import CRS  # noqa: PLC0415 (slow to import)
    from pyproj.exceptions import CRSError  # noqa: PLC0415

    try:
        system = CRS.from_user_input(crs) if crs else None
    except CRSError:
        system = None
    systems = [] if system is None else [system, *system.sub_crs_list[:1]]
    numbers = [number for one in systems if (number := one.to_epsg()) is not None]
    if not numbers:
        msg = f"the trees' reference system ({crs or 'unknown'}) has no EPSG number; run with --crs EPSG:N"
        raise UsageError(msg)
    return numbers


def _reason(error: Exception, url: str) -> str:
    """Return the first line of an error, without the password, should it be in it."""
    text = str(error).strip().partition("\n")[0]
    parts = urlsplit(url)
    said = [parts.password or "", *parse_qs(parts.query).get("password", ())]
    for secret in {*said, *map(unquote, said)} - {""}:
        text = text.replace(secret, "***")
    return text
