"""The cells of a run: done, split, quarantined or still open; on disk before it counts."""

from __future__ import annotations

import logging
import shutil
from pathlib import Path

from pipeline.airborne.grid import Cell, split
from pipeline.batch import folder, manifests, quarantine
from pipeline.batch.job import Job, Outcome
from pipeline.batch.plan import Plan
from pipeline.batch.progress import Progress

LOGGER = logging.getLogger("treepipe")


class Ledger:
    """The cells of a run.

    Attributes
    ----------
    open : dict of Cell to set of Cell
        What is still to be done, by the cell of the plan that it is a part of.
    progress : Progress
    """

    def __init__(self, plan: Plan, job: Job) -> None:
        self.plan, self.job = plan, job
        self.progress = Progress()
        self.open = self._open_cells()

    def _open_cells(self) -> dict[Cell, set[Cell]]:
        """Return the cells that are not done, by the cell of the plan that they are a part of."""
        held = quarantine.quarantined(self.job.out)
        still: dict[Cell, set[Cell]] = {}
        for root, cells in self._wanted():
            for cell in cells:
                self.progress.planned += 1
                manifest = manifests.done(self.job.out, cell, self.plan.config_hash, self.plan.input_hash)
                if manifest is not None:
                    self.progress.count(manifest, fresh=False)
                elif cell.name in held:
                    self.progress.quarantined += 1
                    if not held[cell.name].get("tile"):  # those are told by their tile
                        LOGGER.error(
                            "cell %s: still quarantined; %s", cell.name, held[cell.name].get("error")
                        )
                else:
                    still.setdefault(root, set()).add(cell)
        return still

    def _wanted(self) -> list[tuple[Cell, tuple[Cell, ...]]]:
        """Return all cells of the plan with what stands for them, or those of the one that is asked for."""
        only, out = self.plan.only, self.job.out
        if only is None:
            return [(root, quarantine.leaves(out, root)) for root in self.plan.cells]
        root = next(cell for cell in self.plan.cells if cell.covers(only))
        here = root
        while here != only:
            if not quarantine.split_path(out, here).is_file():
                quarantine.put_split(out, here, "asked")
            here = next(quarter for quarter in split(here) if quarter.covers(only))
        return [(root, quarantine.leaves(out, only))]

    def finish(self, cell: Cell, root: Cell) -> None:
        """Count a cell whose manifest is there."""
        manifest = manifests.done(self.job.out, cell, self.plan.config_hash, self.plan.input_hash)
        if manifest is None:
            error = "its work ended without a manifest of this run"
            self.quarantine(cell, root, "failed", Outcome("failed", error=error))
            return
        self.progress.count(manifest, fresh=True)
        LOGGER.info("cell %s: %d trees", cell.name, int(manifest.get("trees", 0)))
        self._close(cell, root)

    def split(self, cell: Cell, root: Cell, outcome: Outcome) -> tuple[Cell, ...]:
        """Put the quarters of a cell in its place, and return them; the plan then has three cells more."""
        by_size = "size" if "size_m" in outcome.facts else "points"
        reason = by_size if outcome.status == "split" else "memory"
        quarters = quarantine.put_split(self.job.out, cell, reason, **outcome.facts)
        shutil.rmtree(self.job.out / "cells" / cell.name, ignore_errors=True)
        self.progress.planned += len(quarters) - 1
        LOGGER.info("cell %s: split in four because of its %s", cell.name, reason)
        self.open[root].remove(cell)
        self.open[root].update(quarters)
        return quarters

    def quarantine(
        self, cell: Cell, root: Cell, reason: str, outcome: Outcome, *, tile: Path | None = None
    ) -> None:
        """Give a cell up, and tell why: at once, or with its tile at the end."""
        error = outcome.error or f"it ended {len(outcome.deaths)} workers"
        quarantine.put(
            self.job.out,
            cell,
            reason,
            error=error,
            tile=tile and str(tile),
            trace=outcome.trace,
            attempts=len(outcome.deaths) or 1,
            config_hash=self.plan.config_hash,
            input_hash=self.plan.input_hash,
        )
        shutil.rmtree(self.job.out / "cells" / cell.name, ignore_errors=True)
        self.progress.quarantined += 1
        LOGGER.log(logging.INFO if tile else logging.ERROR, "cell %s: quarantined; %s", cell.name, error)
        self._close(cell, root, drop=False)

    def _close(self, cell: Cell, root: Cell, *, drop: bool = True) -> None:
        """Strike a cell off; with the last one of a root its points go, unless one is quarantined."""
        self.open[root].remove(cell)
        if self.open[root]:
            return
        del self.open[root]
        if drop and not any(
            quarantine.quarantine_path(self.job.out, leaf).exists()
            for leaf in quarantine.leaves(self.job.out, root)
        ):
            folder.drop_points(self.job.out, root)
