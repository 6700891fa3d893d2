"""Sweeps on a GPU of NVIDIA beside those on threads: the same bits, the time, and the share of the card's bandwidth.

python benchmarks/gpu.py                  1e5 and 1e6 nodes, threads 1 to as many as there are
python benchmarks/gpu.py --bits           200 small meshes in all ways that a GPU can do, bits and counts compared
python benchmarks/gpu.py --calls          whole calls, with setting up and all looks
"""

from __future__ import annotations

import argparse
import itertools
import os
import time
from collections.abc import Callable

import numpy as np

import gmsnet
from gmsnet import generate
from gmsnet.cuda import executor as accelerated
from gmsnet.cuda.library import checked
from gmsnet.methods import METHODS, Field, MethodOptions, Smoother
from gmsnet.parallel.threads import Threads, serial
from gmsnet.run.run import Start
from gmsnet.topology.topology import Topology

REPEATS = 9
WAYS = (
    ("barrier", {"objective": "q2"}), ("laplacian", {"variant": "smart"}), ("laplacian", {"variant": "plain"}),
    ("gmsnet", {"variant": "metric"}),
)  # fmt: skip


def mesh_of(kind: str, nodes: int, seed: int) -> gmsnet.Mesh:
    return (
        generate.random_mesh(nodes, seed=seed) if kind == "triangles" else generate.random_quad_mesh(nodes, seed=seed)
    )


def milliseconds(work: Callable[[], object], repeats: int = REPEATS) -> float:
    work()
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return 1e3 * float(np.median(times))


def bandwidth(module) -> float:
    """Bytes a second that a copy within the card's memory reads and writes."""
    one, other = (module.to_device(np.zeros(2**27)) for _ in range(2))

    def copy() -> None:
        other.copy_to_device(one)
        module.synchronize()

    return 2 * 8 * 2**27 / (1e-3 * milliseconds(copy))


def sweeps(mesh: gmsnet.Mesh) -> None:
    module, kind = checked(), mesh.cells[0].kind
    topology = Topology.of(mesh, threads=2)
    start, free, stars = Start.of(mesh, topology), len(topology.free), topology.stars
    rate = bandwidth(module)
    print(
        f"\n{kind}s, {free:,} free nodes, {stars.colours} colours; the card copies {rate / 1e12:.2f} TB/s", flush=True
    )
    counts = [1 << k for k in range(20) if 1 << k <= len(os.sched_getaffinity(0))]
    for name, chosen in WAYS:
        if kind != "triangle" and name == "gmsnet":
            continue
        with accelerated.gpu(1) as card:
            results = []
            line = f"{name} {next(iter(chosen.values()))}:"
            for executor in [serial, *(Threads(count) for count in counts[1:]), card]:
                smoother = METHODS[name].create(MethodOptions(**chosen))
                field = Field(start.points.copy(), topology, start.precision)
                took = milliseconds(lambda s=smoother, f=field, e=executor: s.sweep(f, e, lambda: False))
                results.append(field.points)
                line += f" {took:.2f}" if executor is not card else f" | card {took:.2f} ms"
                if isinstance(executor, Threads) and executor is not card:
                    executor.close()
            alone, needed = kernel_alone(card, smoother, stars, field)
            same = all(points.tobytes() == results[0].tobytes() for points in results)
            print(
                f"{line}, of it the kernel {alone:.3f} ms: {1e6 * alone / free:.2f} ns a node, "
                f"{100 * needed / (1e-3 * alone) / rate:.1f} % of the bandwidth for {needed / free:.0f} bytes a node; "
                f"same bits: {same}", flush=True,
            )  # fmt: skip


