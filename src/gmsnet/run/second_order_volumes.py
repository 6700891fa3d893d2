"""The second-order cells of a volume mesh, before the stages of run/second_order.py."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.mesh.mesh import Mesh
from gmsnet.preserve.protection import protected_volume
from gmsnet.run.options import SmoothOptions
from gmsnet.run.state import SecondOrder
from gmsnet.topology.curved_solids import (
    CORNERS3,
    CURVED,
    at_odds,
    has_curved,
    of_positive_sense,
    on_rim,
    straight,
    table_of,
)
from gmsnet.topology.held import OF_SECOND_ORDER
from gmsnet.topology.mixed_volume import volume_of, wound_of
from gmsnet.topology.ordering import space_points, taken
from gmsnet.topology.volume import Volume

FIRST_ORDER = "node of first-order cells"


def second_order_solids_of(mesh: Mesh, topology: Volume, options: SmoothOptions) -> SecondOrder | None:
    """The second-order cells of a mesh and which of their nodes may move; None where there are none.

    topology: of the volumes of the first order.
    """
    if not has_curved(mesh):
        return None
    table, kinds, number, others = table_of(mesh)
    nodes = len(mesh.points)
    regions = np.concatenate([block.regions for block in mesh.cells])[number]
    may = np.zeros(nodes, dtype=bool)
    may[topology.held.get(OF_SECOND_ORDER, np.empty(0, dtype=np.int64))] = True
    rim = on_rim(table, kinds, regions, nodes)
    may &= ~(others | rim | at_odds(table, kinds, nodes))
    first = np.zeros(nodes, dtype=bool)
    first[topology.free] = True
    twin = straight(mesh)
    whole = volume_of(wound_of(twin, ~(may | first)))
    inside_out = np.zeros(sum(len(block.nodes) for block in mesh.cells), dtype=bool)
    inside_out[whole.cell] = whole.orientation < 0
    table = of_positive_sense(table, kinds, inside_out[number])
    corner = np.zeros(nodes, dtype=bool)
    corner[whole.free] = True
    at_corners = np.zeros(nodes, dtype=bool)
    for kind, count in enumerate(CORNERS3):
        at_corners[table[kinds == kind, :count]] = True
    may &= corner | ~at_corners
    corners, near = whole.holding(first, FIRST_ORDER), taken(space_points(mesh), whole.memory)
    protection = protected_volume(corners, options.preserved, options.fix_layers, near, firm=False)
    outside = rim if (regions == regions[0]).all() else on_rim(table, kinds, 0 * regions, nodes)
    between = np.flatnonzero(rim & ~outside)
    return SecondOrder(table, kinds, may, whole, protection, number, outer=_outer(mesh, outside), between=between)


def _outer(mesh: Mesh, rim: NDArray[np.bool_]) -> NDArray[np.int64]:
    """The nodes of the boundary, without those of cells that are held; none where first-order cells are beside others.

    rim: (N,) which nodes are of facets of one cell alone, of those that move.
    """
    outer = rim.copy()
    for block in mesh.cells:
        if block.dimension in (3, None) and block.kind not in CURVED and len(block.nodes):
            if block.dimension is None or block.cell.order == 1:
                return np.empty(0, dtype=np.int64)
            outer[block.nodes] = False
    return np.flatnonzero(outer)
