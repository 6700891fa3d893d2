"""The curves that nodes of a planar mesh may slide on, inferred from its edges, marks and corners."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.options import FEATURE_ANGLE, SlideChoice, check_slide
from gmsnet.constraints.outline import Flags, Outline, outline_of
from gmsnet.errors import InputError
from gmsnet.kernels.topology import chains
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.held import SMOOTHED
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.polygons import Ints

Floats = NDArray[np.float64]

COLLINEAR = 1e-12  # of a curve's length: nodes this near to the line through its ends are on it, besides rounding
# Of the cosine of the feature angle: a polygon that turns by just this angle has corners, all of them, as one of twelve
# edges by 30°, also where coordinates have six digits. At 30° it is a thousandth of a degree.
SLACK = 1e-5
RUN = 3  # edges: so many on a line, within a curve, are a curve of their own


@dataclass(frozen=True, eq=False)
class Curves:
    """Curves of a mesh with N nodes; all arrays are read-only.

    start: (C + 1,); curve c has the nodes nodes[start[c] : start[c + 1]] in order. closed: (C,) bool, it has no ends,
    and names its first node again at the end; a curve with ends may end where it begins. straight: (C,) bool, its nodes
    lie on the line through its ends. names: the names of the markers whose line cells are on each curve.
    slides: (N,) bool, the nodes that slide. curve: (N,) int32, the curve of which a node is an inner one, else −1;
    before, after: (N,) int32, the nodes before and after it on that curve, else −1. Nodes that slide are inner ones;
    inner ones that do not slide stay, and the curve goes on through them.
    """

    start: NDArray[np.int64]
    nodes: Ints
    closed: Flags
    straight: Flags
    names: tuple[tuple[str, ...], ...]
    slides: Flags
    curve: Ints
    before: Ints
    after: Ints

    def __post_init__(self) -> None:
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False

    def __len__(self) -> int:
        return len(self.closed)

    def nodes_of(self, curve: int) -> Ints:
        """The nodes of one curve in order."""
        return self.nodes[self.start[curve] : self.start[curve + 1]]

    def curvatures(self, points: Floats) -> Floats:
        """(N,) those of circles through each inner node and its two neighbours, else 0. points: (N, 3)."""
        inner, found = np.flatnonzero(np.minimum(self.before, self.after) >= 0), np.zeros(len(points))
        a, b, c = points[self.before[inner]], points[inner], points[self.after[inner]]
        sides = lengths_of(b - a) * lengths_of(c - b) * lengths_of(a - c)
        double = 2.0 * lengths_of(np.cross(b - a, c - b))
        found[inner] = np.divide(double, sides, out=np.zeros(len(inner)), where=sides > 0.0)
        return found


def curves_of(
    mesh: Mesh, slide: SlideChoice = True, feature_angle: float = FEATURE_ANGLE, held: Flags | None = None,
    bounded_at: Flags | None = None,
) -> Curves:  # fmt: skip
    """The curves of a planar mesh, and which nodes slide on them.

    A curve is a maximal chain of edges of one kind (boundary, interface, line cells inside a region), between the same
    regions and with the same marks. It ends where it turns by the feature angle or more, where not exactly two such
    edges meet, at nodes that are still (``outline_of``), and where a straight run of RUN edges or more begins.

    slide: None (no node slides), True (all may), or names of ``mesh.markers``: only nodes of these slide.
    feature_angle: in degrees, between 0 and 180; a node at which a curve turns by more than 90° always is an end.
    held: (N,) bool, nodes that stay for other reasons; the curve goes on through them. Nodes of cells that are not
    smoothed stay as well. bounded_at: see ``outline.sides``.

    Raises InputError for a mesh that is not planar, unknown markers and angles out of range.
    """
    names = check_slide(mesh, slide, feature_angle)
    if mesh.plane is None:
        raise InputError("curves are of meshes in a plane: of one in space they follow from its patches")
    outline, may = outline_of(mesh, bounded_at), may_slide(mesh, names, held)
    return curves_along(outline, planar_points(mesh), mesh.single, feature_angle, may)


def curves_along(outline: Outline, points: Floats, single: bool, feature_angle: float, may: Flags) -> Curves:
    """The curves of an outline. points: (N, 2), or (N, 3) in space. may: (N,) bool, which nodes may slide."""
    parts, closed = _split(*_chains(outline, points, feature_angle), points, single)
    return _curves(parts, closed, outline, points, may, single)


def may_slide(mesh: Mesh, names: Sequence[str] | None, held: Flags | None) -> Flags:
    """(N,) bool: not held, of the named markers, and in a plane of no cell that is not smoothed."""
    if names is None:
        may = np.ones(len(mesh.points), dtype=bool)
    else:
        may = np.zeros(len(mesh.points), dtype=bool)
        markers = mesh.markers if names else {}
        for name in names:
            may[markers[name]] = True
    if held is not None:
        may &= ~held
    if not mesh.has_volumes:
        for block in mesh.cells:
            if block.dimension not in (0, 1) and block.kind not in SMOOTHED:
                may[block.nodes] = False
    return may


def _chains(outline: Outline, points: Floats, feature_angle: float) -> tuple[list[Ints], list[bool]]:
    """Maximal chains of edges that turn nowhere by the feature angle or more, and whether each is closed."""
    edges = outline.edges
    ids, ends = np.unique(edges, return_inverse=True)
    ends = ends.reshape(edges.shape)
    at = np.argsort(ends.reshape(-1), kind="stable")
    start = np.zeros(len(ids) + 1, dtype=np.int64)
    np.cumsum(np.bincount(ends.reshape(-1), minlength=len(ids)), out=start[1:])
    through = (np.diff(start) == 2) & ~outline.still[ids]
    nodes = np.flatnonzero(through)
    one, two = at[start[nodes]] // 2, at[start[nodes] + 1] // 2
    back = points[edges[one].sum(axis=1) - ids[nodes]] - points[ids[nodes]]
    ahead = points[edges[two].sum(axis=1) - ids[nodes]] - points[ids[nodes]]
    lengths = lengths_of(back) * lengths_of(ahead)
    cosine = -(back * ahead).sum(axis=1)
    least = max(math.cos(math.radians(feature_angle)) + SLACK, -SLACK)
    smooth = (lengths > 0.0) & (cosine >= least * lengths)
    through[nodes] = smooth & (outline.label[one] == outline.label[two])
    order, begin = np.empty(2 * len(edges), dtype=np.int64), np.empty(len(edges) + 1, dtype=np.int64)
    closed = np.empty(len(edges), dtype=bool)
    count = chains.join(ends, start, at // 2, through, order, begin, closed)
    found = [ids[order[begin[c] : begin[c + 1]]].astype(np.int32) for c in range(count)]
    return found, closed[:count].tolist()


def rounding_of(points: Floats, single: bool) -> float:
    """By how much nodes on a line or plane may be off it."""
    return 4.0 * (2.0**-23 if single else 2.0**-52) * float(abs(points).max(initial=0.0))


def _on_a_line(points: Floats, rounding: float) -> bool:
    """Are points (K, 2) on the line through the first and the last one, up to COLLINEAR of the length and rounding?"""
    along = points[-1] - points[0]
    distance = float(lengths_of(along))
    if distance == 0.0:
        return False
    away = _crossed(points - points[0], along / distance).max()
    return bool(away <= COLLINEAR * lengths_of(np.diff(points, axis=0)).sum() + rounding)


def lengths_of(vectors: Floats) -> Floats:
    """Of vectors (…, 2) or (…, 3)."""
    lengths: Floats = np.hypot(vectors[..., 0], vectors[..., 1])
    return lengths if vectors.shape[-1] == 2 else np.hypot(lengths, vectors[..., 2])


def dot(one: Floats, other: Floats) -> Floats:
    """Products of vectors (K, 3), by operations that round alike everywhere."""
    products: Floats = (one[:, 0] * other[:, 0] + one[:, 1] * other[:, 1]) + one[:, 2] * other[:, 2]
    return products


def _crossed(one: Floats, other: Floats) -> Floats:
    """The area between vectors (K, 2 or 3) and others, or one other."""
    if one.shape[-1] == 2:
        return abs(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])
    return lengths_of(np.cross(one, other))


def _split(parts: list[Ints], closed: list[bool], points: Floats, single: bool) -> tuple[list[Ints], list[bool]]:
    """The chains cut at the ends of straight runs within them.

    Not in single precision: there a gentle arc cannot be told from a straight run.
    """
    if single:
        return parts, closed
    rounding = rounding_of(points, single)
    out, rings = list[Ints](), list[bool]()
    for nodes, ring in zip(parts, closed, strict=True):
        cuts = _run_ends(points[nodes], ring, rounding) if len(nodes) > RUN + 1 else []
        if not cuts:
            out.append(nodes)
            rings.append(ring)
            continue
        if ring:  # turned so that it begins at a cut, and so has ends
            nodes = np.concatenate([nodes[cuts[0] :], nodes[1 : cuts[0] + 1]])
            cuts = [cut - cuts[0] for cut in cuts[1:]]
        borders = [0, *cuts, len(nodes) - 1]
        out += [nodes[low : high + 1] for low, high in pairwise(borders)]
        rings += [False] * (len(borders) - 1)
    return out, rings


def _run_ends(p: Floats, ring: bool, rounding: float) -> list[int]:
    """Where, inside a chain, straight runs of RUN edges or more begin or end; of a closed one below its last place."""
    if not ring and _on_a_line(p, rounding):
        return []
    last = len(p) - 1  # how many edges
    q = np.vstack([p[-2:-1], p]) if ring else p
    edge = np.diff(q, axis=0)
    bend, chord, length = _crossed(edge[:-1], edge[1:]), lengths_of(edge[:-1] + edge[1:]), lengths_of(edge)
    flat = bend <= (COLLINEAR * (length[:-1] + length[1:]) + rounding) * chord
    if ring:  # flat[k] is of place k; begun at one that is not flat
        if flat.all():
            return []
        first = int(np.flatnonzero(~flat)[0])
        flat, p = np.roll(flat, -first), np.vstack([p[first:-1], p[: first + 1]])
        flat = np.append(flat, False)
    else:
        first, flat = 0, np.concatenate([[False], flat, [False]])
    step = np.diff(flat.astype(np.int8))
    cuts = set[int]()
    for low, high in zip(np.flatnonzero(step == 1).tolist(), (np.flatnonzero(step == -1) + 1).tolist(), strict=True):
        if high - low >= RUN and _on_a_line(p[low : high + 1], rounding):
            cuts |= {low, high}
    if ring:
        return sorted({(cut + first) % last for cut in cuts})
    return sorted(cuts - {0, last})


def _curves(
    parts: list[Ints], closed: list[bool], outline: Outline, points: Floats, may: Flags, single: bool
) -> Curves:
    count = len(may)
    rounding = rounding_of(points, single)
    start = np.zeros(len(parts) + 1, dtype=np.int64)
    np.cumsum([len(nodes) for nodes in parts], out=start[1:])
    curve, before, after = (np.full(count, -1, dtype=np.int32) for _ in range(3))
    straight = np.zeros(len(parts), dtype=bool)
    edges = np.array([nodes[:2] for nodes in parts], dtype=np.int64).reshape(-1, 2)
    width = max(count, 1)
    keys = outline.edges[:, 0] * width + outline.edges[:, 1]
    row = np.searchsorted(keys, edges.min(axis=1, initial=count) * width + edges.max(axis=1, initial=0))
    for number, (nodes, ring) in enumerate(zip(parts, closed, strict=True)):
        inner = nodes[1:-1]
        curve[inner], before[inner], after[inner] = number, nodes[:-2], nodes[2:]
        if ring:
            curve[nodes[0]], before[nodes[0]], after[nodes[0]] = number, nodes[-2], nodes[1]
        straight[number] = not ring and (len(nodes) == 2 or _on_a_line(points[nodes], rounding))
    return Curves(
        start=start,
        nodes=np.concatenate([np.zeros(0, dtype=np.int32), *parts]),
        closed=np.array(closed, dtype=bool),
        straight=straight,
        names=tuple(outline.names[label] for label in outline.label[row].tolist()),
        slides=may & (curve >= 0),
        curve=curve,
        before=before,
        after=after,
    )
