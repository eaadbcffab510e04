"""The Years tab: a tree through the years, pruned with the mouse.

| file | what |
|---|---|
| `plan` | what a tree begins with, how it grows, what is done to it |
| `growing` | from a plan to years; what is the same as before is not grown again |
| `listing`, `forms` | events as files and lists, and as fields to fill in |
| `limbs`, `picking` | the wood of a year, and which of it a click means |
| `parameters` | the sliders of growth |
| `files` | what is opened and downloaded |
| `session` | what one sitting holds, without a browser |
| `words` | figures with their units |
| `rods`, `scene` | the picture; the browser draws it |
| `layout`, `pruning`, `styles` | what stands where |
| `board` | what the page shows, as the session has it |
| `actions`, `tab` | what the buttons do, and what the browser changes |
| `news`, `film` | what comes of the worker's news, and of the film |

Only what draws or lays out needs the extra `studio`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipeline.studio.years.tab import YearsTab

__all__ = ["YearsTab"]


def __getattr__(name: str) -> Any:
    """Return the tab, and load what draws it only then."""
    if name == "YearsTab":
        return import_module("pipeline.studio.years.tab").YearsTab
    msg = f"module {__name__} has no {name}"
    raise AttributeError(msg)
