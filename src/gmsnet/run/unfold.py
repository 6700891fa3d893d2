"""Plane parts of a surface that are folded: they are untangled as meshes in a plane are, before all else."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.facets import Facets
from gmsnet.constraints.folded_planes import OPPOSITE, FoldedPlane, folded_planes, quads_of
from gmsnet.constraints.patches import NOTHING, Patches
from gmsnet.measure.signs import exact_signs
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.run import precision_of
from gmsnet.run.untangle_stage import note_of
from gmsnet.topology.ordering import planar_points, space_points
from gmsnet.topology.topology import Topology

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
ROUNDING = 4.0  # times that of a coordinate in space: what one in the plane may be off


def unfolded(mesh: Mesh, facets: Facets, patches: Patches, asked: Flags) -> tuple[Mesh, tuple[str, ...]]:
    """A surface with its plane parts untangled, where some are folded, and what was done about each.

    facets, patches: of the surface. asked: (N,) bool, nodes to hold; those at the rim of a part stay, too. A part that
    cannot be mended in full may be folded on purpose, as the hem of a sheet is: it stays as it is.
    """
    notes, moved, points = list[str](), np.zeros(len(mesh.points), dtype=bool), space_points(mesh)[:, :3].copy()
    sharp = (patches.beside == NOTHING).any(axis=1)
    for plane in folded_planes(facets, points, sharp):
        found = _untangled(mesh, facets, plane, points, asked)
        if found is not None:
            nodes, places, note = found
            points[nodes], moved[nodes] = places, True
            notes.append(note)
    if not notes:
        return mesh, ()
    full = mesh.points.copy()
    full[moved] = np.ldexp(points[moved], mesh.exponent)
    return mesh.with_points(full), tuple(notes)


def _untangled(
    mesh: Mesh, facets: Facets, plane: FoldedPlane, points: Floats, asked: Flags
) -> tuple[NDArray[np.int64], Floats, str] | None:
    """The nodes of a part that move, where to (n, 3), and what to say."""
    chosen, half = plane.facets, facets.halves // 2
    begin = len(facets.rows) - facets.halves
    whole = chosen[begin : begin + half] & chosen[begin + half :]
    kept = np.concatenate([chosen[:begin], whole, whole])
    triangles, quads = facets.rows[:begin][chosen[:begin]], quads_of(facets)[whole]
    held = asked | facets.still
    held[facets.lines] = True
    held[facets.rows[~kept]] = True
    nodes, corner = np.unique(np.concatenate([triangles.ravel(), quads.ravel()]), return_inverse=True)
    flat = (points[nodes] - plane.origin) @ plane.axes.T
    tables = corner[: triangles.size].reshape(-1, 3), corner[triangles.size :].reshape(-1, 4)
    if _rim_turns_back(flat, tables):
        return None
    kinds = zip(("triangle", "quad"), tables, strict=True)
    part = Mesh(flat, tuple(CellBlock(kind, table, np.zeros(len(table), dtype=np.int64)) for kind, table in kinds))
    connected = Topology.of(part, held[nodes])
    start = planar_points(part)[connected.memory]
    if not (exact_signs(start, connected.near, connected.near_orientation) <= 0).any():
        return None
    from gmsnet.untangle import untangle  # what it needs of SciPy takes 0.15 s more to import

    known = precision_of(mesh)
    grain = known.grain + ROUNDING * known.unit * float(abs(points).max())
    done = untangle(start, connected, known._replace(grain=np.ldexp(grain, -part.exponent), single=False))
    if done.after:
        return None
    moved = np.flatnonzero((done.points != start).any(axis=1))
    own = connected.memory[moved]
    step = np.ldexp(done.points[moved] - start[moved], part.exponent) @ plane.axes
    return nodes[own], points[nodes[own]] + step, f"in a plane of the surface, {note_of(done)}"


def _rim_turns_back(flat: Floats, tables: tuple[NDArray[np.int64], NDArray[np.int64]]) -> bool:
    """Does the rim of some faces in a plane (n, 2) go back along itself, with an angle of 0 between? So it does where a
    sheet is folded on purpose: no places of the nodes inside are good. At the tip of a slit the angle is 360°.
    """
    at, ahead, behind = (np.concatenate([np.roll(table, -k, axis=1).ravel() for table in tables]) for k in (0, 1, -1))
    size = len(flat)
    rim = ~np.isin(at * size + ahead, ahead * size + at)
    way = np.zeros_like(flat)
    way[at[rim]] = flat[ahead[rim]] - flat[at[rim]]
    single = np.bincount(at[rim], minlength=size)[ahead[rim]] == 1  # else several parts of the rim meet there
    here, there = at[rim][single], ahead[rim][single]
    lengths = np.linalg.norm(way[here], axis=1) * np.linalg.norm(way[there], axis=1)
    back = there[np.einsum("ij,ij->i", way[here], way[there]) < OPPOSITE * lengths]
    if not back.size:
        return False
    one, other = flat[ahead] - flat[at], flat[behind] - flat[at]
    angle = np.arctan2(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0], np.einsum("ij,ij->i", one, other))
    return bool((np.bincount(at, angle, minlength=size)[back] < math.pi).any())
