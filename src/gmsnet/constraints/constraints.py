"""What the nodes of a run may do besides moving freely: slide on curves, each between its neighbours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.curve import ArcSpline, arc_spline, through
from gmsnet.constraints.features import Curves, lengths_of
from gmsnet.constraints.geometry import Entity, Geometry, checked, named
from gmsnet.errors import InputError
from gmsnet.kernels.star.constraint import ARCS, LINE, SAME_X, SAME_Y, Constraint
from gmsnet.topology.polygons import Ints

Floats = NDArray[np.float64]
AROUND = 2  # edges on either side, of which the lengths are averaged
OFF = 0.15  # of the edges there: see docs/sliding.md, Edges stay near the curve
SAMPLES = 4  # places at which a geometry is asked for each edge of a curve


def constraint_of(
    curves: Curves, points: Floats, memory: Ints, single: bool, geometry: Geometry | None = None, exponent: int = 0
) -> Constraint | None:
    """The constraint for kernels, with the nodes where they are; None where no node slides.

    points: (N, 2) in the plane, by node ids, divided by 2 to the power of ``exponent`` (topology.planar_points).
    memory: (N,) node ids in memory order. geometry: without one, curves are those of ``arc_spline``.

    Raises InputError where the places that a geometry gives do not follow each other as the nodes do.
    """
    if not curves.slides.any():
        return None
    spline = arc_spline(curves, points) if geometry is None else _on_geometry(curves, points, geometry, exponent)
    kind = np.array([_kind(curves, c, points) if geometry is None else ARCS for c in range(len(curves))], np.int8)
    inner = np.flatnonzero(curves.curve >= 0)
    number = np.full(len(memory) + 1, -1, dtype=np.int32)  # −1 as an index is the last
    number[inner] = np.arange(len(inner), dtype=np.int32)
    parameter = np.zeros(len(inner))
    for c in range(len(curves)):
        nodes = curves.nodes_of(c)
        at = np.arange(len(nodes), dtype=np.float64) * spline.per_edge
        if kind[c] != ARCS:
            at = _along(points[nodes])
        if curves.closed[c]:
            nodes, at = nodes[:-1], at[:-1]
            parameter[number[nodes]] = at
        else:
            parameter[number[nodes[1:-1]]] = at[1:-1]
    return Constraint(
        row=number[memory],
        curve=curves.curve[inner],
        before=number[curves.before[inner]],
        after=number[curves.after[inner]],
        parameter=parameter,
        kind=kind,
        closed=np.array(curves.closed),
        first=spline.first,
        piece=spline.piece,
        single=bool(single),
        cost=_costs(curves, points, spline),
    )


def _costs(curves: Curves, points: Floats, spline: ArcSpline) -> Floats:
    """See ``Constraint``. A chord of length s of an arc of curvature κ is κs²/8 off: an edge may be so by OFF of the
    edges there, b, which is where the integral of √(κ/8b) along the curve is 1.
    """
    cost = np.zeros((len(spline.piece), 2))
    chord = lengths_of(spline.piece[:, 2:4] - spline.piece[:, :2])
    sine, turn = abs(spline.piece[:, 5]), 2.0 * abs(np.arctan2(spline.piece[:, 5], spline.piece[:, 4]))
    for c in range(len(curves)):
        if curves.straight[c]:
            continue
        at = slice(int(spline.first[c]), int(spline.first[c + 1]))
        edge = lengths_of(np.diff(points[curves.nodes_of(c)], axis=0))
        padded = np.pad(edge, AROUND, mode="wrap") if curves.closed[c] else np.pad(edge, AROUND, mode="edge")
        near = np.convolve(padded, np.full(2 * AROUND + 1, 1.0 / (2 * AROUND + 1)), "valid")
        bound = OFF * np.repeat(near, spline.per_edge)
        # κ = 2 sin α/|c|, and the arc is 2α/κ long.
        bend = 2.0 * np.divide(sine[at], chord[at], out=np.zeros(len(bound)), where=chord[at] > 0.0)
        along = np.divide(turn[at], bend, out=np.zeros(len(bound)), where=bend > 0.0)
        cost[at, 0] = along * np.sqrt(np.divide(bend, 8.0 * bound, out=np.zeros(len(bound)), where=bound > 0.0))
        cost[at, 1] = np.cumsum(cost[at, 0]) - cost[at, 0]
    return cost


def _kind(curves: Curves, c: int, points: Floats) -> int:
    if not curves.straight[c]:
        return ARCS
    p = points[curves.nodes_of(c)]
    same = (p == p[0]).all(axis=0)
    return SAME_X if same[0] else SAME_Y if same[1] else LINE


def _along(p: Floats) -> Floats:
    """How far along the way from the first point to the last one each is, from 0 to 1."""
    way = p[-1] - p[0]
    square = float(way[0] * way[0] + way[1] * way[1])
    if square == 0.0:  # two nodes in one place
        return np.linspace(0.0, 1.0, len(p))
    off = p - p[0]
    along = (off[:, 0] * way[0] + off[:, 1] * way[1]) / square
    along[-1] = 1.0
    return np.asarray(along)


def _on_geometry(curves: Curves, points: Floats, geometry: Geometry, exponent: int) -> ArcSpline:
    """Arcs through places of a geometry, SAMPLES for each edge, with its tangents."""
    chains, tangents = list[Floats](), list[Floats]()
    for c in range(len(curves)):
        p = points[curves.nodes_of(c)]
        if not curves.slides[curves.nodes_of(c)[:-1]].any():
            chains.append(_samples(p))
            edge = np.diff(p, axis=0)
            tangents.append(np.vstack([np.repeat(edge, SAMPLES, axis=0), edge[-1:]]))
            continue
        entity = Entity(1, c, curves.names[c])
        wanted = _samples(p)
        places, parameters = geometry.project(entity, np.ldexp(wanted, exponent))
        places = np.ldexp(checked(places, wanted.shape, "places", entity), -exponent)
        direction = checked(geometry.tangent(entity, parameters), wanted.shape, "tangents", entity)
        if curves.closed[c]:
            places[-1], direction[-1] = places[0], direction[0]
        else:
            places[0], places[-1] = p[0], p[-1]
        ahead, along = np.diff(places, axis=0), np.diff(wanted, axis=0)
        around = ahead[:1] if curves.closed[c] else ahead[-1:]
        backward = (np.vstack([ahead, around]) * direction).sum(axis=1, keepdims=True) < 0.0
        direction = np.where(backward, -direction, direction)
        if ((ahead * along).sum(axis=1) <= 0.0).any() or ((ahead * direction[1:]).sum(axis=1) < 0.0).any():
            raise InputError(
                f"the places that geometry.project gives for {named(entity)} do not follow each other as its nodes do, "
                "or turn by more than 90 degrees from one to the next: take a geometry that lies nearer to the mesh, "
                "or leave this curve out of slide"
            )
        chains.append(places)
        tangents.append(direction)
    spline = through(chains, curves.closed, tangents)
    return ArcSpline(spline.first, spline.piece, spline.closed, spline.per_edge * SAMPLES)


def _samples(p: Floats) -> Floats:
    """SAMPLES places on each edge of a polyline, from its beginning on, and its last point."""
    share = (np.arange(SAMPLES) / SAMPLES)[None, :, None]
    return np.vstack([(p[:-1, None] + share * np.diff(p, axis=0)[:, None]).reshape(-1, 2), p[-1:]])
