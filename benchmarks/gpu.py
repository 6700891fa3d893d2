"""Sweeps on a GPU of NVIDIA beside those on threads: the same bits, the time, and the share of the card's bandwidth.

python benchmarks/gpu.py                  1e5 and 1e6 nodes, threads 1 to as many as there are
python benchmarks/gpu.py --space          the same of tetrahedra and hexahedra
python benchmarks/gpu.py --bits           200 small meshes in all ways that a GPU can do, bits and counts compared;
                                          no more is begun after so many --seconds
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
from gmsnet.methods import METHODS, Field, MethodOptions
from gmsnet.parallel.threads import Threads, serial
from gmsnet.run.run import Start, precision_of
from gmsnet.topology.mixed_volume import volume_of, wound_of
from gmsnet.topology.ordering import space_points, taken
from gmsnet.topology.topology import Topology

REPEATS = 9
WAYS = (
    ("barrier", {"objective": "q2"}), ("laplacian", {"variant": "smart"}), ("laplacian", {"variant": "plain"}),
    ("gmsnet", {"variant": "metric"}),
)  # fmt: skip


CELL = {
    "triangles": "triangle", "quads": "quad", "tetrahedra": "tetra", "hexahedra": "hexahedron", "mixed solids": "wedge"
}  # fmt: skip
PLANE, SPACE = ("triangles", "quads"), ("tetrahedra", "hexahedra", "mixed solids")


def mesh_of(kind: str, nodes: int, seed: int) -> gmsnet.Mesh:
    """One of about so many nodes that is bad throughout."""
    if kind in PLANE:
        return (generate.random_mesh if kind == "triangles" else generate.random_quad_mesh)(nodes, seed=seed)
    if kind == "tetrahedra":  # two nodes a cube
        mesh = generate.lattice_volume(round((nodes / 2) ** (1 / 3)))
    else:
        side = round(nodes ** (1 / 3)) - 1
        mesh = generate.block_volume(side - side % 2, "hexahedron" if kind == "hexahedra" else "mixed")
    inner = ((mesh.points > 0.0) & (mesh.points < 1.0)).all(axis=1)
    return generate.disturb(mesh, inner, 0.25, seed=seed)


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


def sweeps(kind: str, mesh: gmsnet.Mesh) -> None:
    module = checked()
    topology = volume_of(wound_of(mesh)) if mesh.has_volumes else Topology.of(mesh, threads=2)
    points = taken(space_points(mesh), topology.memory) if mesh.has_volumes else Start.of(mesh, topology).points
    free, colours = len(topology.free), topology.stars.colours
    rate = bandwidth(module)
    print(f"\n{kind}, {free:,} free nodes, {colours} colours; the card copies {rate / 1e12:.2f} TB/s", flush=True)
    counts = [1 << k for k in range(20) if 1 << k <= len(os.sched_getaffinity(0))]
    for name, chosen in WAYS:
        if name == "gmsnet" and kind != "triangles":
            continue
        with accelerated.gpu(1) as card:
            alone, needed = kernel_alone(card)
            results = []
            line = f"{name} {next(iter(chosen.values()))}:"
            for executor in [serial, *(Threads(count) for count in counts[1:]), card]:
                smoother = METHODS[name].create(MethodOptions(**chosen))
                field = Field(points.copy(), topology, precision_of(mesh))
                took = milliseconds(lambda s=smoother, f=field, e=executor: s.sweep(f, e, lambda: False))
                results.append(field.points)
                line += f" {took:.2f}" if executor is not card else f" | card {took:.2f} ms"
                if isinstance(executor, Threads) and executor is not card:
                    executor.close()
            kernel = float(np.median(alone[1:]))
            same = all(each.tobytes() == results[0].tobytes() for each in results)
            print(
                f"{line}, of it the kernel {kernel:.3f} ms: {1e6 * kernel / free:.2f} ns a node, "
                f"{100 * needed[0] / (1e-3 * kernel) / rate:.1f} % of the bandwidth for {needed[0] / free:.0f} bytes a "
                f"node; same bits: {same}", flush=True,
            )  # fmt: skip


def kernel_alone(card) -> tuple[list[float], list[int]]:
    """Milliseconds of each sweep without copies, and the bytes that it cannot do without: filled as sweeps are done."""
    module, start = checked(), card.machine.start
    begin, end = module.event(), module.event()
    times: list[float] = []
    needed: list[int] = []

    def timed(kernel, room, stars, arguments) -> None:
        begin.record()
        start(kernel, room, stars, arguments)
        end.record()
        end.synchronize()
        times.append(begin.elapsed_time(end))
        points, blocks = arguments[:2]
        own = [blocks.mixture.role, blocks.mixture.owner] if getattr(blocks, "mixture", None) else []
        read = sum(each.dtype.itemsize * each.size for each in (*blocks, *own) if hasattr(each, "dtype"))
        needed.append(read + 2 * 8 * points.shape[1] * blocks.centre.size)

    card.machine.start = timed
    return times, needed


def bits(count: int, kinds: tuple[str, ...], seconds: float) -> None:
    """Small meshes, all methods and levels that the card does, with and without nodes that slide."""
    accelerated.FEWEST = 0
    different, done, began = 0, 0, time.perf_counter()
    methods = [name for name in accelerated.METHODS if name != "auto"]
    cases = [
        (kind, name, choice, guard, slide)
        for kind, name in itertools.product(kinds, methods)
        for choice in (METHODS[name].objectives or METHODS[name].variants or ("",))
        for guard in ("valid", "worst", "star")
        for slide in ((None, "all") if METHODS[name].slides else (None,))
        if METHODS[name].moves(CELL[kind], choice or None)
    ]
    np.random.default_rng(0).shuffle(cases)
    for number in range(count):
        if time.perf_counter() - began > seconds:
            break
        kind, name, choice, guard, slide = cases[number % len(cases)]
        options = {"method": name, "guard": guard, "slide": slide, "max_sweeps": 4}
        if choice:
            options["objective" if METHODS[name].objectives else "variant"] = choice
        mesh = mesh_of(kind, 300 + 37 * (number % 50), number)
        if number % 3 == 2:  # some cells are inverted
            size = np.ptp(mesh.points) / len(mesh.points) ** (1 / 2 if kind in PLANE else 1 / 3)
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
    print(f"{done} runs, of {min(done, len(cases))} of {len(cases)} ways, {different} with other bits or counts")


def calls(kind: str, mesh: gmsnet.Mesh) -> None:
    for name in ("auto", "barrier", "laplacian", "gmsnet"):
        if name == "gmsnet" and kind != "triangles":
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
            f"{kind}, {len(mesh.points):,} nodes, {name}: {cpu:.2f} s on all processors, {cuda:.2f} s with the card "
            f"({result.sweeps} sweeps; {result.notes[-1]}); same bits: {points['cpu'] == points['cuda']}", flush=True,
        )  # fmt: skip


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nodes", type=float, nargs="*", default=[1e5, 1e6])
    parser.add_argument("--bits", action="store_true")
    parser.add_argument("--calls", action="store_true")
    parser.add_argument("--space", action="store_true")
    parser.add_argument("--seconds", type=float, default=np.inf)
    asked = parser.parse_args()
    if asked.bits:
        bits(200, SPACE if asked.space else PLANE, asked.seconds)
        raise SystemExit
    for nodes in asked.nodes:
        for kind in SPACE[:2] if asked.space else PLANE:
            count = int(nodes) // 2 if kind == "quads" else int(nodes)
            (calls if asked.calls else sweeps)(kind, mesh_of(kind, count, 1))
