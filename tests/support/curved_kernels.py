"""What is certain of second-order cells in a plane, moves of their corners, and steps in space, as tests ask."""

from gmsnet.kernels.curved.commit import commit_curved, curved_workspace
from gmsnet.kernels.curved.commit3 import around_workspace
from gmsnet.kernels.curved.descend3 import ROWS_OF_CELL, SAMPLES, descent3
from gmsnet.kernels.jit.compile import kernel, part
from gmsnet.kernels.simplex.bernstein import CORNERS, NODES, straighten_edges
from gmsnet.kernels.simplex.jacobian import (
    cell_workspace,
    expand,
    minimum_bound,
    quality_of,
    sign_everywhere,
)


@kernel
def commit_all(points, mesh, nodes, targets, guard, room, tally):
    """``commit_curved`` for nodes (K,) towards targets (K, 2), one after the other."""
    work = curved_workspace(mesh)
    for k in range(len(nodes)):
        commit_curved(points, mesh, nodes[k], targets[k, 0], targets[k, 1], guard, room, work, tally)


@kernel
def descend_to(points, mesh, i, mode, threshold):
    """``descent3`` of a node of volumes."""
    return descent3(points, mesh, i, mode, threshold, around_workspace(mesh, ROWS_OF_CELL, SAMPLES))


@part
def take(nodes, kind, work):
    """As ``gather_cell``, from the nodes themselves."""
    for k in range(NODES[kind]):
        work.nodes[k, 0], work.nodes[k, 1] = nodes[k, 0] - nodes[0, 0], nodes[k, 1] - nodes[0, 1]
    if NODES[kind] == CORNERS[kind]:
        straighten_edges(work.nodes, CORNERS[kind])


@kernel
def certified_positive(nodes, kind, delta):
    """Is det J positive everywhere in a cell? +1 certainly, −1 certainly not, 0 undecided.

    nodes: (6, 8, 9, 3 or 4, 2) float64, counter-clockwise, known up to ±delta. kind: see kernels.simplex.bernstein.
    """
    work = cell_workspace()
    take(nodes, kind, work)
    return sign_everywhere(kind, expand(kind, delta, work), work)


@kernel
def curved_quality(nodes, kind, delta):
    """See ``quality_of``. Arguments: see ``certified_positive``."""
    work = cell_workspace()
    take(nodes, kind, work)
    return quality_of(kind, expand(kind, delta, work), work)


@kernel
def lower_bound(nodes, kind, delta):
    """What det J is certainly not below anywhere in a cell. Arguments: see ``certified_positive``."""
    work = cell_workspace()
    take(nodes, kind, work)
    return minimum_bound(kind, expand(kind, delta, work), work)
