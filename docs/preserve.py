"""Generates docs/preserve.md and its pictures: what each choice of ``preserve`` does to layers and near a refined wall.

python docs/preserve.py

The meshes are generated: a body with layers of triangles, the nodes outside of which were thrown about, and a plate
refined towards a hole, as it is. Cells in the pictures are coloured by how their areas differ from those of the mesh
before nodes were thrown.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

import gmsnet
from gmsnet import Mesh
from gmsnet.generate import Curve, disturb, good_mesh, layered_mesh
from gmsnet.topology.topology import Topology

TARGET = Path(__file__).with_name("preserve.md")
LAYERS, AROUND, ASPECT = 12, 60, 40.0
RADIUS, NEAR = 0.5, 0.02  # of the hole; how near to it cells count, in diameters
THROWN = 0.5  # edges
MOST = 1.6  # a factor of areas: the end of the colours
CHOICES: dict[str, tuple[str, dict[str, Any]]] = {
    "shape": (
        '`preserve="shape"`, the default, holds the nodes of layers of walls, lets areas near refined walls change '
        "by a tenth at most and heights of the cells on them by a fiftieth, and smooths all else as far as it goes.",
        {},
    ),
    "size": (
        '`preserve="size"` holds layers, too, and weighs the areas of all cells of the mesh against their shapes, '
        "without a bound. It is of meshes in a plane.",
        {"preserve": "size"},
    ),
    "metric": (
        '`preserve="metric"` takes the stretch and the sizes of the cells for a smooth field, and smooths all cells '
        "towards it, layers too. It is of meshes in a plane.",
        {"preserve": "metric"},
    ),
    "none": ('`preserve="none"` smooths all free nodes for shape alone.', {"preserve": "none"}),
    "fix-layers": (
        "`fix_layers=True` holds all cells that are stretched alike with their neighbours, layers of a wall or not, "
        'whatever `preserve` is; here with `preserve="none"`.',
        {"preserve": "none", "fix_layers": True},
    ),
}


class Case(NamedTuple):
    """meant: the mesh as it was made. given: the same, thrown about. near: (T,) bool, the cells whose areas count."""

    meant: Mesh
    given: Mesh
    near: NDArray[np.bool_]
    centre: tuple[float, float]
    width: float


def with_layers() -> Case:
    """A circle with layers, thrown about outside of them."""
    mesh = layered_mesh(LAYERS, ASPECT, AROUND, body="circle")
    outside = Topology.of(mesh).free
    outside = outside[outside >= (LAYERS + 1) * AROUND]
    near = (Topology.of(mesh).triangles < 3 * AROUND).all(axis=1)
    return Case(mesh, disturb(mesh, outside, THROWN, seed=1), near, (0.95, 0.35), 0.9)


def with_refinement() -> Case:
    """A plate refined towards a hole."""
    turn = np.linspace(0.0, 2.0 * np.pi, 400)
    hole = Curve(RADIUS * np.column_stack([np.cos(turn), np.sin(turn)]), "hole")
    side = Curve(4.0 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]]), "side")
    mesh = good_mesh([[side], [hole]], lambda x: 0.01 + 0.25 * np.abs(np.linalg.norm(x, axis=1) - RADIUS))
    middle = mesh.points[Topology.of(mesh).triangles].mean(axis=1)
    near = np.linalg.norm(middle, axis=1) - RADIUS <= NEAR * 2.0 * RADIUS
    return Case(mesh, mesh, near, (0.52, 0.0), 0.16)


def areas(mesh: Mesh) -> NDArray[np.float64]:
    """(T,) of the triangles."""
    a, b, c = (mesh.points[Topology.of(mesh).triangles[:, k]] for k in range(3))
    found: NDArray[np.float64] = 0.5 * np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    return found


def spacings(mesh: Mesh) -> NDArray[np.float64]:
    """(LAYERS, AROUND) between the rows of layers."""
    rows = mesh.points[: (LAYERS + 1) * AROUND].reshape(LAYERS + 1, AROUND, 2)
    found: NDArray[np.float64] = np.linalg.norm(np.diff(rows, axis=0), axis=2)
    return found


def heights(mesh: Mesh) -> NDArray[np.float64]:
    """(k,) of the triangles with two corners at the hole, over these."""
    triangles = Topology.of(mesh).triangles
    wall = np.isin(triangles, mesh.markers["hole"])
    on_wall = wall.sum(axis=1) == 2
    ends = mesh.points[triangles[on_wall][wall[on_wall]].reshape(-1, 2)]
    return 2.0 * areas(mesh)[on_wall] / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)


def draw(figure: Figure, place: int, case: Case, mesh: Mesh, title: str) -> PolyCollection:
    """One panel; the cells by log of their area over that of ``meant``."""
    axes = figure.add_subplot(1, 2, place)
    change = np.log(areas(mesh) / areas(case.meant))
    norm = TwoSlopeNorm(0.0, -np.log(MOST), np.log(MOST))
    cells = PolyCollection(
        mesh.points[Topology.of(mesh).triangles], array=change, cmap="RdBu_r", norm=norm, edgecolors="#333333",
        linewidths=0.4,
    )  # fmt: skip
    axes.add_collection(cells)
    (x, y), half = case.centre, 0.5 * case.width
    axes.set(xlim=(x - half, x + half), ylim=(y - half, y + half), xticks=[], yticks=[], aspect="equal")
    axes.set_title(title, fontsize=10)
    return cells


def picture(name: str, cases: tuple[Case, Case], meshes: tuple[Mesh, Mesh]) -> None:
    """Both cases side by side, to docs/preserve-NAME.png."""
    figure = Figure(figsize=(9.0, 4.4), layout="constrained")
    for place, (case, mesh, title) in enumerate(zip(cases, meshes, ("layers", "refined wall"), strict=True), 1):
        cells = draw(figure, place, case, mesh, title)
    bar = figure.colorbar(cells, ax=figure.axes, shrink=0.8, label="area over that meant")
    ticks = [1.0 / MOST, 1.0 / 1.25, 1.0 / 1.1, 1.1, 1.25, MOST]
    bar.set_ticks(np.log(ticks).tolist(), labels=[f"{tick:.2f}" for tick in ticks])
    figure.savefig(TARGET.with_name(f"preserve-{name}.png"), dpi=80, metadata={"Software": None})


def row(name: str, cases: tuple[Case, Case], given: tuple[Mesh, Mesh], meshes: tuple[Mesh, Mesh]) -> str:
    """Of the table: q̂, minimum 1/q, changes of areas, and those of the spacing of the rows, or of heights on a wall."""
    texts = [name]
    for k, (case, before, mesh) in enumerate(zip(cases, given, meshes, strict=True)):
        report = gmsnet.quality(mesh)
        change = np.abs(areas(mesh) / areas(before) - 1.0)[case.near].max()
        texts += [f"{report.qhat:.3f}", f"{report.shape.min():.3f}", f"{100.0 * change:.0f} %"]
        was, now = (heights(m) if k else spacings(m) for m in (case.meant, mesh))
        texts.append(f"{100.0 * np.abs(now / was - 1.0).max():.0f} %")
    return "| " + " | ".join(texts) + " |"


def main() -> None:
    """Writes the page and the pictures."""
    cases = with_layers(), with_refinement()
    given = cases[0].given, cases[1].given
    lines = [
        "# What `preserve` keeps",
        "",
        "Made by `python docs/preserve.py`. Left: a circle with twelve rows of layers, of which the mesh outside was",
        "thrown about. Right: a plate refined towards a hole, as a mesh generator made it. Colours say how large",
        "cells are beside those of the mesh before nodes were thrown: white ones are as large as they were.",
        "",
        "The input:",
        "",
        "![input](preserve-input.png)",
        "",
    ]
    picture("input", cases, given)
    table = [row("input", cases, given, given)]
    for name, (sentence, options) in CHOICES.items():
        one, two = (gmsnet.smooth(case.given, **options).mesh for case in cases)
        picture(name, cases, (one, two))
        table.append(row(name, cases, given, (one, two)))
        lines += [sentence, "", f"![{name}](preserve-{name}.png)", ""]
    lines += [
        "The figures. Areas are compared with the input's: of the first two rows of the layers, and within 2 % of the",
        "hole's diameter. Spacings are those between all rows, heights those of the cells at the hole, normal to both.",
        "[How layers and walls are told](auto.md#what-is-taken-for-intent).",
        "",
        "| | layers: q̂ | least 1/q | areas by | spacings by | wall: q̂ | least 1/q | areas by | heights by |",
        "|---|---|---|---|---|---|---|---|---|",
        *table,
    ]
    TARGET.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
