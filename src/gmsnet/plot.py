"""Pictures of meshes and their quality: cells from blue (good) to yellow (bad), inverted ones red, and histograms.

The only place that imports matplotlib, on use and without its global state, so no display is needed.
"""

from __future__ import annotations

import io
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError, MissingExtraError
from gmsnet.io.atomic import replace_files
from gmsnet.measure import QualityReport, measure
from gmsnet.mesh import CORNERS, CellBlock, Mesh
from gmsnet.topology import Topology

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg", ".pdf")
DPI = 150
BAD_TO_GOOD = ["#ffd60a", "#e9c46a", "#8fb8a0", "#3f7fb5", "#103a80"]  # yellow … blue; also apart in grey print
INVERTED = "#d1001f"
OTHER_CELLS = "#e6e6e6"
BEFORE, AFTER = "#e0a800", "#173f7a"  # the two histograms
EDGE = "#ffffff"
PANEL = 4.8  # inches
MANY = 20_000  # more cells than this are an image in SVG and PDF, so that the file stays small, and share one style
ZOOM_CELLS = 150  # about as many cells are seen around the worst one
ZOOM_FROM = 0.2  # if they take less of the picture than this
RING_BELOW = 0.03
WIDE = 2.6  # meshes wider than this (width over height) go one above the other


def plot_smoothing(before: Mesh, after: Mesh, path: str | os.PathLike[str]) -> None:
    """Write a picture of a mesh before and after smoothing, side by side, with histograms of 1/q and smallest angle.

    Cells are coloured by 1/q. Where cells are too small to be seen in the whole, a second row shows the surroundings
    of the cell that was worst before. path: ``.png``, ``.svg`` or ``.pdf``.
    Raises InputError for another suffix, for meshes that are not planar or have no triangles, for two meshes of
    different cells, and where the file cannot be written; MissingExtraError where matplotlib is not installed.
    """
    if [block.nodes.tobytes() for block in before.cells] != [block.nodes.tobytes() for block in after.cells]:
        raise InputError("a picture of before and after needs two meshes of the same cells")
    check_mesh(before)
    topology = Topology.of(before)  # wound as before, a cell that has turned over since is drawn as inverted
    _save([_View.of(before, "before", BEFORE, topology), _View.of(after, "after", AFTER, topology)], Path(path))


def plot_quality(mesh: Mesh, path: str | os.PathLike[str]) -> None:
    """Write a picture of one mesh and its quality; see plot_smoothing."""
    check_mesh(mesh)
    _save([_View.of(mesh, "", AFTER)], Path(path))


def check_target(path: str | os.PathLike[str]) -> None:
    """Raise what plotting to this path would raise for its suffix, or for want of matplotlib, before any work."""
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        shown = f"the suffix {suffix!r}" if suffix else "no suffix"
        raise InputError(f"{path}: a picture cannot have {shown}: name it .png, .svg or .pdf")
    _need_matplotlib()


def check_mesh(mesh: Mesh) -> None:
    """Raise what plotting this mesh would raise, before any work: InputError unless it is planar and has triangles."""
    if mesh.plane is None:
        raise InputError("a picture shows planar meshes only, and this one varies in x, y and z")
    if not any(_is_triangular(block) and len(block.nodes) for block in mesh.cells):
        raise InputError("a picture shows the quality of triangles, and this mesh has none")


def new_figure(width: float, height: float) -> Figure:
    """An empty figure, in inches, that needs no display. MissingExtraError where matplotlib is not installed."""
    _need_matplotlib()
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def _need_matplotlib() -> None:
    try:
        import matplotlib  # noqa: F401
    except ModuleNotFoundError as error:
        if error.name != "matplotlib":
            raise
        raise MissingExtraError('pictures need matplotlib: pip install "gmsnet[view]"') from error


def _is_triangular(block: CellBlock) -> bool:
    return block.dimension == 2 and CORNERS.get(block.kind) == 3


