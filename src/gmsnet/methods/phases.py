"""The phases of the default method, and in which order meshes of a kind go through them (methods/auto.py)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from gmsnet.methods.above import Above
from gmsnet.methods.barrier import Barrier
from gmsnet.methods.base import Smoother
from gmsnet.methods.flat_in_space import OnQ
from gmsnet.methods.optimize import Newton
from gmsnet.methods.to_the_end import ToTheEnd
from gmsnet.methods.worst_first import CYCLES, LAST, WorstFirst
from gmsnet.topology.mixed_volume import MixedVolume
from gmsnet.topology.shell import Shell
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

SMALL, LARGE_VOLUME = 5000, 50_000  # free nodes
ALWAYS = 10**9  # sweeps
RELAXATION = 1.6  # of the Newton steps
LONGER, LONGEST = 1.8, 1.9  # the same of quads, and of surfaces, where long waves are left
IDEAL = 0.99  # a least 1/q at which the worst cells have no turn, nor what follows


class Phase(NamedTuple):
    """name: for the record. create: its smoother. sweeps: how many, unless it has settled before.

    first: how many for the first time, if others. rounds: how often it is made at most. gain: what must be to come, in
    the mean of 1/q, for it to be made once more; least: what the last round must have gained for that. lasting: with
    less than this share of the gain before, no nodes creep: so gains fall where short waves are left, which sweeps even
    out. looks: whether the mesh is measured after it; late: not if the worst cells have another turn. often: after so
    many rounds of it, too. between: the worst cells have their next turn after it, and it is left out after their last.
    falling: on volumes, it goes on where the sum of q^(3/2) falls still, by this share at first (gains.Falling).
    """

    name: str
    create: Callable[[], Smoother]
    sweeps: int
    first: int = 0
    rounds: int = 1
    gain: float = math.inf
    least: float = 0.0
    lasting: float = 0.0
    looks: bool = True
    often: int = 4
    late: bool = False
    between: bool = False
    falling: float = 0.0


def newton(relaxation: float = RELAXATION, *, means: int = 0) -> Barrier:
    """Newton steps on Σq, over-relaxed throughout: where many sweeps are needed, it halves them."""
    return Barrier("q", relaxation, ALWAYS, means)


def worst_first(more: int, enough: float = math.inf) -> WorstFirst:
    """The list of cycles, and so many times the highest powers, in one sweep: one guard and one ranking for all.

    enough: a least 1/q of which nothing more is asked.
    """
    cycles = CYCLES + LAST * more
    return WorstFirst(cycles, len(cycles), enough)


NEWTON = Phase("Newton on q", lambda: newton(means=1), 2, first=3, rounds=40, gain=0.006)
WORST = Phase("worst first", lambda: worst_first(3), 1)
MEAN = Phase("Newton on q, worst kept", newton, 1, rounds=10, gain=0.002)
SHORT = WORST._replace(create=lambda: worst_first(0))
LONG = Phase("Newton on q, to its end", lambda: newton(1.85, means=1), 4, first=4, rounds=8, gain=0.00005)
ABOVE = Phase("MetricLoss, above 1/q = 0.4", lambda: Newton("metric", floor=0.4), 1, rounds=8, gain=0.0003)
POLISH = Phase("MetricLoss, worst kept", lambda: Newton("metric", floor=0.0), 1, rounds=8, gain=0.0003)

LARGE_PLAN = (NEWTON._replace(looks=False), WORST._replace(looks=False), MEAN)
MEAN_OF_QUADS = MEAN._replace(
    create=lambda: newton(LONGER), gain=0.0003, least=0.0002, lasting=math.inf, rounds=20, often=20, late=True
)
# Quads gain for longer, and what the mean takes back from the worst of them is worth another turn. Cells beside the
# worst ones become the worst more often than triangles do, so that these are looked for anew.
QUADS_PLAN = (
    NEWTON._replace(gain=0.0008, least=0.0008, lasting=0.8, looks=False, often=10),
    WORST._replace(create=lambda: worst_first(3, IDEAL), sweeps=3, looks=False),
    MEAN_OF_QUADS._replace(looks=False),
    WORST._replace(create=lambda: worst_first(6, IDEAL), sweeps=3, looks=False),
    MEAN_OF_QUADS._replace(gain=0.0002, least=0.0001),
)
SMALL_PLAN = (LONG, ABOVE, SHORT, POLISH)
# Of volumes; q there is the mean ratio to the power of 3/2.
ON_Q = Phase("Newton on q", lambda: OnQ("q", 1.3, ALWAYS), 1, first=3, rounds=20, gain=0.002, looks=False)
IN_SPACE_WORST = Phase("worst first", WorstFirst, 1, looks=False)
ROOM = Phase("room for the worst", lambda: Above(0.17, 3, 1.0), 1, looks=False, between=True)
VOLUME_PLAN = (
    ON_Q._replace(falling=0.008),
    IN_SPACE_WORST,
    ROOM,
    Phase("mean, worst kept", lambda: Above(0.0, 5, 0.03, 1.6), 1, rounds=40, gain=0.00002, looks=False),
)
LARGE_VOLUME_PLAN = (
    ON_Q._replace(first=1, rounds=2, falling=0.08),
    Phase("Newton above a wall", lambda: Above(0.23, 2, 1.0), 1, looks=False),
    IN_SPACE_WORST,
    ROOM._replace(between=False),
    IN_SPACE_WORST._replace(create=lambda: WorstFirst(share=0.5)),
    ROOM,
    VOLUME_PLAN[-1]._replace(create=lambda: Above(0.0, 4, 0.05), rounds=10, gain=0.0015),
)
LONG_WAVES = Phase("Newton on q", lambda: newton(LONGEST), 2, rounds=500, gain=0.0003, least=0.0001)._replace(
    lasting=0.85, looks=False, often=1000
)
# Of surfaces; long waves are left to sweeps, and what high powers take from the mean comes back last.
SURFACE_PLAN = (
    NEWTON._replace(looks=False),
    LONG_WAVES,
    WORST._replace(create=lambda: worst_first(3, IDEAL), looks=False),
    MEAN._replace(gain=0.001),
)


# Of other volumes, grids among which have an ideal mesh.
MIXED_PLAN = (
    ON_Q._replace(create=lambda: Barrier("q", 1.3, ALWAYS), falling=0.02),
    IN_SPACE_WORST,
    Phase("Newton on q, worst kept", lambda: Barrier("q", 1.0, ALWAYS), 1, rounds=10, gain=0.0005),
    Phase("Newton on q, in float64", ToTheEnd, 1),
)
IN_SPACE = (VOLUME_PLAN, LARGE_VOLUME_PLAN, MIXED_PLAN, SURFACE_PLAN)


def plan_for(topology: Topology | Volume, free: int) -> Sequence[Phase]:
    """The phases for a mesh of so many free nodes and these cells."""
    if isinstance(topology, Volume):
        if isinstance(topology, MixedVolume):
            return MIXED_PLAN
        return VOLUME_PLAN if free <= LARGE_VOLUME else LARGE_VOLUME_PLAN
    if isinstance(topology, Shell):
        return SURFACE_PLAN
    if free <= SMALL:
        return SMALL_PLAN
    return LARGE_PLAN if topology.near_shapes is None else QUADS_PLAN
