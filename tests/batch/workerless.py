"""A cluster without processes: what is submitted is done at once, or comes to the end that a test wants."""

from __future__ import annotations

from concurrent.futures import CancelledError

from pipeline.batch.dispatch import MEMORY_TOPIC


class Client:
    """Runs every task at once, in this process; `fate` may say what becomes of it instead."""

    status = "running"

    def __init__(self, fate=None, events=()) -> None:
        self.fate, self.events, self.keys = fate or (lambda _, run: run()), events, []

    def submit(self, function, *arguments, key, pure):
        """Run a task."""
        assert not pure
        self.keys.append(key)
        return Future(key, self.fate, lambda: function(*arguments))

    def nthreads(self) -> dict[str, int]:
        """Return threads by worker."""
        return {"worker": 1}

    def get_events(self, topic):
        """Return what nannies told."""
        assert topic == MEMORY_TOPIC
        return [(0.0, event) for event in self.events]


class Future:
    """The end of a task."""

    def __init__(self, key, fate, run) -> None:
        self.key = key
        try:
            self.value, self.error, self.status = fate(key, run), None, "finished"
        except Exception as error:
            self.value, self.error, self.status = None, error, "error"

    def result(self):
        """Return what it returned."""
        return self.value

    def exception(self):
        """Return its error; that its answer is lost is raised."""
        if isinstance(self.error, CancelledError):
            raise self.error
        return self.error

    def add_done_callback(self, call):
        """Call at once: it is done."""
        call(self)


class Given:
    """Stands for `pipeline.batch.cluster.cluster`."""

    def __init__(self, *_inputs, **_options) -> None:
        self.client = Client()

    def __enter__(self) -> tuple[Client, str]:
        return self.client, ""

    def __exit__(self, *_: object) -> None:
        return