@dataclass(frozen=True)
class _View:
    """One mesh in its plane. points: (N × 2). corners: (T × 3) of the triangles of ``report``, in its order."""

    title: str
    colour: str
    points: NDArray[np.float64]
    corners: NDArray[np.int64]
    report: QualityReport
    others: Sequence[NDArray[np.int64]]  # corners of faces that are no triangles
    lines: NDArray[np.int64]

    @classmethod
    def of(cls, mesh: Mesh, title: str, colour: str, topology: Topology | None = None) -> _View:
        assert mesh.plane is not None
        triangles = [block.nodes[:, :3] for block in mesh.cells if _is_triangular(block)]
        faces = [b for b in mesh.cells if b.dimension == 2 and len(b.nodes) and not _is_triangular(b)]
        others = [block.nodes[:, : CORNERS.get(block.kind, block.nodes.shape[1])] for block in faces]
        lines = [block.nodes[:, :2] for block in mesh.cells if block.dimension == 1]
        return cls(
            title,
            colour,
            mesh.points[:, list(mesh.plane)],
            np.concatenate(triangles),
            measure(mesh, topology),
            others,
            np.concatenate([np.zeros((0, 2), dtype=np.int64), *lines]),
        )

    @property
    def box(self) -> NDArray[np.float64]:
        """(2 × 2) least and greatest coordinates of the nodes that are drawn."""
        used = self.points[np.unique(np.concatenate([self.corners.ravel(), *(o.ravel() for o in self.others)]))]
        return np.stack([used.min(axis=0), used.max(axis=0)])

    @property
    def summary(self) -> str:
        """The figures above the picture."""
        least, mean = self.report.shape.min(), self.report.shape.mean()
        inverted = f", {self.report.inverted:,} inverted" if self.report.inverted else ""
        text = f"1/q  min {least:.3f}, mean {mean:.3f}{inverted}"
        return f"{self.title}:  {text}" if self.title else text


def _save(views: list[_View], path: Path) -> None:
    check_target(path)
    figure = _figure(views)
    buffer = io.BytesIO()
    figure.savefig(buffer, format=path.suffix.lower()[1:], dpi=DPI)
    replace_files({os.fspath(path): buffer.getvalue()})


def _figure(views: list[_View]) -> Figure:
    from matplotlib.gridspec import GridSpec

    box = np.stack([np.min([v.box[0] for v in views], axis=0), np.max([v.box[1] for v in views], axis=0)])
    width, height = np.maximum(box[1] - box[0], np.finfo(float).tiny).tolist()
    window = _surroundings(views[0], max(width, height))
    wide = width > WIDE * height
    alone = wide or (len(views) == 1 and window is None)  # each overall view has a row of its own
    panel = (2.0 if alone else 1.0) * PANEL
    overview = float(np.clip(panel * height / width, 1.2, 6.5))
    rows = [overview] * (len(views) if alone else 1)
    if window is not None and (alone or len(views) == 2):
        rows.append(PANEL)
    rows.append(2.0)
    figure = new_figure(2 * PANEL + 1.4, sum(rows) + 0.45 * len(rows))
    grid = GridSpec(len(rows), 2, figure=figure, height_ratios=rows)
    places: list[tuple[int, int | slice]] = (
        [(row, slice(None)) for row in range(len(views))] if alone else [(0, column) for column in range(2)]
    )
    maps = [figure.add_subplot(grid[place]) for place in places[: len(views)]]
    for axes, view in zip(maps, views, strict=True):
        axes.set_title(view.summary, fontsize=10)
        mappable = _draw(axes, view, box)
        if window is not None:
            _frame(axes, window)
    if window is not None:
        free = places[1:] if not alone and len(views) == 1 else [(len(rows) - 2, column) for column in range(2)]
        worst = views[0].corners[views[0].report.worst(1)[0]]
        for view, place, where in zip(views, free, ("around its worst cell", "the same place"), strict=False):
            zoom = figure.add_subplot(grid[place])
            zoom.set_title(f"{view.title}:  {where}" if view.title else where, fontsize=10)
            _draw(zoom, view, window)
            zoom.spines[:].set_visible(True)
            cell = view.points[worst]
            if np.ptp(cell, axis=0).max() < 4 * RING_BELOW * np.ptp(window, axis=0).max():
                zoom.plot(*cell.mean(axis=0), "o", ms=32, mfc="none", mec="black", mew=1.2, clip_on=False)
            else:
                zoom.fill(*cell.T, fill=False, edgecolor="black", linewidth=1.2)
            maps.append(zoom)
    figure.colorbar(mappable, ax=maps, label="1/q (1 equilateral, 0 flat; red: inverted)", aspect=40, pad=0.01)
    _histogram(figure.add_subplot(grid[-1, 0]), views, "shape", "1/q")
    _histogram(figure.add_subplot(grid[-1, 1]), views, "min_angle", "smallest angle of a cell (degrees)")
    return figure


def _surroundings(view: _View, extent: float) -> NDArray[np.float64] | None:
    """(2 × 2) a square around the worst cell, or None where its cells can be seen in the whole picture."""
    corners = view.points[view.corners]
    centres = corners.mean(axis=1)
    worst = int(view.report.worst(1)[0])
    distance = np.abs(centres - centres[worst]).max(axis=1)
    near = np.partition(distance, min(ZOOM_CELLS, len(distance) - 1))[: ZOOM_CELLS + 1].max()
    half = max(float(near), 1.2 * float(np.abs(corners[worst] - centres[worst]).max()))
    if half > ZOOM_FROM * extent:
        return None
    low, high = view.box  # at the rim of the mesh the square moves inwards, so that it shows cells
    centre = np.where(high - low > 2 * half, np.clip(centres[worst], low + half, high - half), (low + high) / 2)
    reach = np.minimum(half, (high - low) / 2)
    return np.stack([centre - reach, centre + reach])


