"""Which generator `gmsnet generate` calls for a pattern and its cells, and which options that one takes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from gmsnet.errors import InputError

if TYPE_CHECKING:
    from gmsnet.generate.shaped import Shaped
    from gmsnet.mesh.mesh import Mesh

Given = Mapping[str, Any]  # name of an option → what the user gave; without those that were not given

NODES = 1000


@dataclass(frozen=True)
class Generator:
    """make: the mesh, from the options that were given, the size and the seed. takes: names of options."""

    make: Callable[[Given, float, int], Mesh | Shaped]
    takes: frozenset[str]


def _random(given: Given, size: float, seed: int) -> Mesh:
    from gmsnet.generate import random_mesh, settle

    mesh = random_mesh(given.get("nodes", NODES), _outline(given), size=size, seed=seed, **_boundary(given))
    return settle(mesh, given["settle"]) if "settle" in given else mesh


def _random_quads(cells: str) -> Callable[[Given, float, int], Mesh]:
    def make(given: Given, size: float, seed: int) -> Mesh:
        from gmsnet.generate import random_quad_mesh

        return random_quad_mesh(
            given.get("nodes", NODES), _outline(given), cells=cells, settled=given.get("settle", 0),
            size=size, seed=seed, **_boundary(given),
        )  # fmt: skip

    return make


def _structured(given: Given, size: float, seed: int) -> Mesh:
    from gmsnet.generate import structured_mesh

    return structured_mesh(*_grid(given), size=size)


def _kershaw(given: Given, size: float, seed: int) -> Mesh:
    from gmsnet.generate import kershaw_mesh

    return kershaw_mesh(*_grid(given), size=size, **_named(given, "flatness"))


def _hybrid(given: Given, size: float, seed: int) -> Mesh:
    from gmsnet.generate import hybrid_mesh

    return hybrid_mesh(given.get("nodes", NODES), size=size, seed=seed, **_named(given, "share", "interface"))


def _around_body(name: str, cells: str) -> Callable[[Given, float, int], Mesh]:
    def make(given: Given, size: float, seed: int) -> Mesh:
        from gmsnet import generate
        from gmsnet.generate.arguments import positive

        positive(size, "the size")
        mesh: Mesh = getattr(generate, name)(cells=cells, **_named(given, "layers", "aspect", "around", "body"))
        return mesh.with_points(mesh.points * size)

    return make


def _adapted(given: Given, size: float, seed: int) -> Mesh:
    from gmsnet.generate import adapted_mesh
    from gmsnet.generate.arguments import positive

    positive(size, "the size")
    mesh = adapted_mesh(**_named(given, "nodes", "aspect"))
    return mesh.with_points(mesh.points * size)


def _random_volume(given: Given, size: float, seed: int) -> Mesh:
    from gmsnet.generate import random_volume

    return random_volume(given.get("nodes", NODES), size=size, seed=seed)


def _layered_volume(kind: str) -> Callable[[Given, float, int], Mesh]:
    def make(given: Given, size: float, seed: int) -> Mesh:
        from gmsnet.generate import layered_volume

        first = {"first": 1.0 / given["aspect"]} if given.get("aspect", 0.0) > 0.0 else {}
        columns, layers = given.get("columns", 10), given.get("layers", 8)
        return layered_volume(columns, layers, kind=kind, size=size, seed=seed, **first)

    return make


def _block(kind: str) -> Callable[[Given, float, int], Mesh]:
    def make(given: Given, size: float, seed: int) -> Mesh:
        from gmsnet.generate import block_volume

        return block_volume(given.get("columns", _side_of(given)), kind, size=size)

    return make


def _swept(kind: str) -> Callable[[Given, float, int], Mesh]:
    def make(given: Given, size: float, seed: int) -> Mesh:
        from gmsnet.generate import o_grid_section, random_mesh, settle, swept_volume

        side, layers = _side_of(given), given.get("layers", 8)
        if kind == "hexahedron":
            columns = given.get("columns", side)
            section = o_grid_section(columns, max(1, columns // 2), radius=0.5 * size)
        else:
            section = settle(random_mesh(max(1, side * side), _outline(given), size=size, seed=seed), 20)
        return swept_volume(section, layers, 2.0 * size, **_named(given, "twist", "bend"))

    return make


def _side_of(given: Given) -> int:
    """Cells on each side of a grid with about so many nodes inside."""
    nodes = given.get("nodes", NODES)
    if nodes < 1:
        raise InputError(f"a mesh needs at least 1 node inside, got --nodes {nodes}")
    side: int = round(nodes ** (1 / 3))
    return 1 + max(1, side)


def _lattice(name: str) -> Callable[[Given, float, int], Mesh]:
    def make(given: Given, size: float, seed: int) -> Mesh:
        from gmsnet import generate
        from gmsnet.generate.volumes import LEAST_PART

        least = LEAST_PART if name == "part_volume" else 1
        nodes = given.get("nodes", NODES)
        if nodes < 1:
            raise InputError(f"a mesh needs at least 1 node inside, got --nodes {nodes}")
        mesh: Mesh = getattr(generate, name)(given.get("columns", max(_cells_of(nodes), least)), size=size)
        return mesh

    return make


def _shaped(name: str, **cells: str) -> Generator:
    """The function of ``gmsnet.generate`` with this name, which makes a shape of about so many nodes."""

    def make(given: Given, size: float, seed: int) -> Shaped:
        from gmsnet import generate

        return getattr(generate, name)(given.get("nodes", NODES), size=size, **cells)  # type: ignore[no-any-return]

    return Generator(make, frozenset({"nodes"}))


def _cells_of(nodes: int) -> int:
    """Cells on each side of a body-centred lattice with about so many nodes inside: n³ + (n − 1)³."""
    return min(range(1, 2 + int(nodes ** (1 / 3))), key=lambda n: abs(n**3 + (n - 1) ** 3 - nodes))


RANDOM = frozenset({"nodes", "shape", "rings", "boundary", "settle"})
GRID = frozenset({"nodes", "columns", "rows"})
SWEPT = frozenset({"nodes", "layers", "twist", "bend"})
LAYERS = frozenset({"layers", "aspect", "around", "body"})

PATTERNS: dict[str, dict[str, Generator]] = {  # pattern → its cells, the default first → generator
    "random": {
        "triangle": Generator(_random, RANDOM),
        "quad": Generator(_random_quads("quad"), RANDOM),
        "mixed": Generator(_random_quads("mixed"), RANDOM),
        "tetra": Generator(_random_volume, frozenset({"nodes"})),
    },
    "structured": {
        "quad": Generator(_structured, GRID),
        "mixed": Generator(_hybrid, frozenset({"nodes", "share", "interface"})),
        "tetra": Generator(_lattice("lattice_volume"), frozenset({"nodes", "columns"})),
        "hexahedron": Generator(_block("hexahedron"), frozenset({"nodes", "columns"})),
        "wedge": Generator(_block("wedge"), frozenset({"nodes", "columns"})),
        "pyramid": Generator(_block("pyramid"), frozenset({"nodes", "columns"})),
        "mixed-volume": Generator(_block("mixed"), frozenset({"nodes", "columns"})),
    },
    "o-grid": {
        "mixed": Generator(_around_body("layered_mesh", "mixed"), LAYERS),
        "quad": Generator(_around_body("layered_mesh", "quad"), LAYERS),
        "triangle": Generator(_around_body("layered_mesh", "triangle"), LAYERS),
    },
    "c-grid": {
        "quad": Generator(_around_body("c_grid_mesh", "quad"), LAYERS - {"body"}),
        "triangle": Generator(_around_body("c_grid_mesh", "triangle"), LAYERS - {"body"}),
    },
    "adapted": {"triangle": Generator(_adapted, frozenset({"nodes", "aspect"}))},
    "kershaw": {"quad": Generator(_kershaw, GRID | {"flatness"})},
    "layered": {
        "tetra": Generator(_layered_volume("tetra"), frozenset({"columns", "layers", "aspect"})),
        "wedge": Generator(_layered_volume("wedge"), frozenset({"columns", "layers", "aspect"})),
    },
    "part": {"tetra": Generator(_lattice("part_volume"), frozenset({"nodes", "columns"}))},
    "swept": {
        "hexahedron": Generator(_swept("hexahedron"), SWEPT | {"columns"}),
        "wedge": Generator(_swept("wedge"), SWEPT | {"shape"}),
    },
    "sphere": {
        "triangle": _shaped("sphere_surface"),
        "quad": _shaped("sphere_surface", cells="quad"),
        "tetra": _shaped("ball_volume"),
    },
    "torus": {"triangle": _shaped("torus_surface"), "quad": _shaped("torus_surface", cells="quad")},
    "cylinder": {kind: _shaped("cylinder", cells=kind) for kind in ("triangle", "quad", "tetra")},
    "cone": {"triangle": _shaped("cone_surface")},
    "organic": {"triangle": _shaped("organic_surface")},
    "bracket": {kind: _shaped("bracket", cells=kind) for kind in ("triangle", "tetra")},
}


def chosen(pattern: str, cells: str | None, given: Given) -> tuple[str, Generator]:
    """The cells and the generator of a pattern. Raises InputError for unknown names and for options of another one."""
    if pattern not in PATTERNS:
        raise InputError(f"unknown pattern {pattern!r}; there are {', '.join(PATTERNS)}")
    makes = PATTERNS[pattern]
    kind = next(iter(makes)) if cells is None else cells
    if kind not in makes:
        raise InputError(f"--pattern {pattern} makes --cells {' or '.join(makes)}, not {kind!r}")
    for name in given:
        if name not in makes[kind].takes:
            fit = [f"{p} {c}" for p, kinds in PATTERNS.items() for c, each in kinds.items() if name in each.takes]
            raise InputError(f"--{name} is an option for {', '.join(fit)}, not for {pattern} {kind}: leave it out")
    if {"shape", "rings"} <= given.keys():
        raise InputError("--rings stands instead of --shape: leave one of them out")
    if "nodes" in given and given.keys() & {"columns", "rows"}:
        raise InputError("--columns and --rows stand instead of --nodes: leave one or the other out")
    return kind, makes[kind]


def _outline(given: Given) -> Any:
    return given.get("rings", given.get("shape", "square"))


def _boundary(given: Given) -> dict[str, Any]:
    return _named(given, "boundary")


def _named(given: Given, *names: str) -> dict[str, Any]:
    return {name: given[name] for name in names if name in given}


def _grid(given: Given) -> tuple[int, int]:
    """Columns and rows: as given, the one as many as the other; or as many as the inner nodes ask for."""
    if given.keys() & {"columns", "rows"}:
        columns = given.get("columns", given.get("rows"))
        return columns, given.get("rows", columns)
    nodes = given.get("nodes", NODES)
    if nodes < 1:
        raise InputError(f"a mesh needs at least 1 node inside, got --nodes {nodes}")
    return 2 * (1 + round(nodes**0.5),)
