"""Two meshes side by side: ``gmsnet quality IN OTHER``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import typer

from gmsnet import io
from gmsnet.cli import output, report
from gmsnet.cli.destination import shown
from gmsnet.errors import InputError
from gmsnet.measure.report import QualityReport
from gmsnet.measure.worst import named_cells
from gmsnet.mesh.display import amount, plain
from gmsnet.mesh.known_cells import counts
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.api import quality


def compare(paths: Sequence[str], threshold: float | None, format: str | None, *, json: bool) -> int:
    """Prints both, as tables or as one document. Returns 1 where a cell of either is below the threshold, else 0."""
    if paths[0] == paths[1] == "-":
        raise InputError("the standard input can be read once: give the other mesh as a file")
    meshes = [io.read(path, format) for path in paths]
    reports = [_measured(path, mesh) for path, mesh in zip(paths, meshes, strict=True)]
    if meshes[0].has_volumes != meshes[1].has_volumes:
        raise InputError(f"{shown(paths[0])} and {shown(paths[1])}: volumes and faces have no measures in common")
    moved = _moves(*meshes)
    few = [0 if threshold is None else int((found.shape < threshold).sum()) for found in reports]
    if json:
        meshes_told = [_document(*each, threshold) for each in zip(paths, meshes, reports, few, strict=True)]
        output.print_json({"meshes": meshes_told, "same_cells": moved is not None, **(moved or {})})
    else:
        _print(paths, meshes, reports, moved)
    for path, found, count in zip(paths, reports, few, strict=True):
        if count:
            cells = named_cells(found, found.worst(count), "below it")
            typer.echo(f"gmsnet: {shown(path)}: below the threshold {threshold:g}: {cells}", err=True)
    return 1 if any(few) else 0


def _measured(path: str, mesh: Mesh) -> QualityReport:
    try:
        found = quality(mesh)
    except InputError as error:
        raise InputError(f"{shown(path)}: {error}") from error
    if not len(found.cell):
        raise InputError(f"{shown(path)}: the mesh has no cells that can be measured, so there is nothing to compare")
    return found


def _moves(one: Mesh, other: Mesh) -> dict[str, Any] | None:
    """How many nodes are elsewhere, and by how much at most; None where the two have not the same cells."""
    alike = one.points.shape == other.points.shape and len(one.cells) == len(other.cells)
    if not alike or not all(
        a.kind == b.kind and np.array_equal(a.nodes, b.nodes) for a, b in zip(one.cells, other.cells, strict=True)
    ):
        return None
    way = np.linalg.norm(other.points - one.points, axis=1)
    return {"moved": int(np.count_nonzero(way)), "largest_move": float(way.max(initial=0.0))}


def _document(path: str, mesh: Mesh, found: QualityReport, few: int, threshold: float | None) -> dict[str, Any]:
    document = {"input": path, "nodes": len(mesh.points), "planar": mesh.plane is not None, **found.summary()}
    return document if threshold is None else {**document, "threshold": threshold, "below_threshold": few}


def _print(
    paths: Sequence[str], meshes: Sequence[Mesh], reports: Sequence[QualityReport], moved: dict[str, Any] | None
) -> None:
    console = output.console()
    names = ["first", "second"]
    for name, path, mesh in zip(names, paths, meshes, strict=True):
        console.print(f"{name}: {shown(path)}: {counts(mesh)}")
    console.print()
    console.print(report.figures(dict(zip(names, reports, strict=True))))
    if moved is None:
        console.print("the two have other cells, so their nodes are not compared")
    else:
        far = plain(moved["largest_move"])
        console.print(f"the same cells; {amount(moved['moved'], 'node')} elsewhere, the furthest by {far}")
