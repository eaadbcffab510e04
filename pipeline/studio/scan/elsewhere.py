"""A process for what takes long: the page answers meanwhile, and the work can be ended at once."""

from __future__ import annotations

import signal
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import ParamSpec, TypeVar

from pipeline.errors import PipelineError
from pipeline.jobs.crew import one_thread
from pipeline.studio.worker import sentence_of

P = ParamSpec("P")
R = TypeVar("R")

LOOK_S = 0.05  # how often it is looked whether the result is there, or still wanted

DIED = (
    "the process at work was ended from outside (exit code {code}), most often for want of memory; "
    "thin the points with a larger clean.voxel_m"
)


class ElsewhereError(PipelineError, RuntimeError):
    """Work in another process has failed in a way that nobody has foreseen."""


class Elsewhere:
    """Calls functions in a process of its own, one after the other; a call can be broken off.

    The process begins with the first call, and anew after one that was broken off. It ends with this
    one, however that ends.
    """

    def __init__(self) -> None:
        self._line: Connection | None = None
        self._process: BaseProcess | None = None

    def call(
        self, function: Callable[P, R], wanted: Callable[[], None], *inputs: P.args, **named: P.kwargs
    ) -> R:
        """Return what a function of a module makes of its inputs.

        Parameters
        ----------
        function : callable
        wanted : callable
            Is called all the while; what it raises breaks the work off.
        *inputs, **named
            For the function; like its result they can be pickled.

        Raises
        ------
        PipelineError
            As the function raises it.
        ElsewhereError
            If it raises anything else, or its process dies.
        """
        line = self._begun()
        try:
            with suppress(OSError):  # that the process is dead is found below
                line.send((function, inputs, named))
            while not line.poll(LOOK_S):
                wanted()
            result, error = line.recv()
        except (EOFError, OSError) as gone:
            code = self.end()
            raise ElsewhereError(DIED.format(code=code)) from gone
        except BaseException:
            self.end()
            self._begun()  # so that it is ready for what comes next
            raise
        if error is not None:
            raise error
        made: R = result
        return made

    def end(self) -> int | None:
        """End the process, whatever it does; return its exit code."""
        process, line = self._process, self._line
        self._process = self._line = None
        if process is None or line is None:
            return None
        line.close()
        process.join(LOOK_S)
        process.kill()
        process.join()
        return process.exitcode

    def _begun(self) -> Connection:
        if self._line is not None:
            return self._line
        one_thread()  # sums of linear algebra are then in the order of the command line
        context = get_context("spawn")
        self._line, far_end = context.Pipe()
        self._process = context.Process(target=_serve, args=(far_end,), name="studio scan", daemon=True)
        self._process.start()
        far_end.close()  # else the end of the process would go unnoticed
        return self._line


def _serve(line: Connection) -> None:
    """Call what comes down the line, until it is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent decides
    with suppress(EOFError, OSError):
        while True:
            function, inputs, named = line.recv()
            line.send(_outcome(function, inputs, named))


def _outcome(
    function: Callable[..., R], inputs: tuple[object, ...], named: dict[str, object]
) -> tuple[R | None, PipelineError | None]:
    """Return a result, or the error that stands in its place."""
    try:
        return function(*inputs, **named), None
    except PipelineError as error:
        return None, error
    except Exception as error:  # the page says so, and goes on
        return None, ElsewhereError(sentence_of(error))
