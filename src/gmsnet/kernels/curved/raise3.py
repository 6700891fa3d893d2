"""The lowest bounds of second-order volume cells raised, node by node.

The objective is Σ max(0, t − b)² over the cells around a node, of the bound b of det J over the least determinant of
the straight cell (``quality3``). A step is one of descent on the coefficients below t (kernels.curved.descend3); it is
made if the objective falls, no bound comes below the least in the mesh, and the rule of kernels.curved.commit3 holds.
"""

from __future__ import annotations

from gmsnet.kernels.curved.commit3 import around_workspace, commit3, quality3, restore3
from gmsnet.kernels.curved.descend import UNTANGLE
from gmsnet.kernels.curved.descend3 import ROWS_OF_CELL, SAMPLES, descent3
from gmsnet.kernels.curved.stars3 import NO_FOLLOWER, remember3
from gmsnet.kernels.jit.compile import kernel, part
from gmsnet.kernels.star.block import DROPPED, MOVED

FALL = 0.999  # of the objective at most, for a step to count


@part
def shortfall3(points, mesh, i, threshold, guard, work):
    """The objective of a node, and the least bound around it."""
    total, least = 0.0, threshold
    for k in range(mesh.cell_start[i], mesh.cell_start[i + 1]):
        bound = quality3(points, mesh, mesh.cell_of[k], threshold, guard.unit, guard.grain, work.solid)
        if bound < threshold:
            total += (threshold - bound) ** 2
            least = min(least, bound)
    return total, least


@kernel
def raise_nodes3(points, mesh, nodes, threshold, room, guard, tally):
    """A step for each of some nodes (K,) with a cell below the threshold; room: what no bound may come below."""
    work = around_workspace(mesh, ROWS_OF_CELL, SAMPLES)
    for k in range(len(nodes)):
        i = nodes[k]
        before, least = shortfall3(points, mesh, i, threshold, guard, work)
        if not (before > 0.0 and least > 0.0):
            continue
        x, y, z, fell = descent3(points, mesh, i, UNTANGLE, threshold, work)
        if not fell:
            continue
        count = commit3(points, mesh, i, x, y, z, guard, work, tally)
        if count == 0:
            continue
        after, least = shortfall3(points, mesh, i, threshold, guard, work)
        if not (after < FALL * before and least >= room):
            restore3(points, count, work)
            if mesh.number[i] != NO_FOLLOWER:
                remember3(points, mesh, mesh.number[i])
            tally[MOVED] -= 1
            tally[DROPPED] += 1
