"""The inventory in the words of Dutch registers: names and classes of the object type Boom, as SQL.

Names, units and the values of ``takvrijeStam`` are those of the Gemeentelijk Gegevensmodel, as VNG publishes
it for its register of objects. The classes of height and crown are those of IMBOR, as the province of
Noord-Holland lists them. Both are lists that others have drawn up from the models, not the models:

- The list of crown classes that was seen ends before its lowest class; ``tot 3 m.`` completes it after the
  pattern of the heights. It holds a coarse class (5 to 10 m) beside two fine ones; the fine ones are used.
- ``takvrijeStam`` is in the model what a tree *shall* have in the end. Here it is what the tree has: the
  highest value of the list that the crown's base reaches.
- No list of the values of ``stamdiameterklasse`` was found; it is left out.

References
----------
VNG, Objecttypes API, object type Boom: https://objects-and-objecttypes-api.readthedocs.io, from the
Gemeentelijk Gegevensmodel. Provincie Noord-Holland, Leveren Geoinformatie, domain lists BoomBoomhoogteklasse
and BoomKroondiameterklasse: https://github.com/provincieNH/Leveren_Geoinformatie. CROW, IMBOR.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

HEIGHT_BOUNDS_M = (6, 9, 12, 15, 18, 24)
CROWN_BOUNDS_M = (3, 5, 7, 10, 15, 20)
BARE_STEM_M = (2, 4, 6, 8)
"""Values of takvrijeStam above 0."""

VIEW = "boom"


def classes(bounds: Sequence[int], beyond: str) -> tuple[str, ...]:
    """Return the names of classes, each including its lower bound.

    Examples
    --------
    >>> classes((3, 5), "groter")
    ('tot 3 m.', '3 tot 5 m.', '5 m. en groter')
    """
    between = (f"{low} tot {high} m." for low, high in pairwise(bounds))
    return f"tot {bounds[0]} m.", *between, f"{bounds[-1]} m. en {beyond}"


def columns() -> dict[str, str]:
    """Return the view's columns by name: SQL over the table of trees, for SQLite and PostgreSQL alike."""
    return {
        "boomhoogteActueel": _whole("height_m"),
        "boomhoogteklasseActueel": _class("height_m", HEIGHT_BOUNDS_M, "hoger"),
        "kroondiameterklasseActueel": _class("crown_diam_m", CROWN_BOUNDS_M, "groter"),
        "kroonvolume": _whole("crown_vol_m3"),
        "stamdiameter": _whole("dbh_cm"),
        "takvrijeStam": _bare_stem(),
        "soort": "species",
        "opnamedatum": "acq_date_max",
    }


def select(table: str, geometry: str, identity: str | None = None) -> str:
    """Return the query of the view.

    Parameters
    ----------
    table : str
        As it stands in the query.
    geometry : str
        Column of the points.
    identity : str, optional
        Column of row numbers, if the view has one.
    """
    told = [f'{sql} AS "{name}"' for name, sql in columns().items()]
    first = [identity] if identity else []
    return f"SELECT {', '.join([*first, geometry, 'tree_id', *told, 'model_uri'])} FROM {table}"


def _whole(column: str) -> str:
    return f"CAST(round({column}) AS INTEGER)"


def _class(column: str, bounds: Sequence[int], beyond: str) -> str:
    names = classes(bounds, beyond)
    cases = " ".join(
        f"WHEN {column} < {bound} THEN '{name}'" for bound, name in zip(bounds, names[:-1], strict=True)
    )
    return f"CASE WHEN {column} IS NULL THEN 'Onbekend' {cases} ELSE '{names[-1]}' END"


def _bare_stem() -> str:
    cases = " ".join(f"WHEN crown_base_h_m >= {bound} THEN '{bound} m.'" for bound in reversed(BARE_STEM_M))
    return f"CASE WHEN crown_base_h_m IS NULL THEN 'Onbekend' {cases} ELSE '0 m.' END"
