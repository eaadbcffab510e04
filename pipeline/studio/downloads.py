"""Downloads: what is written into a folder that is thrown away, as the name and content of one file."""

from __future__ import annotations

import io
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path

from pipeline.choosing import named
from pipeline.exchange import FORMATS


def packed_as(format_name: str, stem: str, write: Callable[[Path], None]) -> tuple[str, bytes]:
    """Return the name and content of a download: one file, or a .zip where several belong together.

    Parameters
    ----------
    format_name : str
        Of `pipeline.exchange.FORMATS`.
    stem : str
        Name without a suffix.
    write : callable
        Writes the file of that name, and those that belong to it beside it.

    Raises
    ------
    UsageError
        If there is no such format.
    """
    suffix = named(format_name, FORMATS, "format").suffix
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / f"{stem}{suffix}"
        write(target)
        made = sorted(target.parent.iterdir())
        if len(made) == 1:
            return made[0].name, made[0].read_bytes()
        bundle = io.BytesIO()
        with zipfile.ZipFile(bundle, "w", zipfile.ZIP_DEFLATED) as archive:
            for file in made:
                archive.write(file, file.name)
        return f"{target.name}.zip", bundle.getvalue()
