"""A mesh of OpenFOAM as decomposePar leaves it: a folder for each processor, with patches to the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from support.foam import head, in_text

Cell = list[list[int]]


def processors(
    points: Sequence[Any], cells: Sequence[Cell], parts: Sequence[Sequence[int]], patches: dict[str, str],
    patch_of: Callable[[list[int]], str], make: Callable[[Any], dict[str, bytes]] = in_text, ids: bool = True,
) -> dict[str, bytes]:  # fmt: skip
    """Path below the case → the file. cells: the faces of each, seen from outside. parts: the cells of each processor.

    patches: name → type, in their order. patch_of: of a face on the boundary. ids: with the numbers of points.
    """
    home = {cell: k for k, part in enumerate(parts) for cell in part}
    beside: dict[tuple[int, ...], list[int]] = {}
    for cell, faces in enumerate(cells):
        for face in faces:
            beside.setdefault(tuple(sorted(face)), []).append(cell)
    found = {}
    for k, part in enumerate(parts):
        lists, own = _lists(points, cells, part, k, home, beside, patches, patch_of)
        files = make(lists)
        if ids:
            numbers = "\n".join(map(str, own))
            files["pointProcAddressing"] = f"{head('labelList', 'x')}{len(own)}\n(\n{numbers}\n)\n".encode()
        found |= {f"processor{k}/constant/polyMesh/{name}": data for name, data in files.items()}
    return found


def _lists(
    points: Sequence[Any], cells: Sequence[Cell], part: Sequence[int], k: int, home: dict[int, int],
    beside: dict[tuple[int, ...], list[int]], patches: dict[str, str], patch_of: Callable[[list[int]], str],
) -> tuple[dict[str, Any], list[int]]:  # fmt: skip
    own = sorted({node for cell in part for face in cells[cell] for node in face})
    at, number = {node: j for j, node in enumerate(own)}, {cell: j for j, cell in enumerate(part)}
    kinds = dict(patches)
    rows = []
    for cell in part:
        for face in cells[cell]:
            others = [each for each in beside[tuple(sorted(face))] if each != cell]
            if others and home[others[0]] == k:
                if number[cell] < number[others[0]]:
                    rows.append((-1, number[cell], number[others[0]], face))
                continue
            name = f"procBoundary{k}to{home[others[0]]}" if others else patch_of(face)
            kinds.setdefault(name, "processor")
            rows.append((list(kinds).index(name), number[cell], -1, face))
    rows.sort()
    inner = sum(row[0] < 0 for row in rows)
    counts = [sum(row[0] == j for row in rows) for j in range(len(kinds))]
    boundary = [(name, kind, counts[j], inner + sum(counts[:j])) for j, (name, kind) in enumerate(kinds.items())]
    lists = {
        "points": [points[node] for node in own], "faces": [[at[node] for node in face] for *_, face in rows],
        "owner": [row[1] for row in rows], "neighbour": [row[2] for row in rows[:inner]], "boundary": boundary,
    }  # fmt: skip
    return lists, own


def save(files: dict[str, bytes], case: Path) -> Path:
    """Writes them; returns the folder of the case."""
    for name, data in files.items():
        (case / name).parent.mkdir(parents=True, exist_ok=True)
        (case / name).write_bytes(data)
    return case
