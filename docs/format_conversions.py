"""What a conversion keeps of a mesh, for docs/formats.md: each fact from each format that holds it to all others.

A fact is kept if all of the mesh that is there because of it is there again when the target is read; it is said if the
list that ``gmsnet.io.write`` returns is another one because of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from format_samples import VARIANTS, Variant, points_of

import gmsnet
from gmsnet.errors import FormatError
from gmsnet.io.formats import FORMATS as ALL_FORMATS
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

SOURCES = ("SU2", "Gmsh 2.2, text", "Gmsh 4.1, text", "VTK 4.2, text", "VTU, text", "Medit, 3D", "Triangle",
           "STL, text", "STL, binary", "OBJ", "OFF", "PLY, text", "Abaqus",
           "Nastran, 16 columns", "UGRID, text")  # fmt: skip
MEMORY = "memory"
SILENT = "**silent**"

FORMATS = {key: entry for key, entry in ALL_FORMATS.items() if not entry.own}  # into which meshes are converted

Items = set[object]
Measured = tuple[str, str, bool, dict[str, str]]  # fact, source, is it in the mesh, target → outcome


def _places(mesh: Mesh) -> list[tuple[float, ...]]:
    """The points, in 12 digits: what formats of few columns round off is named in all cases."""
    return [tuple(float(f"{x:.12g}") for x in (*point, 0.0)[:3]) for point in mesh.points.tolist()]


def _cells(mesh: Mesh, chosen: Callable[[CellBlock], bool]) -> list[tuple[str, tuple[object, ...], int]]:
    """Type, corners and region of each cell, in the order of the mesh."""
    places = _places(mesh)
    return [
        (block.kind, tuple(places[node] for node in nodes), region)
        for block in mesh.cells
        if chosen(block)
        for nodes, region in zip(block.nodes.tolist(), block.regions.tolist(), strict=True)
    ]


def _of_dimension(*dimensions: int) -> Callable[[CellBlock], bool]:
    return lambda block: block.dimension in dimensions


def _kind(kind: str) -> Callable[[Mesh], Items]:
    return lambda mesh: {cell[:2] for cell in _cells(mesh, lambda block: block.kind == kind)}


def _together(*dimensions: int) -> Callable[[Mesh], Items]:
    """Sets of the cells that have the same region."""

    def found(mesh: Mesh) -> Items:
        groups: dict[int, list[object]] = {}
        for kind, corners, region in _cells(mesh, _of_dimension(*dimensions)):
            groups.setdefault(region, []).append((kind, corners))
        return {frozenset(cells) for cells in groups.values()}

    return found


def _named(*dimensions: int) -> Callable[[Mesh], Items]:
    def found(mesh: Mesh) -> Items:
        return {
            (name, frozenset(cell[:2] for cell in _cells(mesh, _of_dimension(dim)) if cell[2] == region))
            for (dim, region), name in mesh.region_names.items()
            if dim in dimensions
        }

    return found


def _point_data(mesh: Mesh) -> Items:
    places = _places(mesh)
    return {(name, str(value), place) for name, values in mesh.point_data.items() for value, place in
            zip(values.tolist(), places, strict=True)}  # fmt: skip


def _cell_data(mesh: Mesh) -> Items:
    cells = _cells(mesh, lambda block: True)
    return {
        (name, str(value), cell[:2])
        for name, parts in mesh.cell_data.items()
        for value, cell in zip([v for part in parts for v in part.tolist()], cells, strict=True)
    }


# What of a mesh is there because of a fact: items that a conversion must keep.
ITEMS: dict[str, Callable[[Mesh], Items]] = {
    "cell order": lambda mesh: set(enumerate(cell[:2] for cell in _cells(mesh, _of_dimension(2)))),
    "unused node": lambda mesh: set(_places(mesh)),
    "other plane": lambda mesh: set(_places(mesh)),
    "regions": _together(2),
    "numbers of regions": lambda mesh: {
        (cell[:2], mesh.region_names.get((2, cell[2]), str(cell[2]))) for cell in _cells(mesh, _of_dimension(2))
    },  # a format that knows regions by name has the number for a name
    "names of regions": _named(2),
    "lines": _kind("line"),
    "vertices": _kind("vertex"),
    "markers": _together(1),
    "names of markers": _named(1),
    "point data": _point_data,
    "cell data": _cell_data,
    "quads": _kind("quad"),
    "curved": _kind("triangle6"),
    "tetrahedra": _kind("tetra"),
    "hexahedra": _kind("hexahedron"),
    "node sets": lambda mesh: {(name, tuple(nodes.tolist())) for name, nodes in mesh.node_sets.items()},
}
SAMPLE = {"numbers of regions": "regions"}  # facts that are another side of one that the samples have


def outcome(less: Mesh, more: Mesh, fact: str, target: str, folder: Path) -> str:
    """What becomes of a fact that only ``more`` has when it is converted."""
    path = folder / f"converted{FORMATS[target].suffixes[0]}"
    try:
        usual = gmsnet.write(less, path)
        said = gmsnet.write(more, path) != usual
    except FormatError:
        return "refused"
    items = ITEMS.get(fact)
    because = items(more) - items(less) if items else set()
    kept = bool(items and because) and because <= items(gmsnet.read(path))  # type: ignore[misc]
    return {(True, False): "kept", (True, True): "kept, said", (False, True): "said"}.get((kept, said), SILENT)


def _meshes(variant: Variant, less: Iterable[str], more: Iterable[str], folder: Path) -> tuple[Mesh, Mesh] | None:
    """The meshes without and with a fact, or None where this format does not have it."""
    points = [points_of(less if "unused node" in more else more), points_of(more)]
    files = [variant.make(*each) for each in zip((less, more), points, strict=True)]
    if files[0] == files[1]:
        return None
    files[0] = variant.make(less, points_of(less))
    meshes = []
    for each in files:
        for suffix, data in each.items():
            folder.joinpath(f"from{suffix}").write_bytes(data)
        meshes.append(gmsnet.read(folder / f"from{next(iter(each))}"))
    return meshes[0], meshes[1]


def measured(facts: Iterable[str], needs: Mapping[str, Iterable[str]], folder: Path) -> Iterator[Measured]:
    """What becomes of each fact from each source that has it."""
    sources = [variant for variant in VARIANTS if variant.title in SOURCES]
    for fact in facts:
        sample = SAMPLE.get(fact, fact)
        for variant in sources:
            less = frozenset(needs.get(sample, ()))
            meshes = _meshes(variant, less, less | {sample}, folder)
            if meshes is not None:
                used = fact in ITEMS and bool(ITEMS[fact](meshes[1]) - ITEMS[fact](meshes[0]))
                targets = [key for key in FORMATS if key != variant.key]
                yield fact, variant.title, used, {key: outcome(*meshes, fact, key, folder) for key in targets}
    variant = next(variant for variant in VARIANTS if variant.title == "VTK 4.2, text")
    meshes = _meshes(variant, (), ("lines",), folder)
    assert meshes is not None
    plain = replace(meshes[1], source=None)
    probe = replace(plain, node_sets={"probe": [4, 7]})
    yield "node sets", MEMORY, True, {key: outcome(plain, probe, "node sets", key, folder) for key in FORMATS}


def table(found: Iterable[Measured]) -> list[str]:
    """Facts of the mesh × targets."""
    facts: dict[str, dict[str, dict[str, list[str]]]] = {}  # fact → target → outcome → sources
    for fact, source, used, outcomes in found:
        for target, word in outcomes.items() if used else ():
            facts.setdefault(fact, {}).setdefault(target, {}).setdefault(word, []).append(source.partition(",")[0])
    lines = ["| | " + " | ".join(entry.title for entry in FORMATS.values()) + " |", "|" + "---|" * (1 + len(FORMATS))]
    return [*lines, *(f"| {fact} | {' | '.join(_cell(of.get(key, {})) for key in FORMATS)} |" for fact, of in
                      facts.items())]  # fmt: skip


def _cell(words: Mapping[str, list[str]]) -> str:
    """The outcome of most sources, and the others with theirs."""
    most, *others = sorted(words, key=lambda word: -len(words[word])) or ["–"]
    return "; ".join([most, *(f"{word} from {', '.join(dict.fromkeys(words[word]))}" for word in others)])


def beyond(found: Iterable[Measured]) -> list[str]:
    """Facts that are in the file alone × what is said when it is converted."""
    lines = ["| | said of | silent of |", "|---|---|---|"]
    facts: dict[str, dict[bool, list[str]]] = {}
    for fact, source, used, outcomes in found:
        if not used:
            words = set(outcomes.values())
            assert len(words) == 1, f"{fact} from {source}: {outcomes}"
            facts.setdefault(fact, {True: [], False: []})[words != {SILENT}].append(source)
    return lines + [f"| {fact} | {'; '.join(of[True]) or '–'} | {'; '.join(of[False]) or '–'} |" for fact, of in
                    facts.items()]  # fmt: skip
