"""Surfaces whose facets have gone far from the input's: they are smoothed once more, with a bound for facets.

Nodes that leave the round end of a body leave facets behind that are chords. To look at facets all along would take
several times as long (``hausdorff``), and few surfaces need it: so it is looked at in the end. Only small ones are, for
where facets are small none can go as far.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields

from gmsnet.measure.surface_change import FAR, SurfaceChange
from gmsnet.run.options import SmoothOptions
from gmsnet.run.stop import CALLBACK, INTERRUPTED
from gmsnet.topology.shell import Shell
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

SMALL = 4000  # nodes of the mesh: looking takes a third of the time of the sweeps
NOTE = (
    f"hausdorff: facets had gone more than {FAR:g} of the diagonal from the input's, as where nodes leave tight "
    "curves, so the surface was smoothed once more with that as a bound; hausdorff=1 leaves it out"
)


class Bounded(SmoothOptions):
    """The options of a second run."""


def goes_too_far(
    options: SmoothOptions, stop_reason: str, topology: Topology | Volume, look: Callable[[], SurfaceChange | None]
) -> bool:  # fmt: skip
    """Is the surface to be smoothed once more? stop_reason: of the run; topology: of its mesh. look: what has become of
    the surface, which takes a while.
    """
    free = options.hausdorff is None and options.geometry is None and not options.target
    if not free or stop_reason in (CALLBACK, INTERRUPTED):
        return False
    if not isinstance(topology, Shell) or len(topology.memory) > SMALL:
        return False
    change = look()
    return change is not None and change.hausdorff > FAR * change.diagonal


def bounded(options: SmoothOptions) -> Bounded:
    """The options of the second run."""
    given = {each.name: getattr(options, each.name) for each in fields(options)}
    return Bounded(**{**given, "hausdorff": FAR})
