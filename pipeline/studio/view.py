"""A picture that the browser draws: changes are sent at once, the whole of it only to who comes later."""

from __future__ import annotations

import asyncio
from functools import partial
from typing import Any

from trame.widgets import client
from trame_pyvista.widgets import PyVistaLocalView
from trame_vtk.modules.vtk.protocols import vtkWebLocalRendering
from trame_vtk.modules.vtk.serializers import SynchronizationContext, reference_id
from trame_vtk.modules.vtk.serializers.cache import remove_from_cache

from pipeline.studio.shell import Shell

DELTA = "trame.vtk.delta"
REST_S = 0.4
"""How long nothing changes before the whole picture is laid down for browsers that come later."""

HANDLES = [
    {"button": 1, "action": "Rotate"},
    {"button": 1, "action": "Pan", "shift": True},
    {"button": 2, "action": "Pan"},
    {"button": 1, "action": "Zoom", "control": True},
    {"button": 3, "action": "Zoom", "scrollEnabled": True},
]
"""What a drag with a button and a key, or the wheel, does."""

_Base: Any = PyVistaLocalView


class View(_Base):  # type: ignore[misc]  # of a package without types
    """A view of a plotter's scene, drawn by the browser.

    The one it is made from sends every change twice: as a change, and as the whole picture, which only a
    browser reads that has not drawn yet. Here the whole is put off until nothing changes for a while, but the
    first, without which a browser would take no change for its own; and a browser that listens is sent it at
    once, and stands where the last look was, for it has missed what changed while it loaded. A browser that
    asks late for arrays of a picture that is gone gets empty ones, rather than an error after which it would
    draw no more. And what is hidden is sent whole when it is shown again, because the browser has thrown it
    away.

    Parameters
    ----------
    shell : Shell
    plotter : pyvista.Plotter
    **style
        Attributes of the element.
    """

    def __init__(self, shell: Shell, plotter: Any, **style: Any) -> None:
        self._shell = shell
        self._later: asyncio.TimerHandle | None = None
        self._is_laid_down = False
        named = f"'{plotter._id_name}'"
        super().__init__(plotter, context_name=named, interactor_settings=("handles", HANDLES), **style)
        self._camera = f"camera_{self.ref_name}"
        self.server.state[self._camera] = None
        self.server.controller.on_server_ready.add(lambda **_: _forgive(self.server))
        self.server.controller.trigger(arrived := f"arrived_{self.ref_name}")(self._send_whole)
        stands = f"{self._camera} && trame.refs['{self.ref_name}'].setCamera({self._camera})"
        client.ClientTriggers(mounted=f"{stands}; trigger('{arrived}')", ref=arrived)

    def update(self, **_given: Any) -> None:
        """Send what has changed."""
        if self.server.protocol:
            self.server.protocol.publish(DELTA, self._scene(whole=False))
            if self._later:
                self._later.cancel()
            if self._is_laid_down:
                self._later = self._shell.later(REST_S, self._lay_down)
            else:
                self._lay_down()

    def push_camera(self, *given: Any, **named: Any) -> None:
        """Let browsers stand where the plotter's camera stands, those too that come later."""
        camera = self.plotter.camera
        self.server.state[self._camera] = {
            "position": camera.GetPosition(),
            "focalPoint": camera.GetFocalPoint(),
            "viewUp": camera.GetViewUp(),
        }
        super().push_camera(*given, **named)

    def _send_whole(self) -> None:
        """Send the whole picture to a browser that has come; to the others it is what they have."""
        self.server.protocol.publish(DELTA, self._scene(whole=True))

    def _lay_down(self) -> None:
        self._is_laid_down = True
        self.server.state[f"scene_{self.ref_name}"] = self._scene(whole=True)

    def _scene(self, *, whole: bool) -> Any:
        made = self._helper.scene(self.plotter.render_window, new_state=whole, widgets=self._widgets)
        for actor in self.plotter.renderer.actors.values():
            if not actor.visibility:
                for part in (actor, actor.prop, actor.mapper):
                    remove_from_cache(reference_id(part))
        return made


def _forgive(server: Any) -> None:
    """Let a server answer with nothing when it is asked for an array that it has given up."""
    for protocol in server.protocol.getLinkProtocols():
        if isinstance(protocol, vtkWebLocalRendering):
            protocol.context.get_cached_data_array = partial(_array, protocol.context)


def _array(context: Any, key: str, *given: Any, **named: Any) -> Any:
    known = key in context.data_array_cache
    return SynchronizationContext.get_cached_data_array(context, key, *given, **named) if known else b""
