"""Courses: rows of nodes over a wall, told by the connectivity. The first are the neighbours of the wall, and so on.

Where somebody has made layers in rows, each row has as many nodes as the first one, and grows over the one before by
the same factor all along the wall. Nobody's intent are rows that grow by more here and by less there (cells that were
squeezed), or not at all (a mesh that was stretched). Rows go on where cells are as thick as long, as at a blunt nose or
a sharp tail, and are one row there as well.

Where nodes have been thrown about, growth along a row is noise. The medians of whole rows still tell the factor. Grids
of one height that were thrown about have none.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.topology.components import pieces

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Edges = NDArray[np.int32]
Graph = tuple[Ints, NDArray[np.int32]]  # neighbours in CSR form

# Length over height: of a cell at a wall; of those of a row, in the median.
FLAT, STILL_FLAT = math.log(2.0), math.log(1.8)
FEWEST = 12  # nodes of a row
REGULAR = 1.1  # times as many nodes as the first row has, at most, and as the least
ROWS, FLAT_ROWS = 3, 2
MOST = 0.6  # of the nodes of a mesh
THIN, GROWN = math.log(2.5), math.log(1.25)  # of the first row, how flat; of the last one, over the first, how high
ALIKE = 0.15  # between the growth of most nodes of a row (in logarithms): the median over the rows
STEADY = math.log(1.25)  # between most heights, or most ratios of length and height, of the first row
# Of one factor everywhere, from row to row as well: what nobody gets by chance, if heights differ along a wall by less
# than UNSTEADY.
CLOSELY, FACTOR, GROWN_BY_MUCH, UNSTEADY = 0.05, math.log(1.08), math.log(4.0), math.log(4.0)
STILL_GROWN = math.log(2.5)  # of disturbed rows, the last over the first; of grids that were thrown about, at most 1.3
CALM = 6  # rows that are CLOSELY alike, and others behind them disturbed: fewer are so by chance
SHARE = 0.66  # of a row: where so much of it is in a layer, all of it is
GAP, AS_HIGH = 0.5, math.log(2.0)  # of the nodes of a wall; between the height of a cell there and the median


class Course(NamedTuple):
    """A row of nodes (ids), with logarithms of their heights over the row before, of how many times that one's height
    this is, and of their distance from their neighbours in the row."""

    nodes: Ints
    height: Floats
    growth: Floats
    length: Floats

    @property
    def flatness(self) -> float:
        """The logarithm of length over height, in the median."""
        return float(np.median(self.length - self.height))


class Walls(NamedTuple):
    """Edges (W, 2) of cells on walls, the logarithms of the heights of these cells (W,), and which are flat (W,)."""

    edges: Edges
    height: Floats
    flat: Flags


class Courses(NamedTuple):
    """The rows over each wall along which cells are flat.

    graph, points: by id. label: (N,) of nodes of walls, of which one; −1 of all others.
    """

    graph: Graph
    points: Floats
    label: Ints
    rows: dict[int, list[Course]]

    @classmethod
    def of(cls, edges: Edges, points: Floats, walls: Walls) -> Courses:
        """edges: (E, 2) of all cells, by id, each once or more."""
        start = _starts(walls, len(points))
        label = np.where(start, pieces(walls.edges, start), -1).astype(np.int64)
        graph = _graph(edges if start.any() else edges[:0], len(points))
        return cls(graph, points, label, _courses(graph, points, label))

    @property
    def ordered(self) -> Flags:
        """(N,) the nodes of walls over which there are ROWS or more, of which the first ones are flat.

        Not if rows of one height are most of the mesh: those of a grid.
        """
        some = {wall: rows for wall, rows in self.rows.items() if len(rows) >= ROWS and _last(rows) >= FLAT_ROWS}
        plain = {
            wall: sum(len(row.nodes) for row in rows) for wall, rows in some.items() if _height_spans(rows) < GROWN
        }
        grid = sum(plain.values()) >= MOST * len(self.points)
        return np.isin(self.label, [wall for wall in some if not (grid and wall in plain)])

    def whole(self, inside: Flags) -> tuple[Flags, Flags]:
        """(N,) the nodes of rows that are layers, or of which most are inside of one; of their walls as well.

        And which of the nodes of rows are as high over the row before as others.
        """
        label, rows, (found, as_high) = self.label.copy(), self.rows, np.zeros((2, len(inside)), dtype=bool)
        made = {wall: layers for wall, own in rows.items() if (layers := _layers_of(own))}
        nothing = ~np.isin(label, [*made]) & ~inside
        if (label[nothing] >= 0).any():  # what is no layer takes no rows from those that are
            label[nothing] = -1
            rows = _courses(self.graph, self.points, label)
            made = {wall: max(layers, _layers_of(rows.get(wall, []))) for wall, layers in made.items()}
        for wall, own in rows.items():
            last = made.get(wall, 0)
            for k, row in enumerate(own):
                if k < last or inside[row.nodes].mean() >= SHARE:
                    found[row.nodes] = True
                as_high[row.nodes] = abs(row.height - np.median(row.height)) <= STEADY
            found[label == wall] |= last > 0
        return found, as_high


def _graph(edges: Edges, count: int) -> Graph:
    """The neighbours of each node."""
    from scipy.sparse import coo_array

    one, two = edges.T
    ends = np.concatenate([one, two]), np.concatenate([two, one])
    graph = coo_array((np.ones(2 * len(edges), dtype=np.int8), ends), shape=(count, count)).tocsr()
    return graph.indptr.astype(np.int64), graph.indices


def _layers_of(rows: list[Course]) -> int:
    """How many of the first rows are layers by themselves: all flat ones, or those before the first disturbed one."""
    last = _last(rows)
    if last < ROWS or rows[0].flatness < THIN:
        return 0
    spreads = [spread(row.growth) for row in rows[1:last]]
    calm = 1 + next((k for k, spread in enumerate(spreads) if spread > CLOSELY), last - 1)
    if _are_layers(rows, last, float(np.median(spreads))):
        return last
    if calm >= CALM and _are_layers(rows, last, float(np.median(spreads[: calm - 1]))):
        return calm
    return last if _were_layers(rows, last) else 0


def _were_layers(rows: list[Course], last: int) -> bool:
    """The same of rows that have been disturbed: do their heights, in the median, still grow by one factor, and by
    much?"""
    if last < CALM or min(spread(rows[0].height), spread(rows[0].length - rows[0].height)) > UNSTEADY:
        return False
    heights, number = np.array([np.median(row.height) for row in rows[:last]]), np.arange(last)
    factor, first = np.polyfit(number, heights, 1)
    off = abs(heights - first - factor * number).max()
    return bool(factor >= FACTOR and factor * (last - 1) >= STILL_GROWN and off <= ALIKE)


def _are_layers(rows: list[Course], last: int, alike: float) -> bool:
    """The same of the first ``last`` rows. alike: how little growth varies along a row."""
    steady = min(spread(rows[0].height), spread(rows[0].length - rows[0].height))
    grown = float(np.median(rows[last - 1].height) - np.median(rows[0].height))
    factors = [float(np.median(row.growth)) for row in rows[1:last]]
    if (
        alike <= CLOSELY
        and min(factors) >= FACTOR
        and max(factors) - min(factors) <= CLOSELY
        and grown >= GROWN_BY_MUCH
    ):
        return steady <= UNSTEADY
    return alike <= ALIKE and grown >= GROWN and steady <= STEADY


def _height_spans(rows: list[Course]) -> float:
    """From the lowest row to the highest one."""
    return float(np.ptp([np.median(row.height) for row in rows]))


def _last(rows: list[Course]) -> int:
    """How many rows there are up to the first one that is not flat any more."""
    return next((k for k, row in enumerate(rows) if row.flatness < STILL_FLAT), len(rows))


def spread(values: Floats) -> float:
    """Between the tenth and the ninetieth of a hundred."""
    low, high = np.percentile(values, [10.0, 90.0])
    return float(high - low)


def _courses(graph: Graph, points: Floats, label: Ints) -> dict[int, list[Course]]:
    """The rows over each wall, as long as they have about as many nodes as the first.

    label: (N,) of the nodes of walls, −1 of all others.
    """
    label, height, level = label.copy(), np.zeros(len(points)), np.where(label >= 0, 0, -1)
    front, found = np.flatnonzero(label >= 0), dict[int, list[Course]]()
    while len(front):
        one, two = _neighbours(graph, front)
        one, two = front[one], two
        new = level[two] < 0
        one, two = one[new], two[new]
        far = _distance(points, one, two)
        order = np.lexsort((far, two))
        one, two, far = one[order], two[order], far[order]
        begin = np.flatnonzero(np.append(True, two[1:] != two[:-1])[: len(two)])
        if not len(begin):
            break
        level[two] = level[front[0]] + 1
        begin = begin[np.minimum.reduceat(label[one], begin) == np.maximum.reduceat(label[one], begin)]
        nodes, below = two[begin], one[begin]  # without what lies between two walls, and belongs to neither
        label[nodes], height[nodes] = label[below], far[begin]
        going = [front[:0]]
        for wall in np.unique(label[nodes]).tolist():
            own = label[nodes] == wall
            rows = found.setdefault(wall, [])
            high = height[nodes[own]]
            length = _lengths(graph, points, nodes[own], high, label, level)
            row = Course(nodes[own], high, high - height[below[own]], length)
            usual = len(rows[0].nodes) if rows else len(row.nodes)
            if len(row.nodes) >= FEWEST and usual <= REGULAR * len(row.nodes) <= REGULAR**2 * usual:
                rows.append(row)
                going.append(row.nodes)
        front = np.concatenate(going)
    return {wall: rows for wall, rows in found.items() if rows}


def _lengths(graph: Graph, points: Floats, nodes: Ints, height: Floats, label: Ints, level: Ints) -> Floats:
    """The logarithm of the mean distance of each node of a row from its neighbours in it, its height without any."""
    one, two = _neighbours(graph, nodes)
    row = (label[two] == label[nodes[0]]) & (level[two] == level[nodes[0]])
    one, two = one[row], two[row]
    number = np.bincount(one, minlength=len(nodes))
    total = np.bincount(one, _distance(points, nodes[one], two), len(nodes))
    return np.asarray(np.where(number > 0, total / np.maximum(number, 1), height))


def _distance(points: Floats, one: Ints, two: Ints) -> Floats:
    """The logarithm of how far nodes (n,) are from others (n,)."""
    way = points[two] - points[one]
    return np.asarray(np.log(np.maximum(np.hypot(way[:, 0], way[:, 1]), np.finfo(float).tiny)))


def _neighbours(graph: Graph, nodes: Ints) -> tuple[Ints, Ints]:
    """All neighbours of some nodes: of which of these, and the ids."""
    first, to = graph
    degree = first[nodes + 1] - first[nodes]
    one = np.repeat(np.arange(len(nodes)), degree)
    return one, to[np.arange(len(one)) + np.repeat(first[nodes] - np.cumsum(degree) + degree, degree)]


def _starts(walls: Walls, count: int) -> Flags:
    """(N,) nodes of walls along which cells are flat, and the few between them where cells are as high."""
    start, rim = np.zeros((2, count), dtype=bool)
    start[walls.edges[walls.flat]] = True
    rim[walls.edges] = True
    between = rim & ~start
    if not (start.any() and between.any()):
        return start
    loop, gap = pieces(walls.edges, rim), pieces(walls.edges, between)
    of_gap = np.bincount(gap[between], minlength=count)
    of_loop = np.bincount(loop[start], minlength=count)
    good = of_gap <= GAP * of_loop[loop]
    usual, name = np.full(count, np.inf), loop[walls.edges[:, 0]]
    for each in np.unique(name[walls.flat]).tolist():
        usual[each] = np.median(walls.height[walls.flat & (name == each)])
    for ends in walls.edges[walls.height > usual[name] + AS_HIGH].T:
        good[gap[ends[between[ends]]]] = False
    return np.asarray(start | (between & good[gap]))