def kernel_alone(card, smoother: Smoother, stars, field: Field) -> tuple[float, int]:
    """Milliseconds of a sweep without copies, and the bytes that it cannot do without."""
    module = checked()
    visit, on = smoother.in_plane, card._on_machine(stars)
    given = (
        card._sent(field.points), on.blocks, on.first, card._copied(field.guard(serial)), card._copied(visit.arguments),
        card.machine.there(np.zeros(3, dtype=np.int64)),
    )  # fmt: skip
    room = accelerated.room_for(on.blocks.most, visit.room)
    begin, end = module.event(), module.event()
    times = []
    for _ in range(REPEATS):
        begin.record()
        card.machine.start(visit.kernel, room, on.most, given)
        end.record()
        end.synchronize()
        times.append(begin.elapsed_time(end))
    blocks = on.blocks
    index = sum(each.dtype.itemsize * each.size for each in (blocks.centre, blocks.rings, blocks.offset, blocks.degree))
    return float(np.median(times)), index + 32 * blocks.centre.size


def bits(count: int) -> None:
    """Small meshes, all methods and levels that the card does, with and without nodes that slide."""
    accelerated.FEWEST = 0
    different = done = 0
    methods = [name for name in accelerated.METHODS if name != "auto"]
    cases = [
        (kind, name, choice, guard, slide)
        for kind, name in itertools.product(("triangles", "quads"), methods)
        for choice in (METHODS[name].objectives or METHODS[name].variants or ("",))
        for guard in ("valid", "worst", "star")
        for slide in ((None, "all") if METHODS[name].slides else (None,))
        if METHODS[name].moves("triangle" if kind == "triangles" else "quad", choice or None)
    ]
    for number in range(count):
        kind, name, choice, guard, slide = cases[number % len(cases)]
        options = {"method": name, "guard": guard, "slide": slide, "max_sweeps": 4}
        if choice:
            options["objective" if METHODS[name].objectives else "variant"] = choice
        mesh = mesh_of(kind, 300 + 37 * (number % 50), number)
        if number % 3 == 2:  # some cells are inverted
            size = np.ptp(mesh.points) / np.sqrt(len(mesh.points))
            thrown = mesh.points + np.random.default_rng(number).normal(0.0, 0.3 * size, mesh.points.shape)
            mesh = mesh.with_points(thrown)
            options["untangle"] = False
        one, other = (gmsnet.smooth(mesh, device=device, **options) for device in ("cpu", "cuda"))
        told = [repr(each.history) for each in (one, other)]
        assert any("did" in note and "no sweep" not in note for note in other.notes), other.notes
        done += 1
        if one.points.tobytes() != other.points.tobytes() or told[0] != told[1]:
            different += 1
            print("differs:", kind, options, number, flush=True)
    print(f"{done} runs of {len(cases)} ways, {different} with other bits or counts")


def calls(mesh: gmsnet.Mesh) -> None:
    kind = mesh.cells[0].kind
    for name in ("auto", "barrier", "laplacian", "gmsnet"):
        if kind != "triangle" and name == "gmsnet":
            continue
        seconds: dict[str, list[float]] = {"cpu": [], "cuda": []}
        points = {}
        for _ in range(4):
            for device, times in seconds.items():
                began = time.perf_counter()
                result = gmsnet.smooth(mesh, name, device=device)
                times.append(time.perf_counter() - began)
                points[device] = result.points.tobytes()
        cpu, cuda = (float(np.median(times[1:])) for times in seconds.values())
        print(
            f"{kind}s, {len(mesh.points):,} nodes, {name}: {cpu:.2f} s on all processors, {cuda:.2f} s with the card "
            f"({result.sweeps} sweeps; {result.notes[-1]}); same bits: {points['cpu'] == points['cuda']}", flush=True,
        )  # fmt: skip


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nodes", type=float, nargs="*", default=[1e5, 1e6])
    parser.add_argument("--bits", action="store_true")
    parser.add_argument("--calls", action="store_true")
    parser.add_argument("files", nargs="*")
    asked = parser.parse_args()
    if asked.bits:
        bits(200)
        raise SystemExit
    measure = calls if asked.calls else sweeps
    for file in asked.files:
        measure(gmsnet.read(file))
    for nodes in [] if asked.files else asked.nodes:
        measure(mesh_of("triangles", int(nodes), 1))
        measure(mesh_of("quads", int(nodes) // 2, 1))
