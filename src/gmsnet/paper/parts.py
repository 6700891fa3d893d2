"""Which units each part of the reproduction needs, in the order in which they are done."""

from __future__ import annotations

from collections.abc import Sequence

from gmsnet.paper import convergence, figures, properties, qualities, table3, timing, trainings
from gmsnet.paper.contenders import beyond, papers
from gmsnet.paper.plan import Plan
from gmsnet.paper.store import Store
from gmsnet.paper.units import Batch, Unit, missing

PARTS = ("table1", "table2", "table3", "figures")
TIMED_PLAIN, TIMED, COURSES = "timing in plain Python", "timing compiled", "convergence"
PROPERTIES, TRAINING, QUALITY, THIRD, DRAWING = (
    "properties",
    "training",
    "smoothing",
    "smoothing for Table 3",
    "drawing",
)

NEEDS: dict[str, tuple[str, ...]] = {
    "table1": (TIMED_PLAIN, TIMED, PROPERTIES),
    "table2": (TIMED_PLAIN, TIMED, QUALITY),
    "table3": (TRAINING, THIRD),
    "figures": (COURSES, TRAINING, DRAWING),
}
SIDE_BY_SIDE = (TRAINING, PROPERTIES, QUALITY)  # none needs the result of another: one batch, long units first


def batches(plan: Plan, parts: Sequence[str]) -> list[Batch]:
    """All that these parts need, timings first: they want the machine for themselves."""
    needed = {name for part in parts for name in NEEDS[part]}
    losses = ("cosine", "metric") if "figures" not in parts else tuple(trainings.TITLES)
    units = {
        TIMED_PLAIN: timing.plain_units(plan),
        TIMED: timing.compiled_units(plan),
        COURSES: convergence.units(plan),
        TRAINING: trainings.units(plan, losses),
        PROPERTIES: properties.units(),
        QUALITY: qualities.units(plan, [*papers(), *beyond()]),
        THIRD: table3.units(plan),
        DRAWING: figures.units(),
    }
    made = [Batch(name, units[name], alone=True) for name in (TIMED_PLAIN, TIMED, COURSES) if name in needed]
    together: list[Unit] = [unit for name in SIDE_BY_SIDE if name in needed for unit in units[name]]
    if together:
        made.append(Batch(" and ".join(name for name in SIDE_BY_SIDE if name in needed), together))
    return made + [Batch(name, units[name]) for name in (THIRD, DRAWING) if name in needed]


def complete(plan: Plan, store: Store) -> list[str]:
    """The parts of which everything is there."""
    return [part for part in PARTS if not missing(batches(plan, [part]), store)]
