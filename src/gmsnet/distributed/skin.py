"""The cells at the boundary on the first rank, who finds what nodes slide on in them alone: of volumes and planes.

A facet of the boundary has only nodes there, a facet where the others are cut off has none that is bounded: else the
cell behind it were here, too. So boundary, patches, curves and normals are those of the whole mesh, nodes and cells
being in its order.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gmsnet.constraints.options import check_slide
from gmsnet.constraints.sliding import Sliding, sliding_in_plane
from gmsnet.constraints.sliding_in_space import SurfaceSliding, sliding_volume
from gmsnet.distributed.along import Along, Found
from gmsnet.distributed.gathered import Whole, gathered
from gmsnet.distributed.ghosts import Surrounded
from gmsnet.distributed.piece import Flags, Ids, Piece
from gmsnet.distributed.winding import Winding
from gmsnet.errors import GmsnetError
from gmsnet.kernels.topology.connectivity import BOUNDARY, NON_MANIFOLD
from gmsnet.kernels.topology.places import places_in
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.options import SmoothOptions
from gmsnet.topology.held import REASONS
from gmsnet.topology.mixed_volume import wound_of
from gmsnet.topology.solids import WoundSolids
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume
from gmsnet.topology.wound import Wound


def found_on_the_skin(
    piece: Piece, around: Surrounded, mesh: Mesh, wound: Wound | WoundSolids | None, options: SmoothOptions, comm: Any
) -> Found | None:  # fmt: skip
    """What nodes of volumes, or in a plane, slide on; None, on all ranks, where it has to be seen whole. All ranks call
    it.

    mesh, wound: the cells of a rank and those around, the nodes held that others move; wound: of volumes.
    """
    held = np.zeros(len(around.nodes.ids), dtype=bool)
    if wound is None:
        topology = Topology.of(mesh, around.nodes.held_on(comm.rank))
        held[topology.memory] = ~topology.near_free
        orientation = np.concatenate([topology.orientation, topology.quad_orientation])
    else:
        held[wound.memory[wound.marks & np.uint16(BOUNDARY) != 0]] = True
        orientation = wound.orientation
    forth, back = (bool(comm.allreduce(bool((orientation == sign).any()))) for sign in (1, -1))
    if forth and back:
        return None
    outer = held & (around.nodes.owner == comm.rank)  # whose stars are here
    skin = gathered(_cells_at(outer, piece, around, mesh), comm)
    ids = comm.gather(around.nodes.ids[outer])
    found = None if skin is None else _seen(skin._replace(mesh=skin.mesh.in_frame_of(mesh)), ids, forth, options)
    return _told(found, comm)


def _told(found: Found | None, comm: Any) -> Found | None:
    """What the first rank has found, on all of them."""
    along = comm.bcast(None if found is None else found.along)
    return found if found is not None or along is None else Found(along)


def _cells_at(outer: Flags, piece: Piece, around: Surrounded, mesh: Mesh) -> Piece:
    """Some nodes (n,) and the cells at them, a rank's cells that are marks, and the nodes that reach furthest."""
    used, blocks = outer.copy(), []
    if len(mesh.points):
        used[[mesh.points.argmin(axis=0), mesh.points.argmax(axis=0)]] = True
    for block, shape, own in zip(around.blocks, mesh.cells, around.own, strict=True):
        marks = shape.dimension in ((0, 1, 2) if mesh.has_volumes else (0, 1))
        chosen: Flags = own if marks else np.asarray(outer[shape.nodes].any(axis=1))
        used[shape.nodes[chosen]] = True
        blocks.append(block.take(chosen))
    nodes = around.nodes
    return Piece(
        nodes.ids[used], nodes.points[used], nodes.fixed[used], tuple(blocks), piece.single, piece.names, piece.rounding
    )


def _seen(skin: Whole, ids: list[Ids], forth: bool, options: SmoothOptions) -> Found | None:
    """What the first rank finds. ids: of the nodes at the boundary, of each rank."""
    mesh, outer = skin.mesh, np.zeros(len(skin.ids), dtype=bool)
    outer[places_in(skin.ids, np.concatenate(ids))] = True
    still = skin.fixed | ~outer
    try:
        names = check_slide(mesh, options.slide, options.feature_angle, options.geometry)
        topology, sliding = _sliding(mesh, outer, names, still, options)
    except GmsnetError:  # which the whole mesh has, too, and tells better
        return None
    if not Winding.of(topology).reads(forth=forth) or REASONS[NON_MANIFOLD] in topology.held:
        return None  # areas are those between all faces then
    return Found(Along.of(topology, sliding, skin.ids), whole=skin, base=topology, sliding=sliding)


def _sliding(
    mesh: Mesh, outer: Flags, names: Sequence[str] | None, still: Flags, options: SmoothOptions
) -> tuple[Topology | Volume, Sliding | SurfaceSliding | None]:  # fmt: skip
    if mesh.has_volumes:
        wound = wound_of(mesh, still).bounded_at(outer)
        return sliding_volume(
            mesh, wound, names, options.feature_angle, still, options.distance, options.geometry, options.hausdorff
        )
    topology, _, sliding = sliding_in_plane(
        mesh, options.slide, options.feature_angle, still, options.geometry, bounded_at=outer
    )
    return topology, sliding
