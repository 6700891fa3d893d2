"""What all tests of readers share: meshes in random spellings, and files that are cut, changed or garbage."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from types import ModuleType

import numpy as np
from hypothesis import Phase, settings
from hypothesis import strategies as st

from gmsnet.errors import FormatError, InputError
from gmsnet.io.document import Parsed
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

# For tests that read a file hundreds of times for one example: to shrink a failure would take minutes.
FEW = settings(max_examples=10, phases=(Phase.explicit, Phase.reuse, Phase.generate))

# Spellings of numbers, blanks, line ends.
NUMBERS = st.floats(-1e6, 1e6).map(repr) | st.sampled_from(
    [
        "0",
        "-0.0",
        "+1.5",
        ".25",
        "-.5e-3",
        "7.",
        "1E2",
        "1.25e+01",
        "3.0000000000000000000001",
        "1e-300",
        "12345678901234567",
    ]
)
GAPS = st.sampled_from([" ", "\t", "  ", " \t "])
ENDS = st.sampled_from(["\n", "\r\n", "\r"])
MODES = st.sampled_from(["cut", "change", "insert", "drop", "repeat", "noise"])


def facts(parsed: Parsed) -> tuple[object, ...]:
    """Everything that a reader says, in a form that compares with ==."""
    return (
        parsed.points.tolist(),
        [(b.kind, b.nodes.tolist(), b.regions.tolist()) for b in parsed.cells],
        dict(parsed.region_names),
        {name: np.asarray(values).tolist() for name, values in parsed.point_data.items()},
        {name: [np.asarray(a).tolist() for a in arrays] for name, arrays in parsed.cell_data.items()},
        {name: nodes.tolist() for name, nodes in parsed.node_sets.items()},
    )


def cells_of(parsed: Parsed | Mesh, kind: str) -> list[list[int]]:
    """The nodes of all cells of a type."""
    return [row for b in parsed.cells if b.kind == kind for row in b.nodes.tolist()]


def regions_of(parsed: Parsed | Mesh, kind: str) -> list[int]:
    """The regions of all cells of a type."""
    return [region for b in parsed.cells if b.kind == kind for region in b.regions.tolist()]


def read_or_refuse(reader: ModuleType, files: Mapping[str, bytes]) -> Parsed | None:
    """What the reader says of damaged files; None where it refuses them in words, naming no internals."""
    try:
        parsed = reader.read(files)
        data = (parsed.region_names, parsed.point_data, parsed.cell_data)
        Mesh(parsed.points, tuple(parsed.cells), *data, node_sets=parsed.node_sets, rounding=parsed.rounding)
    except FormatError:
        return None
    except InputError:
        raise AssertionError("the reader leaves it to Mesh to find a fault that has a line") from None
    return parsed


def last_word(data: bytes, comments: bytes) -> int:
    """Where the last word begins that is in no comment (a regular expression)."""
    text = re.sub(comments, lambda match: b" " * len(match[0]), data).rstrip()
    return len(text) - len(text.split()[-1])


def check_cuts(reader: ModuleType, files: Mapping[str, bytes], suffix: str, unseen: Callable[[bytes], bool]) -> None:
    """A file that is cut off is refused or says the same as the whole, wherever the cut is.

    Some cuts cannot be seen: ``unseen`` tells them, given what is left. One within the last number is always among
    them, in formats that do not say where they end those between two sections too.
    """
    whole = facts(reader.read(files))
    data = files[suffix]
    for cut in range(len(data)):
        parsed = read_or_refuse(reader, {**files, suffix: data[:cut]})
        if parsed is not None and not unseen(data[:cut]):
            assert facts(parsed) == whole, f"cut at byte {cut}: {data[:cut]!r}"


@st.composite
def damaged(draw: st.DrawFn, data: bytes) -> bytes:
    """A file with some bytes changed."""
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(data)))
        mode = draw(MODES)
        if mode == "cut":
            data = data[:at]
        elif mode == "drop":
            data = data[:at] + data[at + draw(st.integers(1, 8)) :]
        elif mode == "repeat":
            data = data[:at] + data[max(0, at - 12) :]
        elif mode == "noise":
            data = data[:at] + draw(st.binary(max_size=8)) + data[at:]
        else:
            word = draw(
                st.sampled_from(
                    [b"0", b"-1", b"9" * 17, b"9" * 30, b"nan", b"x", b" ", b"\n", b"1e999", b"-", b"=", b"#"]
                )
            )
            data = data[:at] + word + data[at + (mode == "change") :]
    return data


def triangle_grid(n: int = 4, dim: int = 2) -> Mesh:
    """A small mesh of two regions whose interior nodes are free, with named markers, for conversions."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
    points = np.stack([x.ravel(), y.ravel()] + [np.zeros(x.size)] * (dim - 2), axis=1)
    corner = np.arange(n * (n + 1)).reshape(n, n + 1)[:, :-1].ravel()
    triangles = np.concatenate([np.stack([corner, corner + 1, corner + n + 2], axis=1),
                                np.stack([corner, corner + n + 2, corner + n + 1], axis=1)])  # fmt: skip
    regions = np.where(points[triangles, 0].mean(axis=1) < 0.5, 3, 7)
    bottom = np.stack([np.arange(n), np.arange(1, n + 1)], axis=1)
    top = bottom + n * (n + 1)
    lines = CellBlock("line", np.concatenate([bottom, top]), np.repeat([1, 2], n))
    names = {(1, 1): "bottom wall", (1, 2): "top", (2, 3): "steel", (2, 7): "air"}
    return Mesh(points, (CellBlock("triangle", triangles, regions), lines), names)
