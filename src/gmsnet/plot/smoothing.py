"""A mesh before and after smoothing, or one mesh: the whole, the surroundings of its worst cell, and histograms."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.io.atomic import replace_files
from gmsnet.measure.palette import AFTER, BEFORE
from gmsnet.mesh.mesh import Mesh
from gmsnet.plot.figure import check_target, file_bytes, new_figure
from gmsnet.plot.histogram import histogram
from gmsnet.plot.surfaces import surface_figure
from gmsnet.plot.view import View, add_colour_bar, check_mesh, draw
from gmsnet.plot.volumes import volume_figure
from gmsnet.plot.zoom import RING_BELOW, frame, surroundings
from gmsnet.topology.topology import Topology

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PANEL = 4.8  # inches
ZOOM_CELLS = 150  # about as many cells are seen around the worst one
ZOOM_FROM = 0.2  # if they take less of the picture than this
WIDE = 2.6  # meshes wider than this (width over height) go one above the other


def plot_smoothing(before: Mesh, after: Mesh, path: str | os.PathLike[str]) -> None:
    """Write a picture of a mesh before and after smoothing, side by side, with histograms of 1/q and smallest angle.

    Cells are coloured by 1/q. Where cells are too small to be seen in the whole, a second row shows the surroundings
    of the cell that was worst before. Of surfaces in space, the same is shaded, with their feature edges. Of volumes,
    the worst cells are shown within the boundary, with histograms of η and dihedral angles.
    path: ``.png``, ``.svg`` or ``.pdf``.
    Raises InputError for another suffix, for meshes without measured cells, for two meshes of
    different cells, and where the file cannot be written; MissingExtraError where matplotlib is not installed.
    """
    if [block.nodes.tobytes() for block in before.cells] != [block.nodes.tobytes() for block in after.cells]:
        raise InputError("a picture of before and after needs two meshes of the same cells")
    check_mesh(before)
    if before.has_volumes:
        return _save(volume_figure([before, after]), path)
    if before.plane is None:
        return _save(surface_figure([before, after]), path)
    topology = Topology.of(before)  # wound as before, a cell that has turned over since is drawn as inverted
    views = [View.of(before, "before", BEFORE, topology), View.of(after, "after", AFTER, topology)]
    return _save(_figure(views), path)


def plot_quality(mesh: Mesh, path: str | os.PathLike[str]) -> None:
    """Write a picture of one mesh and its quality; see plot_smoothing."""
    check_mesh(mesh)
    if mesh.has_volumes:
        return _save(volume_figure([mesh]), path)
    return _save(surface_figure([mesh]) if mesh.plane is None else _figure([View.of(mesh, "", AFTER)]), path)


def _save(figure: Figure, path: str | os.PathLike[str]) -> None:
    check_target(path)
    replace_files({os.fspath(path): file_bytes(figure, Path(path).suffix)})


def _figure(views: Sequence[View]) -> Figure:
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
        mappable = draw(axes, view, box)
        if window is not None:
            frame(axes, window)
    if window is not None:
        free = places[1:] if not alone and len(views) == 1 else [(len(rows) - 2, column) for column in range(2)]
        worst = views[0].corners[views[0].report.worst(1)[0]]
        for view, place, where in zip(views, free, ("around its worst cell", "the same place"), strict=False):
            zoom = figure.add_subplot(grid[place])
            zoom.set_title(f"{view.title}:  {where}" if view.title else where, fontsize=10)
            draw(zoom, view, window)
            zoom.spines[:].set_visible(True)
            cell = view.points[worst]
            if np.ptp(cell, axis=0).max() < 4 * RING_BELOW * np.ptp(window, axis=0).max():
                zoom.plot(*cell.mean(axis=0), "o", ms=32, mfc="none", mec="black", mew=1.2, clip_on=False)
            else:
                zoom.fill(*cell.T, fill=False, edgecolor="black", linewidth=1.2)
            maps.append(zoom)
    add_colour_bar(figure, mappable, maps)
    histogram(figure.add_subplot(grid[-1, 0]), views, "shape", "1/q")
    histogram(figure.add_subplot(grid[-1, 1]), views, "min_angle", "smallest angle of a cell (degrees)")
    return figure


def _surroundings(view: View, extent: float) -> NDArray[np.float64] | None:
    """(2 × 2) a square around the worst cell, or None where its cells can be seen in the whole picture."""
    window = surroundings(view, ZOOM_CELLS)
    return None if float(np.ptp(window, axis=0).max()) > 2 * ZOOM_FROM * extent else window
