"""Parts of a surface that are folded over: laid flat and untangled as meshes in a plane are, before all else."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.charts import Chart, folded
from gmsnet.constraints.facets import Facets
from gmsnet.constraints.folded_planes import folded_planes
from gmsnet.constraints.folds import FOLD
from gmsnet.constraints.patches import NOTHING, Patches
from gmsnet.kernels.star.guard import Precision
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.flat_part import ROUNDING, FlatPart
from gmsnet.run.options import SmoothOptions
from gmsnet.run.run import precision_of
from gmsnet.run.unfold_curved import CurvedParts
from gmsnet.run.untangle_stage import note_of
from gmsnet.topology.ordering import space_points

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
OPPOSITE = -0.99  # the cosine between two edges of a rim from which on it goes back


class Unfolded(NamedTuple):
    """mesh: with the parts that were mended. notes: what was done about each; () where nothing was. laid: (F,) bool,
    the facets of curved parts: sharp edges there, where facets are thin, are none of the surface."""

    mesh: Mesh
    notes: tuple[str, ...]
    laid: Flags


def unfolded(mesh: Mesh, facets: Facets, patches: Patches, asked: Flags, options: SmoothOptions) -> Unfolded:
    """A surface with its folded parts untangled. facets, patches: of the surface. asked: (N,) bool, nodes to hold.

    Nodes at the rim of a part stay, too. A plane part that cannot be mended in full, or a fold of another one, may be
    there on purpose, as the hem of a sheet is: it stays as it is.
    """
    laid, points = np.zeros(len(facets.rows), dtype=bool), space_points(mesh)[:, :3].copy()
    if not options.untangle or not folded(facets, points, (patches.beside == NOTHING).any(axis=1), FOLD):
        return Unfolded(mesh, (), laid)
    held = asked | facets.still
    held[facets.lines] = True
    written = precision_of(mesh)
    precision = written.before_rounding
    precision = precision._replace(grain=precision.grain + ROUNDING * precision.unit * float(abs(points).max()))
    notes, start, uses = list[str](), points.copy(), np.bincount(facets.rows.ravel(), minlength=len(points))
    for plane in folded_planes(facets, points):
        part = FlatPart.of(facets, plane, points, held, uses)
        notes += _mended_plane(part, plane, points, precision, written)
    notes += CurvedParts.of(mesh, facets, start, held, uses, precision, options).mend(points, laid)
    moved = (points != start).any(axis=1)
    if not moved.any():
        return Unfolded(mesh, (), laid)
    full = mesh.points.copy()
    full[moved] = np.ldexp(points[moved], mesh.exponent)
    return Unfolded(mesh.with_points(full).in_frame_of(mesh), tuple(notes), laid)


def _mended_plane(
    part: FlatPart, plane: Chart, points: Floats, precision: Precision, written: Precision
) -> list[str]:  # fmt: skip
    """Untangles a plane part of the points (N, 3), in place, if it is mended in full; what to say. precision: of points
    before they are rounded; written: after that."""
    if _rim_turns_back(part.flat, (part.triangles, part.quads)):
        return []
    found = part.untangled(part.held, precision)
    if found is None or found[0].after:
        return []
    done, own, step = found
    points[part.nodes[own]] = written.rounded(points[part.nodes[own]] + step @ plane.axes)
    return [f"in a plane of the surface, {note_of(done)}"]


def _rim_turns_back(flat: Floats, tables: tuple[NDArray[np.int64], NDArray[np.int64]]) -> bool:
    """Does the rim of some faces in a plane (n, 2) go back along itself, with an angle of 0 between? So it does where a
    sheet is folded on purpose: no places of the nodes inside are good. At the tip of a slit the angle is 360°.
    """
    from gmsnet.untangle.crossings import angle_sums  # what it needs of SciPy takes 0.15 s more to import

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
    return bool((angle_sums(flat, at, ahead, behind)[back] < math.pi).any())
