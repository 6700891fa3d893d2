"""What codes bring that hold their part of a mesh, and what they are told where parts do not fit together."""

from __future__ import annotations

import re

import numpy as np
import pytest

import gmsnet

pytest.importorskip("mpi4py", reason="mpi4py is not installed")

from support.comm import together

import gmsnet.distributed
from gmsnet.distributed.partition import bisection, partition

MESH = gmsnet.random_mesh(300, seed=5)
TRIANGLES = MESH.cells[0].nodes
HALF = np.arange(len(TRIANGLES)) % 2


def own(rank, triangles=TRIANGLES, points=MESH.points):
    """The arrays of a rank: points and triangles by local numbers, and global ids."""
    ids, local = np.unique(triangles[HALF[: len(triangles)] == rank], return_inverse=True)
    return points[ids], local.reshape(-1, 3), ids


def run(change=lambda rank, *arrays: arrays, ranks=2, **options):
    def work(comm):
        points, triangles, ids = change(comm.rank, *own(comm.rank))
        return ids, gmsnet.distributed.smooth((points, triangles), ids, comm=comm, threads=1, **options)

    return together(ranks, work)


def serial(**options):
    cells = np.concatenate([TRIANGLES[rank == HALF] for rank in (0, 1)])  # those of rank 0 come first
    return gmsnet.smooth((MESH.points, cells), threads=1, **options)


def test_arrays_of_two_ranks():
    expected = serial(method="barrier", preserve="none")
    for ids, result in run(method="barrier", preserve="none"):
        assert result.gathered == ""
        assert result.points.tobytes() == expected.points[ids].tobytes()
        assert (result.moved == expected.moved[ids]).all()
        assert result.held == {"boundary": len(expected.held["boundary"])}
        assert result.nodes == len(MESH.points)
        assert result.cells == len(TRIANGLES)
        assert result.summary()["after"]["least shape"] == expected.after.totals.shape_min
        assert "1/q" not in repr(result)
        assert f"{len(MESH.points)} nodes" in repr(result)


def test_two_ranks_measure_their_arrays():
    cells = np.concatenate([TRIANGLES[rank == HALF] for rank in (0, 1)])
    expected = gmsnet.quality((MESH.points, cells))

    def work(comm):
        points, triangles, ids = own(comm.rank)
        return gmsnet.distributed.quality((points, triangles), ids, threshold=0.5, comm=comm)

    for found in together(2, work):
        assert found.gathered == ""
        assert found.summary() == expected.summary()
        assert found.below[0] == int((expected.shape < 0.5).sum()) > 0
        assert [cell["cell"] for cell in found.worst] == expected.worst(5).tolist()
        assert "1/q, least" in repr(found)


def test_cells_with_numbers_of_their_own_stand_as_in_the_whole_mesh():
    expected = gmsnet.smooth((MESH.points, TRIANGLES), method="barrier", preserve="none", threads=1)

    def work(comm):
        points, triangles, ids = own(comm.rank)
        numbers = {"triangle": np.flatnonzero(comm.rank == HALF)}
        return ids, gmsnet.distributed.smooth(
            (points, triangles), ids, "barrier", numbers=numbers, comm=comm, preserve="none", threads=1
        )

    for ids, result in together(2, work):
        assert result.points.tobytes() == expected.points[ids].tobytes()


def test_nodes_that_one_rank_holds_are_held_on_all():
    inner = int(np.flatnonzero(((MESH.points > 0.4) & (MESH.points < 0.6)).all(axis=1))[0])

    def work(comm):
        points, triangles, ids = own(comm.rank)
        fixed = ids == inner if comm.rank else None
        return ids, gmsnet.distributed.smooth((points, triangles), ids, "barrier", fixed=fixed, comm=comm, threads=1)

    for ids, result in together(2, work):
        assert not result.moved[ids == inner].any()
        assert result.held["fixed by the user"] == 1


def doubled(rank, points, triangles, ids):
    return points, triangles, np.where(np.arange(len(ids)) == 1, ids[0], ids)


def negative(rank, points, triangles, ids):
    return points, triangles, ids - 1


def elsewhere(rank, points, triangles, ids):
    return points + 1e-9 * rank, triangles, ids


def too_few(rank, points, triangles, ids):
    return points, triangles, ids[:-1]


def not_finite(rank, points, triangles, ids):
    return np.where(rank, np.nan, points), triangles, ids


def in_space(rank, points, triangles, ids):
    return np.pad(points, ((0, 0), (0, rank))), triangles, ids


