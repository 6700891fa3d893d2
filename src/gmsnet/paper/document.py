"""All that a reproduction found, as plain values: what reproduction.json holds and the page shows."""

from __future__ import annotations

import os
import platform
import statistics
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

from gmsnet.learn.losses import LOSSES
from gmsnet.paper import parts, properties, study, table2, table3, timing, trainings
from gmsnet.paper.claims import claims
from gmsnet.paper.figures import PICTURES
from gmsnet.paper.plan import Plan
from gmsnet.paper.store import Store, strict
from gmsnet.parallel.threads import available_threads

PACKAGES = ("gmsnet", "numpy", "scipy", "numba", "torch", "torch_geometric", "matplotlib")


def collect(plan: Plan, store: Store, shown: Sequence[str]) -> dict[str, Any]:
    """The parts that are shown, and what follows from them."""
    made: dict[str, Any] = {
        "options": {**plan.fingerprint(), "epochs": plan.epochs, "training_seeds": plan.training_seeds},
        "machine": machine(),
        "versions": {"python": platform.python_version(), **{name: version(name) for name in PACKAGES}},
        "seconds": {
            batch.title: sum(store.seconds(unit.name) for unit in batch.units) for batch in parts.batches(plan, shown)
        },
    }
    if "table1" in shown:
        made["table1"] = properties.document(store)
    if "table2" in shown:
        made["table2"] = {**table2.document(plan, store), "ratios": timing.ratios(store)}
    if "table3" in shown:
        made["table3"] = table3.document(plan, store)
    if "figures" in shown:
        made["study"] = _study(plan, store)
        figures = {picture.name: store.load(picture.unit.name) for picture in PICTURES}
        made["raw_moves"] = figures["raw-moves"]["facts"]
        made["figures"] = [{"name": name, **values} for name, values in figures.items()]
    made["claims"] = [asdict(claim) for claim in claims(made)]
    plain: dict[str, Any] = strict(made)
    return plain


def machine() -> dict[str, Any]:
    """What the timings are of."""
    return {"processor": _processor(), "processors": available_threads(), "system": platform.system()}


def _processor() -> str:
    """Its name, where the system tells it."""
    information = Path("/proc/cpuinfo")
    if os.access(information, os.R_OK):
        for line in information.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _study(plan: Plan, store: Store) -> dict[str, Any]:
    found = study.study(plan, store)
    losses = {}
    for loss in LOSSES:
        those = found.of(loss)
        settled = [each.settled for each in those if each.converged and each.settled is not None]
        losses[loss] = {
            "title": trainings.TITLES[loss],
            "trainings": len(those),
            "converged": found.converged(loss),
            "diverged": sum(each.ending == "diverged" for each in those),
            "epochs": [each.epochs for each in those],
            "end": [each.end for each in those],
            "gain": [each.gain for each in those],
            "worse": statistics.median(each.worse for each in those),
            "swings": [each.swing for each in those],
            "swing": statistics.median(each.swing for each in those),
            "settled": statistics.median(settled) if settled else None,
        }
    return {"rule": study.RULE, "before": found.before, "optimum": found.optimum, "losses": losses}
