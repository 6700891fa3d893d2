"""What goes wrong on one rank alone ends the run on all of them."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mpi4py", reason="mpi4py is not installed")

from support.comm import together

import gmsnet
from gmsnet import distributed
from gmsnet.errors import GmsnetError, InputError


def run(comm, **options):
    mesh = gmsnet.random_mesh(120, seed=5)
    cells = mesh.cells[0].nodes
    mine = cells[np.arange(len(cells)) % comm.size == comm.rank]
    ids = np.unique(mine)
    part = mesh.points[ids], np.searchsorted(ids, mine)
    return distributed.smooth(part, ids, comm=comm, threads=1, **options)


def failing(sweep):
    raise ZeroDivisionError("its own mistake")


@pytest.mark.parametrize("ranks", [2, 3])
def test_an_error_of_the_callback_is_one_of_all_ranks(ranks):
    def work(comm):
        with pytest.raises(ZeroDivisionError if comm.rank == 0 else GmsnetError, match="its own mistake"):
            run(comm, callback=failing if comm.rank == 0 else None)
        return True

    assert together(ranks, work) == [True] * ranks


@pytest.mark.parametrize("who", [0, 1])
def test_an_option_that_one_rank_makes_up_is_refused_by_all(who):
    def work(comm):
        wrong = comm.rank == who
        with pytest.raises(TypeError if wrong else InputError, match="nonsense"):
            run(comm, **({"nonsense": 1} if wrong else {}))
        return True

    assert together(2, work) == [True, True]
