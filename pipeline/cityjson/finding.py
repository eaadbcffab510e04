"""One fault in a file: where it is, what it is, and how it is mended."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """A fault in a CityJSON document.

    Parameters
    ----------
    where : str
        The part of the document: ``"tree-1, geometry 3, shell 0, surface 12"``, counted from 0.
    what : str
        What is wrong, a sentence.
    remedy : str
        What to do about it, a sentence.
    """

    where: str
    what: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what} {self.remedy}"
