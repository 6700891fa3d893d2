"""What every reader and writer promises, whatever its format."""

from __future__ import annotations

import tracemalloc
from types import ModuleType

import numpy as np
import pytest

from gmsnet.errors import FormatError
from gmsnet.io.document import Parsed, Written
from gmsnet.io.pieces import Pieces
from gmsnet.io.splice import BinarySlots, Slots, TextSlots
from gmsnet.mesh.mesh import Mesh
from support.damage import facts, read_or_refuse


def read(reader: ModuleType, data: bytes) -> Parsed:
    """The facts of a file of one part."""
    parsed: Parsed = reader.read({reader.suffixes[0]: data})
    return parsed


def mesh_of(parsed: Parsed) -> Mesh:
    """The mesh, which checks its own contract."""
    return Mesh(
        parsed.points, tuple(parsed.cells), parsed.region_names, parsed.point_data, parsed.cell_data, parsed.single,
        node_sets=parsed.node_sets, rounding=parsed.rounding,
    )  # fmt: skip


def moved_points(parsed: Parsed, seed: int = 0) -> np.ndarray:
    """Points of which a third have moved a little, as exactly as the file can keep them."""
    random = np.random.default_rng(seed)
    new = parsed.points.copy()
    some = random.random(len(new)) < 0.34
    some[int(random.integers(len(new)))] = True
    shifted = new[some] + random.uniform(0.01, 0.1, new[some].shape)
    new[some] = shifted.astype(np.float32) if parsed.single else shifted
    return new if parsed.rounding is None else parsed.rounding.kept(parsed.points, new)


def check_splice(reader: ModuleType, data: bytes, seed: int = 0) -> bytes:
    """Equal points give the same file; other points the same file but for their coordinates. Returns the latter."""
    parsed = read(reader, data)
    assert spliced(parsed.slots, data, parsed.points, parsed.points.copy()) == data
    new = moved_points(parsed, seed)
    out = spliced(parsed.slots, data, parsed.points, new)
    again = read(reader, out)
    assert facts(again)[1:] == facts(parsed)[1:]
    assert np.array_equal(again.points, new)
    if isinstance(parsed.slots, TextSlots):
        assert isinstance(again.slots, TextSlots)
        assert _without(out, again.slots) == _without(data, parsed.slots)
        node = slice(None) if parsed.slots.node is None else parsed.slots.node
        still = (new == parsed.points)[node, : parsed.slots.starts.shape[1]]
        assert _tokens(out, again.slots, still) == _tokens(data, parsed.slots, still)
    elif isinstance(parsed.slots, BinarySlots):
        changed = np.zeros(len(data), dtype=bool)
        size = np.dtype(parsed.slots.dtype).itemsize
        changed[np.array(parsed.slots.places)[:, None] + np.arange(size)] = True
        same = np.frombuffer(data, np.uint8) == np.frombuffer(out, np.uint8)
        assert same[~changed].all()
    assert facts(read(reader, spliced(again.slots, out, new, parsed.points))) == facts(parsed)
    return out


def spliced(slots: Slots, data: bytes, old: np.ndarray, new: np.ndarray) -> bytes:
    """The file with new points in the places of the old ones."""
    return bytes(Pieces(lambda: slots.replace(data, old, new)))


def contents(written: Written) -> dict[str, bytes]:
    """Suffix → bytes of each file."""
    return {suffix: bytes(pieces) for suffix, pieces in written.files.items()}


def _without(data: bytes, slots: TextSlots) -> bytes:
    raw = np.ones(len(data), dtype=bool)
    for start, end in zip(slots.starts.ravel().tolist(), slots.ends.ravel().tolist(), strict=True):
        raw[start:end] = False
    return np.frombuffer(data, np.uint8)[raw].tobytes()


def _tokens(data: bytes, slots: TextSlots, chosen: np.ndarray) -> list[bytes]:
    return [data[a:b] for a, b in zip(slots.starts[chosen].tolist(), slots.ends[chosen].tolist(), strict=True)]


def check_all_cuts_refused(reader: ModuleType, data: bytes, end: int | None = None, most: int = 700) -> None:
    """Every file that is cut before byte ``end`` is refused with a FormatError (at most ``most`` places are tried)."""
    end = len(data.rstrip()) if end is None else end
    for cut in np.unique(np.linspace(0, end - 1, most).astype(int)).tolist():
        parsed = read_or_refuse(reader, {reader.suffixes[0]: data[:cut]})
        assert parsed is None, f"cut at byte {cut} of {len(data)}: …{data[max(0, cut - 40) : cut]!r}"


def refused(reader: ModuleType, data: bytes, match: str, memory: int = 20_000_000) -> None:
    """The file is refused in words that match, and without asking for much memory."""
    with pytest.raises(FormatError, match=match):
        read(reader, data)
    tracemalloc.start()  # only now, as the first run may compile kernels
    try:
        with pytest.raises(FormatError):
            read(reader, data)
        assert tracemalloc.get_traced_memory()[1] < memory
    finally:
        tracemalloc.stop()


def check_conversion(writer: ModuleType, mesh: Mesh) -> tuple[Mesh, list[str]]:
    """The mesh as it reads back from the format, its coordinates unchanged, and what was lost."""
    written = writer.write(mesh)
    (data,) = contents(written).values()
    check_splice(writer, data)
    back = mesh_of(read(writer, data))
    used = np.unique(np.concatenate([b.nodes.ravel() for b in back.cells]))
    assert {tuple(p[: mesh.points.shape[1]]) for p in back.points[used].tolist()} <= {
        tuple(p) for p in mesh.points.tolist()
    }
    return back, written.lost
