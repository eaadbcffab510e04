"""Finding out whether this machine can draw, before a graphics library ends the program over it."""

from __future__ import annotations

import ctypes
import os
import sys
from functools import cache

from pipeline.errors import PipelineError

SURFACELESS = 0x31DD
"""EGL_PLATFORM_SURFACELESS_MESA: drawing without any window system."""

REMEDY = "install the libraries with `apt-get install libegl1 libgl1`, or go without with --no-picture"


class NoGraphicsError(PipelineError, RuntimeError):
    """No graphics on this machine; the text names the libraries to install."""


def prepare() -> None:
    """Let VTK draw off screen: by EGL where there is no window system.

    Call it before pyvista is imported.

    Raises
    ------
    NoGraphicsError
        If neither EGL nor a window system is there.
    """
    if not sys.platform.startswith("linux"):
        return
    if has_egl() and _has_library("libGL.so.1"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    elif not os.environ.get("DISPLAY"):
        msg = f"no picture can be drawn: this machine has no working EGL and no display; {REMEDY}"
        raise NoGraphicsError(msg)


@cache
def has_egl() -> bool:
    """Tell whether EGL is installed and finds something to draw with (a card or Mesa's software)."""
    try:
        egl = ctypes.CDLL("libEGL.so.1")
        egl.eglGetDisplay.restype = egl.eglGetPlatformDisplay.restype = ctypes.c_void_p
        egl.eglGetDisplay.argtypes = [ctypes.c_void_p]
        egl.eglGetPlatformDisplay.argtypes = [ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p]
        egl.eglInitialize.argtypes = [ctypes.c_void_p] * 3
        displays = egl.eglGetPlatformDisplay(SURFACELESS, None, None), egl.eglGetDisplay(None)
        return any(display and egl.eglInitialize(display, None, None) for display in displays)
    except (OSError, AttributeError):  # the library, or a function of it, is missing
        return False


def _has_library(name: str) -> bool:
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True
