"""Pictures of surfaces in space: shaded, coloured by quality, with feature edges, and the worst place enlarged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.options import FEATURE_ANGLE
from gmsnet.constraints.patches import NOTHING
from gmsnet.constraints.shapes import lengths, units
from gmsnet.constraints.shell import patches_of_surface, sides_of
from gmsnet.constraints.smooth_patches import vertices_of
from gmsnet.measure.palette import AFTER, BEFORE, INVERTED
from gmsnet.measure.report import QualityReport, measure
from gmsnet.mesh.known_cells import measured
from gmsnet.mesh.mesh import Mesh
from gmsnet.plot.figure import new_figure
from gmsnet.plot.histogram import histogram
from gmsnet.plot.view import bad_to_good
from gmsnet.topology.ordering import space_points
from gmsnet.topology.shell import Shell
from gmsnet.topology.topology import Topology

if TYPE_CHECKING:
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

ZOOM_CELLS = 150  # about as many cells are seen around the worst one
TURN, RISE = 35.0, 25.0  # degrees by which the whole is seen from beside the worst cell
DARKEST = 0.55  # of a colour, on cells that are seen from the side
FEW = 3000  # cells: of more, edges are not drawn
NEARER = 0.004  # of the extent, by which feature edges are drawn before their cells
FEATURE_EDGE, CELL_EDGE = "black", (1.0, 1.0, 1.0, 0.6)


@dataclass(frozen=True)
class Sheet:
    """A surface, measured. points: (N, 3). corners: (T, 3 or 4) of the cells of ``report``, in its order, the last one
    of a triangle twice where there are quads. features: (E, 2) the nodes of feature edges, beside: (E,) a cell at each.
    normals: (T, 3). closed: no edge has one cell alone."""

    title: str
    colour: str
    points: Floats
    corners: Ints
    report: QualityReport
    features: Ints
    beside: Ints
    closed: bool

    @property
    def quads(self) -> bool:
        """See ``Shown``."""
        return bool(self.corners.shape[1] == 4)

    @property
    def normals(self) -> Floats:
        """(T, 3) of length 1."""
        a, b, c = (self.points[self.corners[:, k]] for k in range(3))
        d = self.points[self.corners[:, -1]]
        return units(np.cross(c - a, d - b) if self.corners.shape[1] == 4 else np.cross(b - a, c - a))

    @property
    def summary(self) -> str:
        """The figures above the picture."""
        report = self.report
        inverted = f", {report.inverted:,} inverted" if report.inverted else ""
        text = f"1/q  min {report.shape.min():.3f}, mean {report.shape.mean():.3f}{inverted}\n"
        text += f"angles {report.column('min_angle').min():.1f}° to {report.column('max_angle').max():.1f}°"
        return f"{self.title}:  {text}" if self.title else text


def surface_figure(meshes: Sequence[Mesh]) -> Figure:
    """The picture of one surface, or of the same before and after smoothing."""
    views = _sheets(meshes)
    figure = new_figure(11.0, 11.2)
    rows: Any = figure.subfigures(2, 1, height_ratios=[4.4, 1.0])
    worst = int(views[0].report.worst(1)[0])
    window = _window(views[0], worst)
    towards = views[0].normals[worst]
    maps = []
    for k, view in enumerate(views):
        whole = rows[0].add_subplot(2, len(views), k + 1, projection="3d", proj_type="ortho")
        whole.set_title(view.summary, fontsize=10)
        _look(whole, towards, TURN, RISE)
        mappable = _draw(whole, view, np.arange(len(view.corners)))
        centre = view.points[views[0].corners[worst]].mean(axis=0)
        whole.plot(*centre[:, None], "o", ms=20, mfc="none", mec="black", mew=1.2, zorder=10)
        zoom = rows[0].add_subplot(2, len(views), len(views) + k + 1, projection="3d", proj_type="ortho")
        zoom.set_title("around its worst cell" if k == 0 else "the same place", fontsize=10)
        _look(zoom, towards, 0.0, 0.0)
        _draw(zoom, view, window)
        outline = view.points[views[0].corners[worst]][[*range(views[0].corners.shape[1]), 0]]
        zoom.plot(*outline.T, color="black", linewidth=1.6, zorder=10)
        maps += [whole, zoom]
    rows[0].colorbar(mappable, ax=maps, label="1/q (red: inverted)", aspect=40, pad=0.04, shrink=0.7)
    charts = rows[1].subplots(1, 2)
    histogram(charts[0], views, "shape", "1/q")
    histogram(charts[1], views, "min_angle", "smallest angle of a cell (degrees)")
    return figure


def _sheets(meshes: Sequence[Mesh]) -> list[Sheet]:
    """Cells are valid that show the side which they show in the first mesh."""
    first = meshes[0]
    topology = Topology.of(first)
    facets, patches = patches_of_surface(
        first, topology, (), FEATURE_ANGLE, np.zeros(len(first.points), dtype=np.bool_)
    )
    vertices = vertices_of(patches, space_points(first)[:, :3])
    shell = Shell.made(topology, sides_of(first, topology, patches, vertices))
    own = [block for block in first.cells if measured(first, block)]
    width = max(block.corners for block in own)
    corners = np.concatenate([block.nodes[:, np.minimum(np.arange(width), block.corners - 1)] for block in own])
    sharp, side = np.nonzero(patches.beside == NOTHING)
    ends = np.column_stack([facets.rows[sharp, side], facets.rows[sharp, (side + 1) % 3]])
    keys = np.sort(ends, axis=1)
    closed = len(np.unique(keys, axis=0)) * 2 == len(keys)
    cell = np.concatenate([topology.cell, topology.quad_cell, topology.quad_cell])[sharp]
    titles, colours = ("before", "after")[-len(meshes) :], (BEFORE, AFTER)[-len(meshes) :]
    found = []
    for mesh, title, colour in zip(meshes, titles if len(meshes) > 1 else ("",), colours, strict=True):
        report = measure(mesh, shell)
        place = np.full(int(report.cell.max()) + 1, 0)
        place[report.cell] = np.arange(len(report.cell))
        found.append(Sheet(title, colour, mesh.points, corners, report, ends, place[cell], closed))
    return found


def _window(view: Sheet, worst: int) -> Ints:
    """The cells around the worst one that show about its side."""
    centres = view.points[view.corners].mean(axis=1)
    far = lengths(centres - centres[worst])
    near = np.partition(far, min(ZOOM_CELLS, len(far) - 1))[: ZOOM_CELLS + 1].max()
    normals = view.normals
    found: Ints = np.flatnonzero((far <= near) & ((normals @ normals[worst] > 0.0) | (far == 0.0)))
    return found


def _look(axes: Any, towards: Floats, turn: float, rise: float) -> None:
    """Sets the eye where a cell with this normal is seen."""
    x, y, z = towards.tolist()
    up = float(np.degrees(np.arcsin(np.clip(z, -1.0, 1.0))))
    axes.view_init(elev=float(np.clip(up + (rise if up < 0 else -rise if turn else 0.0), -80, 80)),
                   azim=float(np.degrees(np.arctan2(y, x))) + turn)  # fmt: skip


def _draw(axes: Any, view: Sheet, cells: Ints) -> ScalarMappable:
    from matplotlib.colors import to_rgba
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    eye = np.array([np.cos(np.radians(axes.elev)) * np.cos(np.radians(axes.azim)),
                    np.cos(np.radians(axes.elev)) * np.sin(np.radians(axes.azim)),
                    np.sin(np.radians(axes.elev))])  # fmt: skip
    facing = view.normals @ eye
    shown = cells[facing[cells] > 0.0] if view.closed else cells
    mappable = bad_to_good()
    colours = mappable.to_rgba(view.report.shape[shown])
    colours[~view.report.valid[shown]] = to_rgba(INVERTED)
    colours[:, :3] *= (DARKEST + (1.0 - DARKEST) * abs(facing[shown]))[:, None]
    few = len(shown) <= FEW
    seen = np.zeros(len(view.corners), dtype=bool)
    seen[shown] = True
    used = view.points[view.corners[cells]].reshape(-1, 3)
    lines = view.points[view.features[seen[view.beside]]][:, [0, 1, 1]] + NEARER * np.ptp(used) * eye
    black = np.tile(to_rgba(FEATURE_EDGE), (len(lines), 1))
    inner = np.tile(CELL_EDGE, (len(shown), 1)) if few else colours
    drawn = Poly3DCollection(  # edges among the faces, so that what lies behind is hidden
        [*view.points[view.corners[shown]], *lines], facecolors=np.vstack([colours, black]),
        edgecolors=np.vstack([inner, black]), rasterized=not few,
        linewidths=0.6, clip_on=False,
    )  # fmt: skip
    axes.add_collection3d(drawn)
    middle, half = 0.5 * (used.min(axis=0) + used.max(axis=0)), 0.5 * np.ptp(used, axis=0).max()
    for axis, at in zip("xyz", middle.tolist(), strict=True):
        getattr(axes, f"set_{axis}lim")(at - half, at + half)
    axes.set_axis_off()
    axes.set_box_aspect((1, 1, 1), zoom=1.2)
    return mappable
