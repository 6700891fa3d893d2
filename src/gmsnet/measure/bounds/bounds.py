"""How good the cells of a mesh can become at most, with its connectivity and its held nodes; what stands in the way.

Each bound is for a group of cells: in no mesh without inverted cells are all of them better. So the minimum bound of
all groups, the *ceiling*, is an upper bound of the mesh's worst 1/q. With D twice the area and L the sum of the squared
sides, 1/q = 2√3·D/L.

*Held cells.* All three nodes are held: its 1/q is what it is.

*Corners.* k cells share a corner of Θ at a node: at a held one between two neighbouring held edges, whose angle is
fixed, or all around a node, Θ = 2π, whether it is held or not. A triangle with sides u, v around an angle θ has D = uv
sin θ and L = 2(u² + v² − uv cos θ) ≥ 2uv(2 − cos θ), with equality for u = v, so that

    1/q ≤ f(θ) = √3 sin θ/(2 − cos θ).

f rises up to 60°, where it is 1, and falls from there on, so that f(θ) ≥ t means θ ∈ [α, β] for some α, β. If k
angles of the sum Θ all lie there, so does their mean, hence f(Θ/k) ≥ t: they cannot all be better than f(Θ/k). (That
the angles of a fan of positive triangles add up to Θ, and not to a full turn more, is so in every mesh without inverted
cells whose boundary does not cross itself.)

*Held edges around a free node.* With a held edge of length c along the x-axis, its middle the origin, and the apex at
(x, y), D = cy and L = 2x² + 2y² + 3c²/2. So 1/q ≥ t holds where

    x² + (y − √3 c/2t)² ≤ (3c²/4)(1/t² − 1):

the apex lies in a disc over the edge. The largest t for which the discs of all held edges of a star have a point in
common bounds those cells. Discs that meet do so in a centre or in a point shared by two of their circles; t is found by
bisection, and rounded up by 1e-6. Of a star of more than six held edges, six at a time are looked at, those that stand
most in the way: still an upper bound, and nearly always the same (gmsnet.measure.bounds.apexes). So the work grows with
the number of cells, whatever the degrees of the nodes are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.measure.bounds import groups, links
from gmsnet.measure.bounds.held_corners import held_corners
from gmsnet.measure.cells import MeasuredCells
from gmsnet.measure.report import QualityReport, measure
from gmsnet.measure.solids import MeasuredSolids
from gmsnet.mesh.display import amount
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.shell import Shell
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

SHOWN = 4  # cells that a sentence names


@dataclass(frozen=True, eq=False)
class Limits:
    """Groups of cells that cannot all be better than a bound; those with the minimum bounds first.

    bound: (G,) of 1/q. kind: (G,) one of the kinds in groups.py. node: (G,) id of the node where it is, −1 for
    held cells. angle: (G,) of a corner, in degrees. first, rows: group g has the rows rows[first[g] : first[g + 1]] of
    the report. cell: (T,) the index of each row among all cells of the mesh. held: (T,) bool, whose nodes
    are all held. points: (N, dim). symbol: how the quality is called.
    """

    bound: Floats
    kind: NDArray[np.int8]
    node: Ints
    angle: Floats
    first: Ints
    rows: Ints
    cell: Ints
    held: NDArray[np.bool_]
    points: Floats
    symbol: str = "1/q"

    def __repr__(self) -> str:
        """One line: the ceiling, and how many groups there are."""
        return f"<Limits: ceiling {self.ceiling:.4f}, {amount(len(self.bound), 'group')} of cells>"

    @property
    def ceiling(self) -> float:
        """No mesh with this connectivity and these held nodes has a worst 1/q above it; 1 where there are no groups."""
        return float(self.bound[0]) if len(self.bound) else 1.0

    def cells(self, group: int) -> Ints:
        """The rows of triangles of a group."""
        return self.rows[self.first[group] : self.first[group + 1]]

    def describe(self, group: int) -> str:
        """What keeps the cells of a group from being better, where, and than what."""
        cells = self.cell[self.cells(group)].tolist()
        named = ", ".join(map(str, cells[:SHOWN])) + (f" and {len(cells) - SHOWN} more" if len(cells) > SHOWN else "")
        kind, bound = self.kind[group], f"{self.bound[group]:.3g}"
        if kind in groups.OF_ONE_CELL:
            return f"cell {named}: {self._of_one_cell(group)}"
        at = f"cells {named} at {self._place(group)}"
        if kind == groups.FREE_CORNER:
            few = "only " if len(cells) < 6 else ""
            return f"{at}: poor connectivity, the node has {few}{len(cells)} neighbours: they cannot all exceed {bound}"
        if kind == groups.CORNER:
            held = f"a corner of {self.angle[group]:.3g}° between held edges" if self.angle[group] < 360 else "one node"
            return f"{at}: {len(cells)} cells share {held}: they cannot all exceed {bound}"
        return f"{at}: their opposite edges are held, and no place of the node lets all of them exceed {bound}"

    def reasons(self, rows: Ints, target: float) -> dict[int, str]:
        """For each of these rows of triangles, why it may miss a target of 1/q: the tightest of its groups below it.

        Of a cell whose nodes are all held, that is said whatever its 1/q: the target may be one of angles. "no bound
        known" where there is none: it may be that the target can be reached, or that nothing says why not.
        """
        told = dict.fromkeys(map(int, rows), "")
        for group in np.flatnonzero(self.bound <= target * (1.0 + 1e-9)).tolist():
            for row in self.cells(group).tolist():
                if told.get(row) == "":
                    alone = self.kind[group] in groups.OF_ONE_CELL
                    told[row] = self._of_one_cell(group) if alone else self.describe(group)
        return {row: reason or self._otherwise(row) for row, reason in told.items()}

    def _of_one_cell(self, group: int) -> str:
        if self.kind[group] == groups.HELD:
            return f"all its nodes are held, so its {self.symbol} stays {self.bound[group]:.3g}"
        corner = f"its corner at {self._place(group)} is held with its neighbours"
        return f"{corner}, so its {self.symbol} cannot exceed {self.bound[group]:.3g}"

    def _place(self, group: int) -> str:
        node = int(self.node[group])
        return f"node {node} ({', '.join(f'{x:.6g}' for x in self.points[node].tolist())})"

    def _otherwise(self, row: int) -> str:
        return "all its nodes are held, so it stays as it is" if self.held[row] else "no bound known"


def limits(mesh: Mesh, topology: Topology | Volume, below: float = 0.9, report: QualityReport | None = None) -> Limits:
    """The bounds less than ``below`` for a planar mesh; of volumes and surfaces those of held cells and corners.

    topology: of this mesh; which nodes it holds is what counts. report: of the mesh, whose rows are meant, where there
    is one already; it may have volumes that the topology does not have, of which nothing is known.

    Where free nodes are has no influence.
    """
    free = np.zeros(len(topology.memory), dtype=bool)
    free[topology.free] = True
    if isinstance(topology, Volume | Shell):
        report = measure(mesh, topology) if report is None else report
        cell = report.cell
        held = np.isin(cell, _held_cells(mesh, topology, free))
        parts = [_held_in_space(report.shape, held, below)]
        if isinstance(report.cells, MeasuredCells | MeasuredSolids):
            parts.append(held_corners(report.cells, free, below))
        found = groups.Groups.joined(parts)
    elif topology.patterns is not None:
        cells, cell = MeasuredCells.of(mesh, topology)
        found, held = links.collect(cells, topology, free, below)
    else:
        cell, held = topology.cell, np.all(~free[topology.triangles], axis=1)
        found = groups.collect(planar_points(mesh), topology.triangles, topology.orientation, free, below)
    return Limits(
        bound=found.bound,
        kind=found.kind,
        node=found.node,
        angle=np.degrees(found.angle),
        first=found.first,
        rows=found.rows,
        cell=cell,
        held=held,
        points=mesh.points,
        symbol="η" if isinstance(topology, Volume) else "1/q",
    )


def _held_cells(mesh: Mesh, topology: Volume | Shell, free: NDArray[np.bool_]) -> Ints:
    """Those without a free node, as numbers among all cells of the mesh."""
    if isinstance(topology, Volume):
        return topology.cell[~free[topology.cells].any(axis=1)]
    cells, cell = MeasuredCells.of(mesh, topology)
    held = np.concatenate([~free[topology.triangles].any(axis=1), ~free[topology.quads].any(axis=1)])
    found: Ints = cell[held if cells.order is None else held[cells.order]]
    return found


def _held_in_space(shape: Floats, held: NDArray[np.bool_], below: float) -> groups.Groups:
    """The held cells that are worse than ``below``. shape, held: of each row of a report."""
    rows = np.flatnonzero(held & (shape < below))
    nowhere, one = np.full(len(rows), groups.NOWHERE), np.ones(len(rows), dtype=np.intp)
    return groups.Groups.of(groups.HELD, nowhere, np.zeros(len(rows)), shape[rows], one, rows)
