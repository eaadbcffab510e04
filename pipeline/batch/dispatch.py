"""The tasks of a run: a window of them in flight, and what becomes of each.

Tiles are exploded as they are needed; a cell is ready once all slices of its tiles are. What is ready
goes first, so that the points on disk stay few.
"""

from __future__ import annotations

import logging
from collections import Counter, deque
from collections.abc import Callable
from concurrent.futures import CancelledError
from dataclasses import dataclass
from queue import Empty, Queue
from time import perf_counter
from typing import Any

from pipeline.airborne.grid import Cell, can_split
from pipeline.batch.explode import Slice, exploded, part_path, slices_of
from pipeline.batch.gather import Sources
from pipeline.batch.job import Job, Outcome
from pipeline.batch.ledger import Ledger
from pipeline.batch.plan import Plan
from pipeline.batch.progress import Progress
from pipeline.batch.tasks import do_cell, do_slice, lost
from pipeline.errors import PipelineError

LOGGER = logging.getLogger("treepipe")

TICK_S = 1.0
PATIENCE_S = 600.0
"""How long a run waits while there is no worker at all."""

RETRIES = 1
"""How often a task is tried again after an error that nobody expects."""

MOST_RESUBMISSIONS = 20
"""How often a task may be lost without its own fault, when workers die of others."""

MEMORY_TOPIC = "worker-restart-memory"
"""Where Dask's nannies tell of workers that they ended because of their memory."""


class ClusterLostError(PipelineError, ConnectionError):
    """The scheduler or all workers are gone; what is done stays done."""


@dataclass(frozen=True)
class Flight:
    """A task on its way: the cell, and the cell of the plan that it is a part of; or a slice."""

    name: str
    future: Any
    cell: Cell | None = None
    root: Cell | None = None
    piece: Slice | None = None