def whole(rank, points, triangles, ids):
    return MESH.points, TRIANGLES, np.arange(len(MESH.points))


def with_ghosts(rank, points, triangles, ids):
    ghosts = own(0)[2][own(0)[1]][:3] if rank else np.empty((0, 3), dtype=int)
    nodes = np.concatenate([ids[triangles], np.roll(ghosts, 1, axis=1)])
    ids = np.unique(nodes)
    return MESH.points[ids], np.searchsorted(ids, nodes), ids


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (with_ghosts, "ranks 0 and 1 have given the same triangle .*, and 2 more .*: .* so leave out ghost cells"),
        (whole, "all ranks have given the same cells: each cell of the mesh belongs to one rank"),
        (in_space, "how many coordinates a node has must be the same on all ranks: rank 0 has 2, rank 1 3"),
        (doubled, "the global id 0 is given to two nodes of one piece: give each node once"),
        (negative, "global ids count from 0, got -1"),
        (elsewhere, "is at .* on rank 0 and at .* on rank 1"),
        (too_few, "nodes need one global id each"),
        (not_finite, "nan"),
    ],
)
def test_pieces_that_do_not_fit_are_told_on_all_ranks(change, text):
    failures = []

    def work(comm):
        points, triangles, ids = change(comm.rank, *own(comm.rank))
        try:
            gmsnet.distributed.smooth((points, triangles), ids, "barrier", comm=comm, threads=1)
        except gmsnet.InputError as error:
            failures.append(str(error))

    together(2, work)
    assert len(failures) == 2
    assert failures[0] == failures[1]
    assert re.search(text, failures[0])


def test_options_and_numbers_that_differ_are_told():
    def options(comm):
        points, triangles, ids = own(comm.rank)
        with pytest.raises(gmsnet.InputError, match="the options must be the same on all ranks"):
            gmsnet.distributed.smooth((points, triangles), ids, "barrier", max_sweeps=1 + comm.rank, comm=comm)

    def numbers(comm):
        points, triangles, ids = own(comm.rank)
        twice = np.arange(len(triangles))
        with pytest.raises(gmsnet.InputError, match="are not numbered from 0, each with a number of its own"):
            gmsnet.distributed.smooth((points, triangles), ids, "barrier", numbers=twice, comm=comm)

    together(2, options)
    together(2, numbers)


def test_cells_that_are_alike_may_lie_on_two_ranks_where_they_have_numbers():
    points, both = MESH.points, np.concatenate([TRIANGLES, TRIANGLES[:1]])
    serial = gmsnet.smooth((points, both), "laplacian", threads=1)
    cells = [both[:-1], both[-1:]]
    numbers = [np.arange(len(TRIANGLES)), np.array([len(TRIANGLES)])]

    def work(comm):
        ids = np.unique(cells[comm.rank])
        own = points[ids], np.searchsorted(ids, cells[comm.rank])
        return ids, gmsnet.distributed.smooth(own, ids, "laplacian", numbers=numbers[comm.rank], comm=comm, threads=1)

    for ids, result in together(2, work):
        assert (result.points == serial.points[ids]).all()


def test_a_callback_of_the_first_rank_stops_all():
    seen = []

    def work(comm):
        points, triangles, ids = own(comm.rank)
        callback = (lambda sweep: seen.append(sweep.index) or sweep.index == 2) if comm.rank == 0 else None
        return gmsnet.distributed.smooth((points, triangles), ids, "barrier", callback=callback, comm=comm, threads=1)

    results = together(2, work)
    assert seen == [1, 2]
    assert [result.sweeps for result in results] == [2, 2]


def test_bisection_gives_each_part_its_share():
    points = np.random.default_rng(0).random((1001, 3))
    for parts in (1, 2, 3, 7):
        counts = np.bincount(bisection(points, parts), minlength=parts)
        assert counts.max() - counts.min() <= parts
    assert bisection(np.empty((0, 2)), 3).tolist() == []
    assert bisection(np.zeros((4, 2)), 2).tolist() == [0, 0, 1, 1]


@pytest.mark.parametrize("metis", [True, False])
def test_partitions_cover_all_ranks_evenly(monkeypatch, metis):
    if metis:
        pytest.importorskip("pymetis", reason="pymetis is not installed")
    else:
        monkeypatch.setattr("gmsnet.distributed.partition.metis", lambda: None)
    counts = np.bincount(partition(MESH, 4)[0], minlength=4)
    assert counts.sum() == len(TRIANGLES)
    assert counts.min() > 0.8 * counts.max()