def _draw(axes: Axes, view: _View, box: NDArray[np.float64]) -> ScalarMappable:
    """The cells that lie in the box, and the lines; good cells first, so that the worst lie on top."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.colors import LinearSegmentedColormap, Normalize, to_rgba

    span = box[1] - box[0]
    low, high = box[0] - 0.01 * span, box[1] + 0.01 * span
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.spines[:].set_visible(False)
    mappable = ScalarMappable(Normalize(0.0, 1.0), LinearSegmentedColormap.from_list("bad to good", BAD_TO_GOOD))

    def seen(nodes: NDArray[np.int64]) -> NDArray[np.bool_]:
        corners = view.points[nodes]
        inside: NDArray[np.bool_] = ((corners.max(axis=1) >= low) & (corners.min(axis=1) <= high)).all(axis=1)
        return inside

    rows = np.flatnonzero(seen(view.corners))
    rows = rows[np.argsort(-view.report.shape[rows], kind="stable")]
    polygons = view.points[view.corners[rows]]
    colours = mappable.to_rgba(view.report.shape[rows])
    colours[view.report.valid[rows] <= 0] = to_rgba(INVERTED)
    # White edges fade out where cells are specks; slivers are outlined in their own colour, or they would drown in it.
    thickness = _thickness(polygons) / max(span.max(), np.finfo(float).tiny) * PANEL * 72
    white = np.clip((thickness - 2.0) / 4.0, 0.0, 0.9)[:, None]
    edges = white * np.array(to_rgba(EDGE)) + (1.0 - white) * colours
    many = len(rows) > MANY
    widths: Any = 0.25 if many else np.clip(0.03 * thickness, 0.25, 0.6)
    for nodes in view.others:
        faces = view.points[nodes[seen(nodes)]]
        other = PolyCollection(list(faces), facecolors=OTHER_CELLS, edgecolors=EDGE, linewidths=0.3, rasterized=many)
        axes.add_collection(other, autolim=False)
    cells = PolyCollection(
        cast(Any, polygons), facecolors=colours, edgecolors=edges, linewidths=widths, rasterized=many
    )
    axes.add_collection(cells, autolim=False)
    lines = LineCollection(
        list(view.points[view.lines[seen(view.lines)]]), colors="black", linewidths=0.9, rasterized=many
    )
    axes.add_collection(lines, autolim=False)
    return mappable


def _thickness(polygons: NDArray[np.float64]) -> NDArray[np.float64]:
    """(T,) the least height of each triangle."""
    edges = polygons - np.roll(polygons, 1, axis=1)
    (ax, ay), (bx, by) = edges[:, 0].T, edges[:, 1].T
    longest = np.sqrt((edges**2).sum(axis=2).max(axis=1))
    thickness: NDArray[np.float64] = np.abs(ax * by - ay * bx) / np.maximum(longest, np.finfo(float).tiny)
    return thickness


def _frame(axes: Axes, window: NDArray[np.float64]) -> None:
    """Marks on the whole picture where the zoom is; a frame too small to be seen gets a ring around it."""
    from matplotlib.patches import Rectangle

    width, height = window[1] - window[0]
    for colour, thick in (("white", 3.0), ("black", 1.3)):
        axes.add_patch(Rectangle(tuple(window[0]), width, height, fill=False, edgecolor=colour, linewidth=thick))
        if max(width, height) < RING_BELOW * max(np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())):
            axes.plot(*window.mean(axis=0), "o", ms=18, mfc="none", mec=colour, mew=thick, clip_on=False)


def _histogram(axes: Axes, views: list[_View], name: str, label: str) -> None:
    values = [getattr(view.report, name) for view in views]
    low = min([0.0, *(float(v.min()) for v in values)])
    bins = np.linspace(low, 60.0 if name == "min_angle" else 1.0, 61).tolist()
    for view, each in zip(views, values, strict=True):
        share = np.full(len(each), 100.0 / len(each))
        axes.hist(each, bins, weights=share, color=view.colour, alpha=0.35, edgecolor="none")
        axes.hist(each, bins, weights=share, color=view.colour, histtype="step", linewidth=1.4, label=view.title)
        axes.plot(each.min(), 0.0, marker="v", color=view.colour, markersize=7, clip_on=False, zorder=3)
    axes.set_xlabel(f"{label}; ▾ the least")
    axes.set_ylabel("share of cells (%)")
    axes.set_xlim(bins[0], bins[-1])
    axes.spines[["top", "right"]].set_visible(False)
    if len(views) > 1:
        axes.legend(loc="upper left", frameon=False)
