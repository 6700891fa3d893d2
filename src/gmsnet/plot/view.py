"""One mesh as it is drawn: its cells in colours of their quality, faces that are no triangles, and lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.kernels.simplex.bernstein import NAMES
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.measure.palette import AFTER, BAD_TO_GOOD, INVERTED, OTHER_CELLS
from gmsnet.measure.report import QualityReport, measure
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.known_cells import measured
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.topology import Topology

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure

EDGE = "#ffffff"
MANY = 20_000  # more cells than this are an image in SVG and PDF, so that the file stays small, and share one style
PARTS = 4  # of an edge with a middle node, each drawn straight
POINTS = 345.6  # across a picture, in printer's points: 4.8 inches


def check_mesh(mesh: Mesh) -> None:
    """Raise what plotting this mesh would raise, before any work: InputError unless it has measured cells."""
    if not any(measured(mesh, block) and len(block.nodes) for block in mesh.cells):
        if mesh.has_volumes:
            raise InputError("a picture of volumes shows the quality of tetrahedra, and this mesh has none")
        raise InputError("a picture shows the quality of triangles and quads, and this mesh has none")


@dataclass(frozen=True)
class View:
    """One mesh in its plane, measured.

    title, colour: of its histogram. points: (N × 2). corners: (T × 3 or 4) of the cells of ``report``, in its
    order, the last one of a triangle twice where there are quads. others: the corners of other faces. lines: (L × 2)
    the ends of line cells. middles: (T × 3 or 4) of the edges from one corner to the next, −1 where they are straight;
    bends: (L,) of the lines.
    """

    title: str
    colour: str
    points: NDArray[np.float64]
    corners: NDArray[np.int64]
    report: QualityReport
    others: Sequence[NDArray[np.int64]]
    lines: NDArray[np.int64]
    middles: NDArray[np.int64]
    bends: NDArray[np.int64]

    @classmethod
    def of(cls, mesh: Mesh, title: str = "", colour: str = AFTER, topology: Topology | None = None) -> View:
        """A planar mesh; with the topology of another state of it, cells that have turned over since are inverted."""
        assert mesh.plane is not None
        own = [block for block in mesh.cells if measured(mesh, block)]
        width = max(block.corners for block in own)
        corners = [block.nodes[:, np.minimum(np.arange(width), block.corners - 1)] for block in own]
        faces = [b for b in mesh.cells if b.dimension == 2 and len(b.nodes) and not measured(mesh, b)]
        others = [block.nodes[:, : block.corners] for block in faces]
        lines = [block for block in mesh.cells if block.dimension == 1]
        return cls(
            title,
            colour,
            mesh.points[:, list(mesh.plane)],
            np.concatenate(corners),
            measure(mesh, topology),
            others,
            np.concatenate([np.zeros((0, 2), dtype=np.int64), *(block.nodes[:, :2] for block in lines)]),
            np.concatenate([_middles(block, width) for block in own]),
            np.concatenate([np.zeros(0, dtype=np.int64), *(_middles(block, 1)[:, 0] for block in lines)]),
        )

    @property
    def quads(self) -> bool:
        """See ``Shown``."""
        return bool(self.corners.shape[1] == 4)

    def outlines(self, rows: NDArray[np.intp]) -> NDArray[np.float64]:
        """(K × P × 2) the polygons of some cells: edges with a middle node bent through it."""
        corners, middles = self.corners[rows], self.middles[rows]
        if (middles < 0).all():
            return self.points[corners]
        bent = _bent(self.points, corners, np.roll(corners, -1, axis=1), middles)
        return bent.reshape(len(rows), -1, 2)

    def curves(self, rows: NDArray[np.bool_]) -> list[NDArray[np.float64]]:
        """The line cells of some, each (P × 2)."""
        ends, middles = self.lines[rows], self.bends[rows]
        if (middles < 0).all():
            return list(self.points[ends])
        bent = _bent(self.points, ends[:, 0], ends[:, 1], middles)
        return list(np.concatenate([bent, self.points[ends[:, 1]][:, None]], axis=1))

    @property
    def box(self) -> NDArray[np.float64]:
        """(2 × 2) least and greatest coordinates of the nodes that are drawn."""
        nodes = [self.corners.ravel(), self.middles[self.middles >= 0], *(each.ravel() for each in self.others)]
        used = self.points[sorted_unique(np.concatenate(nodes))]
        return np.stack([used.min(axis=0), used.max(axis=0)])

    @property
    def summary(self) -> str:
        """The figures above the picture."""
        least, mean = self.report.shape.min(), self.report.shape.mean()
        inverted = f", {self.report.inverted:,} inverted" if self.report.inverted else ""
        text = f"1/q  min {least:.3f}, mean {mean:.3f}{inverted}"
        return f"{self.title}:  {text}" if self.title else text


def bad_to_good() -> ScalarMappable:
    """The colours of the qualities 0 to 1."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LinearSegmentedColormap, Normalize

    return ScalarMappable(Normalize(0.0, 1.0), LinearSegmentedColormap.from_list("bad to good", BAD_TO_GOOD))


