"""Ctrl-C that is neither lost nor loud: held back while a process starts, sent again if it gets lost."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from typing import Any

AGAIN_S = 0.05


@contextmanager
def held_back() -> Iterator[None]:
    """Hold Ctrl-C back, from this thread and from the processes that it starts, until they ask for it.

    A process that is interrupted while it still imports prints a traceback, whatever it does about
    interrupts later.
    """
    if not hasattr(signal, "pthread_sigmask"):  # not on Windows
        yield
        return
    resource_tracker.ensure_running()  # it lets interrupts through when it starts
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def let_through() -> None:
    """Let interrupts reach this process again, as it has chosen to take them."""
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def resend_lost_interrupts(number: signal.Signals) -> None:
    """Send `number` to this process again when the interrupt it caused could not be raised.

    Python ignores exceptions in finalisers (of compiled code, say) and prints them; an interrupt
    that ends there would be neither obeyed nor quiet.
    """

    def hook(unraisable: Any) -> None:
        if unraisable.exc_type is not None and issubclass(unraisable.exc_type, KeyboardInterrupt):
            threading.Timer(AGAIN_S, os.kill, (os.getpid(), number)).start()
        else:
            sys.__unraisablehook__(unraisable)

    sys.unraisablehook = hook
