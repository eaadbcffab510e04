"""Ctrl-C that is not lost: an interrupt that falls into a finaliser is sent once more."""

from __future__ import annotations

import os
import signal
import sys
import threading
from typing import Any

AGAIN_S = 0.05


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
