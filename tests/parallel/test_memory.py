from __future__ import annotations

import os
import tracemalloc

import numpy as np
import pytest

import gmsnet
from gmsnet.errors import InputError
from gmsnet.generate import disturb, layered_mesh, sheared_mesh
from gmsnet.methods.auto import WHOLE
from gmsnet.parallel import memory as available_memory
from gmsnet.parallel.memory import available, refuse_unless_free
from gmsnet.preserve import layers
from gmsnet.preserve.layers import stretched_layers
from gmsnet.preserve.survey import Survey
from gmsnet.run import set_up as engine
from gmsnet.topology import topology
from gmsnet.topology.ordering import near_points
from gmsnet.topology.topology import Topology

MEMINFO = """\
MemTotal:       24600000 kB
MemFree:          700000 kB
MemAvailable:    2000000 kB
SwapTotal:       1000000 kB
SwapFree:         500000 kB
"""
SYSTEM = 2_500_000 * 1024


def machine(root, files):
    for path, text in files.items():
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(text)
    return root


def test_of_the_system(tmp_path):
    assert available(machine(tmp_path, {"proc/meminfo": MEMINFO})) == SYSTEM


def test_a_system_that_does_not_tell(tmp_path):
    assert available(tmp_path) is None
    assert available(machine(tmp_path, {"proc/meminfo": "MemTotal: 5 kB\n"})) is None


def test_the_least_of_all_groups_that_the_process_is_in(tmp_path):
    group = "sys/fs/cgroup/user/job"
    root = machine(tmp_path, {
        "proc/meminfo": MEMINFO,
        "proc/self/cgroup": "0::/user/job\n",
        f"{group}/memory.max": "900000000\n",
        f"{group}/memory.current": "500000000\n",
        f"{group}/memory.stat": "anon 1\ninactive_file 100000000\nactive_file 7\n",
        "sys/fs/cgroup/user/memory.max": "max\n",
        "sys/fs/cgroup/user/memory.current": "600000000\n",
    })  # fmt: skip
    assert available(root) == 500_000_000
    machine(root, {"sys/fs/cgroup/user/memory.max": "700000000\n"})
    assert available(root) == 100_000_000
    machine(root, {"sys/fs/cgroup/user/memory.max": "500000000\n"})  # lowered below what is in use
    assert available(root) == 0
    machine(root, {"sys/fs/cgroup/user/memory.max": "9000000000000\n", f"{group}/memory.max": "9000000000000\n"})
    assert available(root) == SYSTEM


def test_groups_of_the_first_version(tmp_path):
    """In a container the path is the one outside; the group itself is mounted at the top."""
    root = machine(tmp_path, {
        "proc/meminfo": MEMINFO,
        "proc/self/cgroup": "9:cpuset:/docker/abc\n8:cpu,memory:/docker/abc\n0::/\n",
        "sys/fs/cgroup/memory/memory.limit_in_bytes": "800000000\n",
        "sys/fs/cgroup/memory/memory.usage_in_bytes": "300000000\n",
        "sys/fs/cgroup/memory/memory.stat": "inactive_file 5\ntotal_inactive_file 50000000\n",
    })  # fmt: skip
    assert available(root) == 550_000_000
    machine(root, {"sys/fs/cgroup/memory/memory.limit_in_bytes": "9223372036854771712\n"})  # none
    assert available(root) == SYSTEM


@pytest.mark.skipif(not hasattr(os, "sysconf"), reason="no sysconf on this system")
def test_this_machine_tells():
    assert 0 < available() <= 4 * os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def test_too_much_is_refused_with_both_amounts(monkeypatch):
    monkeypatch.setattr(available_memory, "available", lambda: 3 * 10**9)
    refuse_unless_free(3 * 10**9, "this")
    with pytest.raises(InputError, match=r"^this needs about 3.25 GB of memory, but only 3 GB are free$"):
        refuse_unless_free(3_250_000_000, "this")
    with pytest.raises(InputError, match=r"^this needs about 1,250 GB of memory, but only 3 GB are free$"):
        refuse_unless_free(1_250_000_000_000, "this")
    monkeypatch.setattr(available_memory, "available", lambda: None)
    refuse_unless_free(10**18, "this")


def test_little_is_not_asked_for(monkeypatch):
    monkeypatch.setattr(available_memory, "available", lambda: pytest.fail("asked"))
    refuse_unless_free(available_memory.ALWAYS_FREE, "this")


def most_traced(work) -> int:
    """Bytes that NumPy has allocated at the most while this works, once all is loaded and compiled."""
    work()
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def arrays(mesh):
    return np.array(mesh.points), np.array(mesh.cells[0].nodes)


@pytest.mark.parametrize(("method", "most"), [("auto", 255), ("laplacian", 265), ("getme", engine.BYTES_PER_NODE)])
@pytest.mark.parametrize("threads", [1, 2])
def test_a_call_allocates_no_more_than_is_asked_for(method, most, threads):
    given = arrays(gmsnet.random_mesh(30_000, seed=0))
    gmsnet.smooth(given, method, max_sweeps=3, threads=threads)  # kernels that are loaded stay, whatever the mesh
    traced = most_traced(lambda: gmsnet.smooth(given, method, max_sweeps=3, threads=threads))
    assert traced <= most * len(given[0])


def test_all_nodes_at_once_take_no_more_than_a_call_asks_for():
    given = arrays(sheared_mesh(160, amplitude=0.5, waves=1))
    stages = [sweep.stage for sweep in gmsnet.smooth(given).history]
    assert any(WHOLE in stage for stage in stages)
    assert most_traced(lambda: gmsnet.smooth(given)) <= engine.BYTES_PER_NODE * len(given[0])


def test_the_connectivity_allocates_no_more_than_is_asked_for():
    mesh = gmsnet.random_mesh(20_000, seed=0)
    tangled = disturb(mesh, Topology.of(mesh).free, 0.8, seed=1, keep_valid=False)
    for each in (mesh, tangled):
        asked_for = topology.PER_NODE * len(each.points) + topology.PER_CORNER * 3 * len(each.cells[0].nodes)
        assert most_traced(lambda each=each: Topology.of(each)) <= asked_for


def test_layers_allocate_no_more_than_is_asked_for():
    mesh = layered_mesh(30, 1000.0, 200)
    known = Topology.of(mesh)
    near = near_points(mesh, known)
    assert stretched_layers(mesh, known, Survey.of(mesh, known, near))
    traced = most_traced(lambda: stretched_layers(mesh, known, Survey.of(mesh, known, near)))
    assert traced <= layers.BYTES_PER_NODE * len(near)
