"""A part of a surface laid flat, as a mesh of its own in the plane, where it is untangled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.charts import Chart, quads_of
from gmsnet.constraints.facets import Facets
from gmsnet.kernels.star.guard import Precision
from gmsnet.measure.signs import exact_signs
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology

if TYPE_CHECKING:  # what untangling needs of SciPy takes 0.15 s more to import
    from gmsnet.untangle.result import Untangled

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Longs = NDArray[np.int64]
ROUNDING = 4.0  # times that of a coordinate in space: what one in the plane may be off


@dataclass(frozen=True, eq=False)
class FlatPart:
    """nodes: (n,) ids. flat: (n, 2) where they lie. triangles (t, 3), quads (q, 4): by places among the nodes.
    held: (n,) bool, nodes that other facets have, too, or that are to be held; those of the rim stay as well."""

    nodes: Longs
    flat: Floats
    triangles: Longs
    quads: Longs
    held: Flags

    @classmethod
    def of(cls, facets: Facets, chart: Chart, points: Floats, held: Flags, uses: Longs) -> FlatPart:
        """points: (N, 3). held: (N,) bool. uses: (N,) how many facets have each node."""
        begin, half = len(facets.rows) - facets.halves, facets.halves // 2
        first, second = (chart.facets - start for start in (begin, begin + half))
        whole = np.intersect1d(first[(first >= 0) & (first < half)], second[second >= 0])
        triangles, quads = facets.rows[chart.facets[first < 0]], quads_of(facets)[whole]
        nodes, corner = np.unique(np.concatenate([triangles.ravel(), quads.ravel()]), return_inverse=True)
        triangles, quads = corner[: triangles.size].reshape(-1, 3), corner[triangles.size :].reshape(-1, 4)
        inside = np.bincount(np.concatenate([triangles.ravel(), quads.ravel(), quads[:, [0, 2]].ravel()]))
        flat = (points[nodes] - chart.origin) @ chart.axes.T
        return cls(nodes, flat, triangles, quads, held[nodes] | (inside < uses[nodes]))

    @property
    def rows(self) -> Longs:
        """(k, 3) its facets, in the order of those of the chart."""
        return np.concatenate([self.triangles, self.quads[:, :3], self.quads[:, [0, 2, 3]]])

    def of_cells(self, of_triangles: Flags, of_quads: Flags) -> Flags:
        """(k,) the facets of cells."""
        return np.concatenate([of_triangles, of_quads, of_quads])

    def untangled(self, held: Flags, precision: Precision) -> tuple[Untangled, Longs, Floats] | None:
        """What came of it, the places of nodes that moved, and by how much (m, 2). held: (n,) bool.
        precision: of the points in space, before they are rounded. None where no cell is inverted."""
        kinds = ("triangle", self.triangles), ("quad", self.quads)
        blocks = (CellBlock(kind, rows, np.zeros(len(rows), dtype=np.int64)) for kind, rows in kinds)
        part = Mesh(self.flat, tuple(blocks))
        connected = Topology.of(part, held)
        start = planar_points(part)[connected.memory]
        if not (exact_signs(start, connected.near, connected.near_orientation) <= 0).any():
            return None
        from gmsnet.untangle import untangle

        scaled = precision._replace(grain=np.ldexp(precision.grain, -part.exponent))
        done = untangle(start, connected, scaled)
        moved = np.flatnonzero((done.points != start).any(axis=1))
        step = np.ldexp(done.points[moved] - start[moved], part.exponent)
        return done, connected.memory[moved].astype(np.int64), step