def draw(axes: Axes, view: View, box: NDArray[np.float64] | None = None) -> ScalarMappable:
    """The cells that lie in the box (default: all), and the lines; good cells first, so that the worst lie on top.

    Returns what a colour bar needs.
    """
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.colors import to_rgba

    box = view.box if box is None else box
    span = box[1] - box[0]
    low, high = box[0] - 0.01 * span, box[1] + 0.01 * span
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.spines[:].set_visible(False)
    mappable = bad_to_good()

    def seen(nodes: NDArray[np.int64]) -> NDArray[np.bool_]:
        corners = view.points[nodes]
        inside: NDArray[np.bool_] = ((corners.max(axis=1) >= low) & (corners.min(axis=1) <= high)).all(axis=1)
        return inside

    rows = np.flatnonzero(seen(view.corners))
    rows = rows[np.argsort(-view.report.shape[rows], kind="stable")]
    polygons = view.points[view.corners[rows]]
    drawn = view.outlines(rows)
    colours = mappable.to_rgba(view.report.shape[rows])
    colours[~view.report.valid[rows]] = to_rgba(INVERTED)
    # White edges fade out where cells are specks; slivers are outlined in their own colour, or they would drown in it.
    thickness = _thickness(polygons) / max(span.max(), np.finfo(float).tiny) * POINTS
    white = np.clip((thickness - 2.0) / 4.0, 0.0, 0.9)[:, None]
    edges = white * np.array(to_rgba(EDGE)) + (1.0 - white) * colours
    many = len(rows) > MANY
    widths: Any = 0.25 if many else np.clip(0.03 * thickness, 0.25, 0.6)
    for nodes in view.others:
        faces = view.points[nodes[seen(nodes)]]
        other = PolyCollection(list(faces), facecolors=OTHER_CELLS, edgecolors=EDGE, linewidths=0.3, rasterized=many)
        axes.add_collection(other, autolim=False)
    cells = PolyCollection(cast(Any, drawn), facecolors=colours, edgecolors=edges, linewidths=widths, rasterized=many)
    axes.add_collection(cells, autolim=False)
    lines = LineCollection(view.curves(seen(view.lines)), colors="black", linewidths=0.9, rasterized=many)
    axes.add_collection(lines, autolim=False)
    return mappable


def add_colour_bar(figure: Figure, mappable: ScalarMappable, maps: Sequence[Axes], shrink: float = 1.0) -> None:
    """The legend of the cells' colours, beside the pictures that it belongs to. shrink: its share of their height."""
    label = "1/q (1 equilateral or square,\n0 flat; red: inverted)"  # in two lines, or it is longer than a low bar
    figure.colorbar(mappable, ax=list(maps), label=label, aspect=40 * shrink, pad=0.01, shrink=shrink)


def _middles(block: CellBlock, width: int) -> NDArray[np.int64]:
    """(C × width) the middle nodes of the edges of cells, −1 where there are none."""
    found = np.full((len(block.nodes), width), -1, dtype=np.int64)
    if block.kind == "line3":
        found[:, 0] = block.nodes[:, 2]
    elif block.kind in NAMES:
        edges = np.arange(block.corners)
        edges[-1] = width - 1  # of triangles beside quads the last corner is there twice
        found[:, edges] = block.nodes[:, block.corners : 2 * block.corners]
    return found


def _bent(
    points: NDArray[np.float64], first: NDArray[np.int64], last: NDArray[np.int64], middle: NDArray[np.int64]
) -> NDArray[np.float64]:
    """(… × PARTS × 2) points of edges from their first nodes, which are among them, towards their last."""
    ends = points[first], points[last]
    through = np.where(middle[..., None] < 0, 0.5 * (ends[0] + ends[1]), points[middle])
    start, end, bend = (each[..., None, :] for each in (*ends, through))
    share = np.arange(PARTS)[:, None] / PARTS
    rest = 1.0 - share
    bent: NDArray[np.float64] = (rest - share) * (rest * start - share * end) + 4.0 * share * rest * bend
    return bent


def _thickness(polygons: NDArray[np.float64]) -> NDArray[np.float64]:
    """(T,) the height of each cell over its longest edge, if it were a triangle or a parallelogram."""
    edges = polygons - np.roll(polygons, 1, axis=1)
    longest = np.sqrt((edges**2).sum(axis=2).max(axis=1))
    x, y = polygons[..., 0], polygons[..., 1]
    twice = np.abs((x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1))
    if polygons.shape[1] == 4:
        twice = np.where((polygons[:, 2] == polygons[:, 3]).all(axis=1), twice, 0.5 * twice)
    thickness: NDArray[np.float64] = twice / np.maximum(longest, np.finfo(float).tiny)
    return thickness
