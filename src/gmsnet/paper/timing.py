"""Seconds per node: in the paper's setting, plain Python and PyTorch one node at a time, and compiled.

Methods take turns, so that what else the machine does falls on all of them; medians are taken. Both are seconds of the
processor, of one thread.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from gmsnet.measure.report import ASPECT
from gmsnet.mesh.mesh import Mesh
from gmsnet.paper import plain, plain_torch
from gmsnet.paper.cases import CASES
from gmsnet.paper.contenders import GETME, GMSNET, LAPLACIAN, NN, OPTIM, Contender, beyond, papers, papers_own
from gmsnet.paper.plain import Move, PlainMesh
from gmsnet.paper.plain_getme import PlainGetme
from gmsnet.paper.plan import Plan
from gmsnet.paper.store import Result, Store
from gmsnet.paper.units import Context, Unit
from gmsnet.parallel.threads import serial
from gmsnet.run.options import SmoothOptions
from gmsnet.run.run import Run, Start
from gmsnet.topology.topology import Topology

MOST_TESTS = 1000  # of a sweep
CHUNK = 30  # nodes that a method visits before it is the next one's turn
Visits = Callable[[list[int]], int]  # visits about as many nodes as are given, tells how many they were


def plain_units(plan: Plan) -> list[Unit]:
    """The paper's setting, one for each case."""
    return [Unit(f"timing-plain/{case}", time_plain, {"case": case}) for case in CASES]


def compiled_units(plan: Plan) -> list[Unit]:
    """Compiled, one for each case."""
    return [Unit(f"timing-compiled/{case}", time_compiled, {"case": case}) for case in CASES]


def time_plain(context: Context, case: str) -> Result:
    """The paper's methods in one framework: what a node costs, gathering, truncation and update included."""
    mesh = CASES[case].mesh(0, context.plan.seed)
    topology = Topology.of(mesh)
    nodes = np.random.default_rng(context.plan.seed).permutation(topology.free)[: context.plan.timed_nodes].tolist()
    visits = {each.key: _visits(each, mesh, topology) for each in papers()}
    for visit in visits.values():
        visit(nodes[:1])  # libraries load what they need
    seconds: dict[str, list[float]] = {key: [] for key in visits}
    for first in range(0, len(nodes), CHUNK):
        for key, visit in visits.items():
            context.go_on()
            began = time.process_time()
            visited = visit(nodes[first : first + CHUNK])
            seconds[key].append((time.process_time() - began) / visited)
    return Result({"nodes": len(nodes), "seconds_per_node": _medians(seconds)})


def _visits(contender: Contender, mesh: Mesh, topology: Topology) -> Visits:
    """A method of the paper on a plain mesh of its own."""
    plain_mesh = PlainMesh.of(mesh, topology)
    if contender.printed == GETME:
        getme = PlainGetme(plain_mesh)  # with its heap, which a run makes once

        def steps(nodes: list[int]) -> int:
            moved = 0
            while moved < len(nodes):
                moved += getme.step()
            return moved

        return steps
    move = moves()[contender.printed]()

    def each(nodes: list[int]) -> int:
        plain.sweep(plain_mesh, move, nodes)
        return len(nodes)

    return each


def moves() -> Mapping[str, Callable[[], Move]]:
    """Name in the paper → what makes its move; for all but GETMe, which moves elements."""
    return {
        LAPLACIAN: lambda: plain.smart_laplacian,
        "AngleSmoothing": lambda: plain.angle,
        "CVTSmoothing": lambda: plain.cvt,
        OPTIM: plain_torch.optim_smoothing,
        NN: plain_torch.nn_smoothing,
        GMSNET: plain_torch.gmsnet,
    }


def time_compiled(context: Context, case: str) -> Result:
    """All methods compiled, on one thread: the first sweeps over the mesh as it comes, repeated from the start."""
    mesh = CASES[case].mesh(0, context.plan.seed)
    topology = Topology.of(mesh)
    contenders = [*papers(), *beyond()]
    seconds: dict[str, list[float]] = {each.key: [] for each in contenders}
    for repeat in range(-1, context.plan.timed_repeats):  # the first time they are compiled, and not counted
        for each in contenders:
            context.go_on()
            taken = _sweeps(each, mesh, topology, context.plan.timed_sweeps)
            if repeat >= 0:
                seconds[each.key] += taken
    return Result({"nodes": len(topology.free), "seconds_per_node": _medians(seconds)})


def _sweeps(contender: Contender, mesh: Mesh, topology: Topology, count: int) -> list[float]:
    """Seconds per node of each of the first sweeps; an element method may visit nodes more than once in a sweep."""
    method = contender.smoother()
    field = Run(Start.of(mesh, topology), method, SmoothOptions(best_by=ASPECT, guard="valid")).field
    taken = []
    for _ in range(count):
        gains = count_down(MOST_TESTS)
        began = time.process_time()
        moved, _, dropped = method.sweep(field, serial, gains).tolist()
        taken.append((time.process_time() - began) / max(len(topology.free), moved + dropped))
    return taken


def count_down(times: int) -> Callable[[], bool]:
    """A test that a mesh passes so many times: as if each were the best so far, but not for ever."""
    left = iter([True] * times)
    return lambda: next(left, False)


def _medians(seconds: Mapping[str, list[float]]) -> dict[str, float]:
    return {key: statistics.median(values) for key, values in seconds.items()}


def per_node(store: Store, case: str) -> dict[str, dict[str, float | None]]:
    """Method → its seconds per node in both settings; None where it was not timed."""
    settings = {"plain": f"timing-plain/{case}", "compiled": f"timing-compiled/{case}"}
    found = {setting: store.load(name)["seconds_per_node"] for setting, name in settings.items() if store.holds(name)}
    keys = [each.key for each in (*papers(), *beyond())]
    return {key: {setting: found.get(setting, {}).get(key) for setting in settings} for key in keys}


def ratios(store: Store) -> dict[str, Any]:
    """OptimSmoothing over GMSNet in both settings: case → ratio, and their mean."""
    optim, gmsnet = (papers_own(name).key for name in (OPTIM, GMSNET))
    made: dict[str, Any] = {}
    for setting in ("plain", "compiled"):
        found = {}
        for case in CASES:
            seconds = per_node(store, case)
            slow, fast = seconds[optim][setting], seconds[gmsnet][setting]
            found[case] = slow / fast if slow and fast else None
        known = [value for value in found.values() if value is not None]
        made[setting] = {"cases": found, "mean": statistics.fmean(known) if len(known) == len(found) else None}
    return made
