"""Scans in the browser: a cloud, its reconstruction, what other options make of it, and two models compared.

| file | what |
|---|---|
| `fields` | the options of a reconstruction as fields of a form |
| `listing`, `opening` | what the folders hold, and reading it: clouds, models, folders of runs |
| `elsewhere` | a process for what takes long, which can be ended at once |
| `making` | from a wish to what is shown; stages that a change leaves alone are kept |
| `session` | what one sitting holds, without a browser |
| `figures`, `telling` | the report, comparisons and legends as the page shows them |
| `colouring`, `shapes`, `scene` | the picture; the browser draws it |
| `layout`, `panels` | what stands where |
| `actions`, `tab` | what the buttons do, and what is shown then |
| `news` | what comes of the worker's news |

The tab is loaded when it is asked for: the process of `elsewhere` needs neither server nor graphics.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipeline.studio.scan.tab import ScanTab

__all__ = ["ScanTab"]


def __getattr__(name: str) -> Any:
    """Load the tab."""
    if name in __all__:
        return getattr(import_module("pipeline.studio.scan.tab"), name)
    msg = f"module {__name__!r} has no attribute {name!r}"
    raise AttributeError(msg)
