"""Conifer or broadleaf, by the name of a species: Latin, Dutch, or the four letters of foresters."""

from __future__ import annotations

import re

GYMNOSPERMS = frozenset((
    "abies", "araucaria", "callitropsis", "calocedrus", "cathaya", "cedrus", "cephalotaxus",
    "chamaecyparis", "cryptomeria", "cunninghamia", "cupressocyparis", "cupressus", "ginkgo",
    "hesperotropsis", "juniperus", "keteleeria", "larix", "metasequoia", "picea", "pinus",
    "platycladus", "podocarpus", "pseudolarix", "pseudotsuga", "sciadopitys", "sequoia",
    "sequoiadendron", "taxodium", "taxus", "tetraclinis", "thuja", "thujopsis", "torreya", "tsuga",
    "wollemia", "xanthocyparis",
))  # fmt: skip
"""Genera of trees without flowers: conifers, and the ginkgo with them."""

DUTCH_ENDINGS = ("spar", "den", "lariks", "lork", "jeneverbes", "levensboom", "mammoetboom", "ceder")
"""Last parts of Dutch names of conifers; a ``linden`` is none."""

DUTCH = frozenset(
    (*DUTCH_ENDINGS, "taxus", "ginkgo", "cipres", "moerascipres", "watercipres", "douglas", "conifeer")
)
"""Words that name a conifer wherever they stand, as in ``grove den``."""

NOT_CONIFERS = ("linde", "vlinde")

CODES = frozenset((
    "abal", "abgr", "abno", "abpr", "cela", "chla", "cuse", "gibi", "juco", "juvi", "lade", "laka",
    "megl", "piab", "pice", "pimu", "pini", "pinr", "pinu", "piom", "pipi", "pipu", "pisi", "pisl",
    "pist", "pisy", "psme", "segi", "sese", "taba", "tadi", "thoc", "thpl", "tshe",
))  # fmt: skip
"""First two letters of genus and species of common conifers."""

_FOUR_LETTERS = 4


def leaf_type_of(species: str | None) -> str | None:
    """Return ``"gymnosperm"`` or ``"angiosperm"``; None if the name says nothing.

    Examples
    --------
    >>> [leaf_type_of(name) for name in ("Picea abies", "Fijnspar", "PIAB", "Tilia x europaea", "onbekend")]
    ['gymnosperm', 'gymnosperm', 'gymnosperm', 'angiosperm', None]
    """
    words = re.findall(r"[a-zà-ÿ]+", (species or "").lower())
    if not words or words[0] in {"onbekend", "unknown", "nvt", "boom", "none", "nan", "null"}:
        return None
    first, whole = words[0], "".join(words)
    short = len(whole) == _FOUR_LETTERS and whole in CODES
    dutch = first.endswith(DUTCH_ENDINGS) and not first.startswith(NOT_CONIFERS)
    dutch |= not DUTCH.isdisjoint(words)
    return "gymnosperm" if first in GYMNOSPERMS or dutch or short else "angiosperm"
