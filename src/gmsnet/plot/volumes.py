"""Pictures of meshes of volumes: the worst cells within the boundary, and histograms of η and dihedral angles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.errors import InputError
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.measure.palette import AFTER, BEFORE, INVERTED
from gmsnet.measure.report import QualityReport, measure
from gmsnet.mesh.mesh import Mesh
from gmsnet.plot.figure import new_figure
from gmsnet.plot.histogram import histogram
from gmsnet.plot.view import EDGE, bad_to_good
from gmsnet.topology.mixed_volume import volume_of, wound_of
from gmsnet.topology.volume import Volume

if TYPE_CHECKING:
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure

WORST = 60  # cells that are shown
MOST_FACES = 5000  # of the boundary that are drawn
HISTOGRAMS = (
    ("shape", "η"),
    ("min_dihedral", "smallest dihedral angle (°)"),
    ("max_dihedral", "greatest dihedral angle (°)"),
)


@dataclass(frozen=True)
class Space:
    """A mesh of volumes, measured."""

    title: str
    colour: str
    mesh: Mesh
    report: QualityReport

    @classmethod
    def of(cls, mesh: Mesh, title: str, colour: str, topology: Volume) -> Space:
        """topology: of the mesh, or of another state of it; cells that have turned over since are inverted."""
        return cls(title, colour, mesh, measure(mesh, topology))

    @property
    def quads(self) -> bool:
        """See ``Shown``."""
        return True

    @property
    def summary(self) -> str:
        """The figures above the picture."""
        report = self.report
        inverted = f", {report.inverted:,} inverted" if report.inverted else ""
        least, greatest = report.column("min_dihedral").min(), report.column("max_dihedral").max()
        text = f"η  min {report.shape.min():.3f}, mean {report.shape.mean():.3f}{inverted}\n"
        text += f"dihedral angles {least:.1f}° to {greatest:.1f}°"
        return f"{self.title}:  {text}" if self.title else text


def volume_figure(meshes: Sequence[Mesh]) -> Figure:
    """The picture of one mesh, or of the same before and after smoothing."""
    topology = volume_of(wound_of(meshes[0]))
    titles = ("before", "after") if len(meshes) == 2 else ("",)
    colours = (BEFORE, AFTER)[-len(meshes) :]
    views = [Space.of(*each, topology) for each in zip(meshes, titles, colours, strict=True)]
    if not len(views[0].report.shape):
        raise InputError(
            "a picture of volumes shows the quality of their cells, and this mesh has none that is measured"
        )
    figure = new_figure(11.0, 8.4)
    rows: Any = figure.subfigures(2, 1, height_ratios=[2.7, 1.0])
    worst, faces = views[0].report.worst(WORST), _boundary(meshes[0])
    maps = [rows[0].add_subplot(1, len(views), k + 1, projection="3d") for k in range(len(views))]
    for axes, view in zip(maps, views, strict=True):
        axes.set_title(view.summary, fontsize=10)
        mappable = _draw(axes, view, worst, faces)
    label = f"η of the {len(worst)} cells that {'were' if len(views) == 2 else 'are'} the worst (red: inverted)"
    rows[0].colorbar(mappable, ax=maps, label=label, aspect=30, pad=0.08, shrink=0.8)
    for axes, (name, title) in zip(rows[1].subplots(1, len(HISTOGRAMS)), HISTOGRAMS, strict=True):
        histogram(axes, views, name, title)
    return figure


def _draw(axes: Any, view: Space, worst: NDArray[np.int64], faces: Sequence[NDArray[np.int64]]) -> ScalarMappable:
    from matplotlib.colors import to_rgba
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    mappable = bad_to_good()
    colours = mappable.to_rgba(view.report.shape[worst])
    colours[~view.report.valid[worst]] = to_rgba(INVERTED)
    numbers = view.report.cell[worst]
    colour_of = dict(zip(numbers.tolist(), colours, strict=True))
    points, step = view.mesh.points, 1 + sum(map(len, faces)) // MOST_FACES
    pale = {"facecolors": (0.5, 0.5, 0.5, 0.05), "edgecolors": (0.5, 0.5, 0.5, 0.12), "linewidths": 0.3}
    for shell in faces:
        axes.add_collection3d(Poly3DCollection(points[shell[::step]], rasterized=True, **pale))
    for nodes, owner in _facets(view.mesh, numbers):
        of_cells = [colour_of[number] for number in owner.tolist()]
        axes.add_collection3d(Poly3DCollection(points[nodes], facecolors=of_cells, edgecolors=EDGE, linewidths=0.2))
    used = points[sorted_unique(np.concatenate([nodes.ravel() for nodes, _ in _facets(view.mesh)]))]
    low, span = used.min(axis=0), np.ptp(used, axis=0)
    for axis, start, extent in zip("xyz", low, span, strict=True):
        getattr(axes, f"set_{axis}lim")(start, start + extent)
    axes.set_axis_off()
    axes.set_box_aspect(np.maximum(span, 1e-3 * span.max()))
    return mappable


def _facets(mesh: Mesh, chosen: NDArray[np.int64] | None = None) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """The facets of volume cells, of three corners and of four: nodes (F, 3 or 4), and the cell (F,) of each.

    chosen: the numbers of the cells that are wanted, among all cells, in this order within a block; None: all.
    """
    found: dict[int, list[tuple[Any, Any]]] = {3: [], 4: []}
    first = 0
    for block in mesh.cells:
        numbers = first + np.arange(len(block.nodes))
        first += len(block.nodes)
        kind = CELLS.get(block.kind)
        if kind is None or kind.dimension != 3 or kind.corners is None:
            continue
        if chosen is not None:
            numbers = chosen[np.isin(chosen, numbers)]
        nodes = np.asarray(block.nodes)[numbers - (first - len(block.nodes))]
        facets = [[node for node in facet if node < kind.corners] for facet in kind.facets]
        for size, parts in found.items():
            own = [facet for facet in facets if len(facet) == size]
            if own:
                parts.append((nodes[:, own].reshape(-1, size), np.repeat(numbers, len(own))))
    return [tuple(map(np.concatenate, zip(*parts, strict=True))) for parts in found.values() if parts]  # type: ignore[misc]


def _boundary(mesh: Mesh) -> list[NDArray[np.int64]]:
    """The facets of one cell alone, of three corners and of four."""
    outer = []
    for nodes, _ in _facets(mesh):
        _, first, count = np.unique(np.sort(nodes, axis=1), axis=0, return_index=True, return_counts=True)
        outer.append(nodes[np.sort(first[count == 1])])
    return outer
