"""How small things look in the Years tab."""

from typing import Any

SMALL = {"size": "small", "variant": "tonal", "classes": "mx-1"}
COMPACT: dict[str, Any] = {"density": "compact", "hide_details": True}
OVER = "background:rgba(255,255,255,.85)"
"""Of what stands over the picture."""
