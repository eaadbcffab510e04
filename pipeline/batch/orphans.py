"""What every worker of our own loads: it ends with its driver, by whatever cause that ends.

Dask ends a worker whose driver is gone from a thread of the worker's own, which waits while compiled code
runs: a tree, or half a minute. The kernel does not wait, but knows of the process alone that workers are
forked from. That one stays for as long as it or a worker holds a pipe open; the workers close theirs, so
that it ends with the driver, and they with it. Linux alone has this; elsewhere there is Dask's thread.

References
----------
prctl(2), PR_SET_PDEATHSIG.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from multiprocessing import forkserver

PR_SET_PDEATHSIG = 1
"""As <linux/prctl.h> has it."""


def dask_setup(_worker: object) -> None:
    """Ask the kernel for the end of this process as soon as its parent has ended; Dask calls it."""
    if sys.platform != "linux":
        return
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, int(signal.SIGKILL), 0, 0, 0)
    server = getattr(forkserver, "_forkserver", None)  # private: where it is not, Dask's thread remains
    pipe = getattr(server, "_forkserver_alive_fd", None)
    if pipe is not None:
        os.close(pipe)
        setattr(server, "_forkserver_alive_fd", None)  # noqa: B010 (of a type that does not tell it)
