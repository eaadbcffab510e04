"""What the page says of a year and of a branch: figures with their units."""

from __future__ import annotations

import math

from pipeline.growth.outlook import crown_area
from pipeline.report import report
from pipeline.studio.years.growing import Story, Year
from pipeline.studio.years.limbs import Branch

FIGURES = ("year", "metamers", "height", "dbh", "crown", "volume", "milliseconds")
NO_FIGURES = dict.fromkeys(FIGURES, "-")


def figures_of(year: Year, story: Story) -> dict[str, str]:
    """Return what the line below the picture tells of a year.

    Height, diameter and volume are those of the report; ``-`` stands for what is not known. So is the crown
    of a scanned tree; that of any other is the hull of its nodes.
    """
    shown = {
        "year": f"{year.number} of {story.plan.years}",
        "metamers": f"{len(year.limbs.width) - 1:,}",
        "milliseconds": f"{story.milliseconds:.0f}",
    }
    if len(year.tree) < 2:
        return NO_FIGURES | shown
    held = report(year.tree)
    known = {
        "height": _said(held.height_m, 2, "m"),
        "dbh": _said(held.dbh_cm, 1, "cm"),
        "crown": _said(held.crown_diameter_m or crown_m(year), 2, "m"),
        "volume": _said(held.volume_l, 1, "L"),
    }
    return shown | known


def crown_m(year: Year) -> float | None:
    """Diameter of the circle with the area of the crown in plan, metres, of all nodes of a year's tree."""
    area = crown_area(year.tree.skeleton.xyz)
    return 2.0 * math.sqrt(area / math.pi) if area > 0.0 else None


def branch_words(branch: Branch) -> dict[str, str]:
    """Return what is told of a picked branch."""
    born = "was there at the start" if branch.birth_year <= 0 else f"grew in year {branch.birth_year}"
    x, y, z = branch.place
    return {
        "title": "The stem" if branch.order == 0 else f"Branch of order {branch.order}",
        "order": str(branch.order),
        "length": f"{branch.length_m:.2f} m",
        "bears": f"{branch.bears_m:.2f} m",
        "base": f"{branch.base_cm:.1f} cm",
        "here": f"{branch.here_cm:.1f} cm",
        "born": born,
        "known": branch.known,
        "place": f"({x:.2f}, {y:.2f}, {z:.2f})",
    }


def progress_words(story: Story) -> tuple[int, str]:
    """Return how far a growth is, percent and in words."""
    last = story.years[-1].number if story.years else 0
    count = len(story.years[-1].limbs.width) - 1 if story.years else 0
    share = 100 * (last + 1) // (story.plan.years + 1)
    return share, f"growing: year {last} of {story.plan.years}, {count:,} metamers"


def _said(value: float | None, digits: int, unit: str) -> str:
    return "-" if value is None else f"{value:,.{digits}f} {unit}"
