"""Pictures of meshes of tetrahedra: the worst cells within the boundary, and histograms of η and dihedral angles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.tetrahedron import TETRAHEDRON
from gmsnet.measure.palette import AFTER, BEFORE, INVERTED
from gmsnet.measure.report import QualityReport, measure
from gmsnet.mesh.mesh import Mesh
from gmsnet.plot.figure import new_figure
from gmsnet.plot.histogram import histogram
from gmsnet.plot.view import EDGE, bad_to_good
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
    """A mesh of tetrahedra, measured. points: (N, 3). corners: (T, 4) of the cells of ``report``, in its order."""

    title: str
    colour: str
    points: NDArray[np.float64]
    corners: NDArray[np.int32]
    report: QualityReport

    @classmethod
    def of(cls, mesh: Mesh, title: str, colour: str, topology: Volume) -> Space:
        """topology: of the mesh, or of another state of it; cells that have turned over since are inverted."""
        return cls(title, colour, mesh.points, topology.cells, measure(mesh, topology))

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
    topology = Volume.of(meshes[0])
    titles = ("before", "after") if len(meshes) == 2 else ("",)
    colours = (BEFORE, AFTER)[-len(meshes) :]
    views = [Space.of(*each, topology) for each in zip(meshes, titles, colours, strict=True)]
    figure = new_figure(11.0, 8.4)
    rows: Any = figure.subfigures(2, 1, height_ratios=[2.7, 1.0])
    worst, faces = views[0].report.worst(WORST), _boundary(topology.cells)
    maps = [rows[0].add_subplot(1, len(views), k + 1, projection="3d") for k in range(len(views))]
    for axes, view in zip(maps, views, strict=True):
        axes.set_title(view.summary, fontsize=10)
        mappable = _draw(axes, view, worst, faces)
    label = f"η of the {len(worst)} cells that {'were' if len(views) == 2 else 'are'} the worst (red: inverted)"
    rows[0].colorbar(mappable, ax=maps, label=label, aspect=30, pad=0.08, shrink=0.8)
    for axes, (name, title) in zip(rows[1].subplots(1, len(HISTOGRAMS)), HISTOGRAMS, strict=True):
        histogram(axes, views, name, title)
    return figure


def _draw(axes: Any, view: Space, worst: NDArray[np.int64], faces: NDArray[np.int32]) -> ScalarMappable:
    from matplotlib.colors import to_rgba
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    mappable = bad_to_good()
    colours = mappable.to_rgba(view.report.shape[worst])
    colours[~view.report.valid[worst]] = to_rgba(INVERTED)
    facets = np.array(TETRAHEDRON.facets)
    polygons = view.points[view.corners[worst][:, facets]].reshape(-1, 3, 3)
    shell = view.points[faces[:: 1 + len(faces) // MOST_FACES]]
    pale = {"facecolors": (0.5, 0.5, 0.5, 0.05), "edgecolors": (0.5, 0.5, 0.5, 0.12), "linewidths": 0.3}
    axes.add_collection3d(Poly3DCollection(shell, rasterized=True, **pale))
    cells = Poly3DCollection(polygons, facecolors=np.repeat(colours, 4, axis=0), edgecolors=EDGE)
    cells.set_linewidth(0.2)
    axes.add_collection3d(cells)
    used = view.points[np.unique(view.corners)]
    low, span = used.min(axis=0), np.ptp(used, axis=0)
    for axis, start, extent in zip("xyz", low, span, strict=True):
        getattr(axes, f"set_{axis}lim")(start, start + extent)
    axes.set_axis_off()
    axes.set_box_aspect(np.maximum(span, 1e-3 * span.max()))
    return mappable


def _boundary(cells: NDArray[np.int32]) -> NDArray[np.int32]:
    """(B, 3) the facets of one cell alone."""
    facets = cells[:, TETRAHEDRON.facets].reshape(-1, 3)
    _, first, count = np.unique(np.sort(facets, axis=1), axis=0, return_index=True, return_counts=True)
    found: NDArray[np.int32] = facets[np.sort(first[count == 1])]
    return found
