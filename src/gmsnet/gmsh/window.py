"""Gmsh's own window with a button that smooths the mesh in it."""

from __future__ import annotations

import json
from typing import Any

from gmsnet.errors import GmsnetError
from gmsnet.gmsh.smoothing import HOLD, SLIDE, smooth

ACTION, BUTTON, SMOOTH = "ONELAB/Action", "ONELAB/Button", "gmsnet: smooth"
TARGET, GEOMETRY, LAYERS = "gmsnet/1Target quality", "gmsnet/2Nodes on CAD curves", "gmsnet/3Layers of stretched cells"
HELD, SLIDING, STAY, FREE = "stay", "slide", "stay", "smoothed, too"
PARAMETERS: list[dict[str, object]] = [
    {"type": "string", "name": BUTTON, "values": ["Smooth", SMOOTH], "visible": False},
    {"type": "number", "name": TARGET, "values": [0], "min": 0, "max": 1, "step": 0.05,
     "help": "Smooth only around cells with a lower 1/q; 0: smooth all"},
    {"type": "string", "name": GEOMETRY, "values": [HELD], "choices": [HELD, SLIDING]},
    {"type": "string", "name": LAYERS, "values": [STAY], "choices": [STAY, FREE]},
]  # fmt: skip


def offer(gmsh: Any) -> None:
    """Puts the button and the options into the menu of the window."""
    gmsh.onelab.set(json.dumps(PARAMETERS))


def carry_out(gmsh: Any) -> bool:
    """Does what a button of the window has asked for. Returns whether that was to smooth.

    What is to be told of it goes to Gmsh's log, errors as well.
    """
    asked = list(gmsh.onelab.getString(ACTION))[:1]
    if asked == ["check"]:  # another file is open: it has cleared all parameters
        gmsh.onelab.setString(ACTION, [""])
        if not gmsh.onelab.getNames("gmsnet/.*"):
            offer(gmsh)
    if asked != [SMOOTH]:
        return False
    gmsh.onelab.setString(ACTION, [""])
    try:
        _smooth(gmsh)
    except GmsnetError as error:
        gmsh.logger.write(f"gmsnet: {error}", "warning")  # Gmsh raises errors
    return True


def _smooth(gmsh: Any) -> None:
    target = float(gmsh.onelab.getNumber(TARGET)[0])
    result = smooth(
        gmsh=gmsh,
        on_geometry=SLIDE if gmsh.onelab.getString(GEOMETRY)[0] == SLIDING else HOLD,
        preserve="none" if gmsh.onelab.getString(LAYERS)[0] == FREE else "shape",
        target_quality=target or None,
    )
    for line in repr(result).splitlines():
        gmsh.logger.write(f"gmsnet: {line}")


def run(gmsh: Any, path: str) -> None:
    """Opens a file in Gmsh's window, and smooths when the button is pressed, until the window is closed.

    The module must not be initialised yet: a process can have one window only.
    """
    gmsh.initialize([], False)  # the options of the command line are ours
    try:
        gmsh.option.setNumber("General.Terminal", 1)
        gmsh.open(path)
        offer(gmsh)
        gmsh.fltk.initialize()
        while gmsh.fltk.isAvailable():
            gmsh.fltk.wait()
            if carry_out(gmsh):
                gmsh.graphics.draw()
    finally:
        gmsh.finalize()