class Dispatch:
    """The tasks of a run: what waits, what is ready, and what is on its way."""

    def __init__(self, plan: Plan, job: Job, watch: Callable[[Progress], None]) -> None:
        self.plan, self.job, self.watch = plan, job, watch
        self.ledger = Ledger(plan, job)
        self.progress = self.ledger.progress
        self.open = self.ledger.open
        self.ready: deque[tuple[Cell, Cell]] = deque()
        self.slices: deque[Slice] = deque()
        self.waiting: dict[Cell, set[str]] = {}
        self.flying: dict[str, Flight] = {}
        self.arrived: Queue[str] = Queue()
        self.tries: Counter[str] = Counter()
        self.failures: Counter[str] = Counter()

    def work_through(self, client: Any) -> None:
        """Submit and settle, until nothing is left."""
        self._line_up()
        idle_since = perf_counter()
        room = 4
        while self.ready or self.slices or self.flying:
            while len(self.flying) < room and (self.ready or self.slices):
                self._submit_next(client)
            self.watch(self.progress)
            for flight in self._landed():
                self._settle(client, flight, self._outcome(flight))
            threads = self._threads(client)
            idle_since = perf_counter() if threads else idle_since
            if perf_counter() - idle_since > PATIENCE_S:
                msg = f"{self.job.out}: no worker is left; start some and run the same command again"
                raise ClusterLostError(msg)
            room = max(4, 2 * threads + 2)
        self.watch(self.progress)

    def _line_up(self) -> None:
        """Find what is to be exploded for the cells that are open, and what is ready."""
        needs: dict[int, list[Cell]] = {}
        for root in self.open:
            self.waiting[root] = set()
            for number in self.plan.feeders[root]:
                needs.setdefault(number, []).append(root)
        for number in sorted(needs):
            for piece in slices_of(self.plan.tiles[number]):
                if exploded(piece, needs[number], self.job.points) is None:
                    self.slices.append(piece)
                    for root in needs[number]:
                        self.waiting[root].add(piece.name)
        self.progress.slices = len(self.slices)
        self.needs = {self.plan.tiles[number].fingerprint: tuple(roots) for number, roots in needs.items()}
        for root in sorted(self.open):
            self._ready_if_complete(root)

    def _ready_if_complete(self, root: Cell) -> None:
        if not self.waiting[root]:
            self.ready.extend((cell, root) for cell in sorted(self.open.get(root, ())))

    def _submit_next(self, client: Any) -> None:
        if self.ready:
            cell, root = self.ready.popleft()
            self._submit_cell(client, cell, root)
            return
        piece = self.slices.popleft()
        if any(self.open.get(root) for root in self.needs[piece.tile.fingerprint]):
            self._submit_slice(client, piece)

    def _submit_cell(self, client: Any, cell: Cell, root: Cell) -> None:
        future = self._sent(client, cell.name, do_cell, cell, root, self._sources(root, cell))
        self.flying[future.key] = Flight(cell.name, future, cell=cell, root=root)
        self._call_when_done(future)

    def _submit_slice(self, client: Any, piece: Slice) -> None:
        cells = self.needs[piece.tile.fingerprint]
        future = self._sent(client, piece.name, do_slice, piece, cells, self.plan.frame)
        self.flying[future.key] = Flight(piece.name, future, piece=piece)
        self._call_when_done(future)

    def _sent(self, client: Any, name: str, function: Callable[..., Outcome], *args: Any) -> Any:
        self.tries[name] += 1
        key = f"{self.job.run}-{name}-try{self.tries[name]}"
        return client.submit(function, self.job, *args, key=key, pure=False)

    def _call_when_done(self, future: Any) -> None:
        key, arrived = future.key, self.arrived
        future.add_done_callback(lambda _: arrived.put(key))

    def _sources(self, root: Cell, cell: Cell) -> Sources:
        tiles = tuple(self.plan.tiles[number] for number in self.plan.feeders[root])
        parts = tuple(
            tuple(
                path
                for piece in slices_of(tile)
                if (path := part_path(self.job.points, root, piece)).is_file()
            )
            for tile in tiles
        )
        return Sources(tiles, parts, self.plan.frame, whole=cell == root)

    def _landed(self) -> list[Flight]:
        """Wait a moment for tasks that are done, and return all that are."""
        keys = []
        try:
            keys.append(self.arrived.get(timeout=TICK_S))
            while True:
                keys.append(self.arrived.get_nowait())
        except Empty:
            pass
        return [self.flying.pop(key) for key in keys if key in self.flying]

    def _threads(self, client: Any) -> int:
        msg = f"{self.job.out}: the scheduler is gone; run the same command again to go on"
        if client.status != "running":
            raise ClusterLostError(msg)
        try:
            return sum(client.nthreads().values())
        except (OSError, TimeoutError) as error:
            raise ClusterLostError(msg) from error

    def _outcome(self, flight: Flight) -> Outcome | None:
        """Return what a task returned, or what its loss means; None if only its answer is lost."""
        future = flight.future
        error = None
        try:
            if future.status == "finished":
                outcome: Outcome = future.result()
                return outcome
            if future.status == "error":
                error = future.exception()
        except (CancelledError, TimeoutError, OSError):  # the worker died before it was asked
            return None
        if error is None:
            return None
        if type(error).__name__ != "KilledWorker":
            text = " ".join(f"unexpected {type(error).__name__}: {error}".split())
            return Outcome("failed", error=text, trace=text)
        return Outcome("crashed", deaths=lost(self.job.points / "claims" / flight.name))

    def _settle(self, client: Any, flight: Flight, outcome: Outcome | None) -> None:
        """Decide what follows from an outcome."""
        if outcome is None:
            if self.tries[flight.name] < MOST_RESUBMISSIONS:
                self._again(flight)  # what was done is found there
                return
            outcome = Outcome("failed", error=f"its answer was lost {MOST_RESUBMISSIONS} times")
        if outcome.status == "crashed":
            if self._by_memory(client, outcome):
                outcome = Outcome("memory", error="it needs more memory than a worker has")
            elif len(outcome.deaths) < self.job.attempts and self.tries[flight.name] < MOST_RESUBMISSIONS:
                self._again(flight)  # its worker died of another task
                return
        if outcome.trace and self.failures[flight.name] < RETRIES:
            self.failures[flight.name] += 1
            self._again(flight)
        elif flight.piece is not None:
            self._settle_slice(flight.piece, outcome)
        elif flight.cell is not None and flight.root is not None:
            self._settle_cell(flight.cell, flight.root, outcome)

    def _again(self, flight: Flight) -> None:
        if flight.piece is not None:
            self.slices.appendleft(flight.piece)
        elif flight.cell is not None and flight.root is not None:
            self.ready.appendleft((flight.cell, flight.root))

    def _by_memory(self, client: Any, outcome: Outcome) -> bool:
        """Return whether a nanny ended one of the attempts because of its memory."""
        told = {(event["worker"], event["pid"]) for _, event in client.get_events(MEMORY_TOPIC)}
        return bool(told & set(outcome.deaths))

    def _settle_slice(self, piece: Slice, outcome: Outcome) -> None:
        roots = self.needs[piece.tile.fingerprint]
        if outcome.status == "done":
            self.progress.exploded += 1
            if outcome.facts.get("strays"):
                LOGGER.warning(
                    "%s: %d points lie outside the extent in its header, those far outside are left out; "
                    "write the tile again to mend it",
                    piece.tile.path,
                    outcome.facts["strays"],
                )
        else:
            error = outcome.error or f"{piece.tile.path}: exploding it ends its worker"
            for root in roots:
                for cell in sorted(self.open.get(root, ())):
                    told = Outcome("failed", error=error, trace=outcome.trace)
                    self.ledger.quarantine(cell, root, "tile", told, tile=piece.tile.path)
        for root in roots:
            self.waiting[root].discard(piece.name)
            self._ready_if_complete(root)

    def _settle_cell(self, cell: Cell, root: Cell, outcome: Outcome) -> None:
        if outcome.status == "done":
            self.ledger.finish(cell, root)
        elif outcome.status == "split" or (outcome.status == "memory" and can_split(cell)):
            quarters = self.ledger.split(cell, root, outcome)
            self.ready.extendleft((quarter, root) for quarter in reversed(quarters))
        else:
            self.ledger.quarantine(cell, root, outcome.status, outcome)
