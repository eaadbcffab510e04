"""Examples of different habits, from configs/colonization: each names what differs from the defaults."""

from __future__ import annotations

from pipeline.shipped import Shipped

PRESETS = Shipped("colonization")
