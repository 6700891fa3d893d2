"""What the first run compiles, kernel by kernel, and how long the command line takes to start.

    python benchmarks/start.py                # CPU seconds of compilation per kernel, with an empty cache
    python benchmarks/start.py --wall         # besides, seconds of the clock of the command line, first and later runs
    python benchmarks/start.py --degrees      # one kernel for all degrees against one per degree

Seconds of a kernel include the functions that are compiled for it first, as parts of it.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

FOLDER = tempfile.TemporaryDirectory()
os.environ["NUMBA_CACHE_DIR"] = os.environ["GMSNET_CACHE"] = FOLDER.name

import numba  # noqa: E402
import numpy as np  # noqa: E402
from numba.core import event  # noqa: E402

import gmsnet  # noqa: E402
from gmsnet.kernels.jit.compile import LANES, OPTIONS  # noqa: E402
from gmsnet.kernels.methods import barrier  # noqa: E402
from gmsnet.kernels.methods.barrier_star import Power  # noqa: E402

DEGREES, REPEATS = range(3, 12), 100


class Compilation(event.Listener):
    """How many functions each kernel is compiled of, and how long that takes. seconds: of this thread."""

    def __init__(self) -> None:
        self.begun: list[float] = []
        self.functions = 0
        self.kernels: list[tuple[float, int, str]] = []

    def on_start(self, event: event.Event) -> None:
        """See Listener."""
        self.functions = self.functions + 1 if self.begun else 1
        self.begun.append(time.thread_time())

    def on_end(self, event: event.Event) -> None:
        """See Listener."""
        seconds = time.thread_time() - self.begun.pop()
        if not self.begun:
            function = event.data["dispatcher"].py_func
            name = f"{function.__module__.removeprefix('gmsnet.kernels.')}.{function.__name__}"
            self.kernels.append((seconds, self.functions, name))


def compilation(mesh: Path) -> None:
    """Prints what ``gmsnet smooth`` compiles for a mesh."""
    found = Compilation()
    with event.install_listener("numba:compile", found):
        result = gmsnet.smooth(gmsnet.read(mesh), threads=1)
        gmsnet.write(result.mesh, mesh.with_name("compiled.su2"))
        _ = result.limits, result.after.min_angle
    for seconds, functions, name in sorted(found.kernels, reverse=True):
        print(f"{name:28} {seconds:6.2f} s  {functions:3} functions")
    seconds, functions, _ = zip(*found.kernels, strict=True)
    print(f"{f'all {len(seconds)} kernels':28} {sum(seconds):6.2f} s  {sum(functions):3} functions")


def wall(mesh: Path) -> None:
    """Prints how long the command line takes, each time in a new process."""
    smooth = ["-m", "gmsnet", "smooth", str(mesh), str(mesh.with_name("smoothed.su2")), "--quiet"]
    commands = {
        "python": (["-c", "pass"], 9),
        "import numpy": (["-c", "import numpy"], 9),
        "import gmsnet": (["-c", "import gmsnet"], 9),
        "gmsnet --help": (["-m", "gmsnet", "--help"], 9),
        "import numba": (["-c", "import numba"], 9),
        "gmsnet smooth, first run": (smooth, 1),
        "gmsnet smooth": (smooth, 9),
    }
    with tempfile.TemporaryDirectory() as empty:
        environment = {**os.environ, "NUMBA_CACHE_DIR": empty, "GMSNET_CACHE": empty}
        for name, (arguments, times) in commands.items():
            seconds = []
            for _ in range(times):
                began = time.perf_counter()
                subprocess.run([sys.executable, *arguments], env=environment, check=True, stdout=subprocess.DEVNULL)
                seconds.append(time.perf_counter() - began)
            print(f"{name:28} {statistics.median(seconds):7.3f} s  (least {min(seconds):.3f})")


def degrees() -> None:
    """Prints what the arithmetic of a visit (derivatives, value after the step) costs if the degree is known."""
    derive, judge = (numba.njit(forceinline=True, **OPTIONS)(part.py_func) for part in (barrier.derive, barrier.judge))
    sums, step = np.empty(barrier.SUMS * LANES, np.float32), np.zeros(2 * LANES, np.float32)
    power, random = Power.of(1), np.random.default_rng(0)

    def visit_of(degree):
        def visit(local, n, power, sums, step, times):
            n = n if degree == 0 else degree
            for _ in range(times):
                derive(local, n, None, power, sums)
                judge(local, n, None, power, step, 0.01, sums)

        return numba.njit(**OPTIONS)(visit)

    def first_call(visit, n):
        began = time.thread_time()
        visit(random.normal(size=2 * n * LANES).astype(np.float32), n, power, sums, step, 1)
        return time.thread_time() - began

    numba.njit(**OPTIONS)(lambda x: x + 1)(1)  # what comes with the first compilation of all
    any_degree, own = visit_of(0), {n: visit_of(n) for n in DEGREES}
    once = first_call(any_degree, 6)
    each = {n: first_call(own[n], n) for n in DEGREES}
    print(f"compilation: {once:.2f} s for all degrees, {sum(each.values()):.2f} s for {len(each)} degrees")
    for n in DEGREES:
        local = random.normal(size=2 * n * LANES).astype(np.float32)
        least = {}
        for _ in range(300):
            for visit in (any_degree, own[n]):
                began = time.perf_counter()
                visit(local, n, power, sums, step, REPEATS)
                least[visit] = min(least.get(visit, np.inf), time.perf_counter() - began)
        one, known = (least[visit] / REPEATS / LANES * 1e9 for visit in (any_degree, own[n]))
        print(f"degree {n:2}: {one:5.1f} ns per node with one for all, {known:5.1f} ns with one of its own")


def main() -> None:
    """See the module."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", type=int, default=10_000)
    parser.add_argument("--wall", action="store_true")
    parser.add_argument("--degrees", action="store_true")
    options = parser.parse_args()
    if options.degrees:
        degrees()
        return
    mesh = Path(FOLDER.name) / "mesh.su2"
    code = "import sys, gmsnet; gmsnet.write(gmsnet.random_mesh(int(sys.argv[1]), seed=0), sys.argv[2])"
    subprocess.run([sys.executable, "-c", code, str(options.nodes), mesh], check=True)  # lest it compile anything here
    if options.wall:
        wall(mesh)
    compilation(mesh)


if __name__ == "__main__":
    main()
