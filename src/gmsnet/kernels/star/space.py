"""The SIMD parts that look at all simplices of a block of stars in space (kernels.star.space_blocks).

A star is a free node with the corner simplices of its cells, three spokes each, which end in the nodes around it (its
ring, in no order). Coordinates stand as [ring node][lane][x y z ·] in float32, over the size of the star and from its
free node; each lane reads the three rows of a simplex of its own. What follows of a simplex, w, D, s and S
(kernels.simplex.mean_ratio3), is kept, for D and S after any step follow from it in a few operations.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from llvmlite import ir
from numba.core import cgutils

from gmsnet.kernels.jit import vectors
from gmsnet.kernels.jit.vectors import INDEX, NUMBER, REAL, Lanes, Sum, Vector, as_written, index, lanewise
from gmsnet.kernels.simplex import mean_ratio3

KEPT = 8  # rows of each simplex: w, D, s, S
# Rows of sums. The Hessian without its part along I, its diagonal halved; ISO: the sum of f/S. LEAST: the minimum D.
# AFTER, MARGIN: the sum of f and the minimum D − c·S^(3/2) after a step.
VALUE, GX, GY, GZ, XX, YY, ZZ, XY, XZ, YZ, ISO, LEAST, AFTER, MARGIN = range(14)
SUMS = 14
LEAST_ROOT = 1e-15  # of an f: squares of less count as zero, for processors take long with subnormal numbers
FAR_ABOVE = 1e30  # for simplices that a lane does not have
# Constants of a power: of r = (S³/D²)·scale, f = r^(p/3), p = 3·2^k: √r for k = −1, its root for k = −2, …
SCALE, ROOT_OF_SCALE, TWO_P, M, MIXED, SQUARED = range(6)


@lanewise
def relate(lanes: Lanes, points: Any, ring: Any, offset: Any, rows: Any, star: Any, inverse: Any, local: Any) -> Any:
    """Writes local[row][lane] = (point of the ring − centre)·inverse in float32.

    points: (N, 4) float64. ring: from ``offset`` on. star: (L·4,) the centres of L lanes. inverse: (L,) float32.
    """
    types = lanes.types
    signature = types.void(points, ring, types.int64, types.int64, star, inverse, local)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        at = {k: vectors.data_of(context, builder, signature.args[k], arguments[k]) for k in (0, 1, 4, 5, 6)}
        four, double = ir.VectorType(REAL, 4), ir.VectorType(vectors.DOUBLE, 4)
        with cgutils.for_range(builder, arguments[3]) as loop:
            first = builder.mul(loop.index, index(lanes.width))
            for lane in range(lanes.width):
                here = builder.add(first, index(lane))
                node = builder.zext(builder.load(builder.gep(at[1], [builder.add(arguments[2], here)])), INDEX)
                place = vectors.load(builder, at[0], builder.shl(node, index(2)), double, 8)
                centre = vectors.load(builder, at[4], index(4 * lane), double, 8)
                away = builder.fptrunc(builder.fsub(place, centre), four)
                factor = builder.load(builder.gep(at[5], [index(lane)]))
                factors = builder.insert_element(ir.Constant(four, ir.Undefined), factor, ir.Constant(NUMBER, 0))
                factors = builder.shuffle_vector(factors, factors, vectors.mask_of(0, 0, 0, 0))
                vectors.store(builder, at[6], builder.shl(here, index(2)), builder.fmul(away, factors))
        return context.get_dummy_value()

    return signature, generate


def value_of(
    builder: Any, lengths: Vector, inverse: Vector, power: Any, constants: Sequence[Vector]
) -> tuple[Vector, Vector]:
    """f of simplices, and S^(3/2). inverse: 1/D. power: k."""
    high = lengths * vectors.root(lengths)
    ratio = high * inverse
    place = cgutils.alloca_once(builder, lengths.value.type)
    plain = builder.icmp_signed("<", power, index(0))
    with builder.if_else(plain) as (then, other):
        with then:
            builder.store((ratio * constants[ROOT_OF_SCALE]).value, place)
            with cgutils.for_range(builder, builder.sub(index(-1), power)):
                builder.store(vectors.root(Vector(builder, builder.load(place))).value, place)
        with other:
            builder.store(((ratio * ratio) * constants[SCALE]).value, place)
            with cgutils.for_range(builder, power):
                f = Vector(builder, builder.load(place)).above(LEAST_ROOT)
                builder.store((f * f).value, place)
    return Vector(builder, builder.load(place)), high


class _Wall:
    """The objective of ``mean_ratio3.walled``: its constants, those of a Power3, and how often it is squared."""

    def __init__(self, builder: Any, constants: Sequence[Vector], squarings: Any) -> None:
        self.builder, self.squarings = builder, squarings
        self.root, self.scale, self.steep, self.weight = constants

    @classmethod
    def of(cls, lanes: Lanes, context: Any, builder: Any, kind: Any, constants: Any, squarings: Any) -> _Wall | None:
        if lanes.is_none(kind):
            return None
        return cls(
            builder, _constants(lanes, builder, vectors.data_of(context, builder, kind, constants), 4), squarings
        )

    def around(self, lengths: Vector, inverse: Vector, on: Any) -> tuple[Sequence[Vector], Vector]:
        """What ``walled`` returns, and S^(3/2). inverse: 1/D."""
        builder, high = self.builder, lengths * vectors.root(lengths)
        ratio = (high * inverse * self.root).where(on, 1.0)
        place = cgutils.alloca_once(builder, lengths.value.type)
        builder.store(((ratio * ratio) * self.scale).value, place)
        with cgutils.for_range(builder, self.squarings):
            g = Vector(builder, builder.load(place)).above(LEAST_ROOT)
            builder.store((g * g).value, place)
        wall = Vector(builder, builder.load(place)) * self.weight
        return as_written(mean_ratio3.walled)(ratio, wall, self.steep), high


def _softness(lanes: Lanes, context: Any, builder: Any, kind: Any, soft: Any) -> Vector | None:
    """ε² of all lanes."""
    if lanes.is_none(kind):
        return None
    softness = lanes.load(builder, vectors.data_of(context, builder, kind, soft), 0)
    return softness * softness


def _inverses(double: Vector, softness: Vector | None) -> tuple[Vector, Vector]:
    """1/χ, and what stands for 1/D in the derivatives: 1/√(ε² + D²). Both are 1/D where nothing is softened."""
    if softness is None:
        inverse = 1.0 / double
        return inverse, inverse
    wide = vectors.root(softness + double * double)
    # For D < 0 the sum would lose its digits: χ = ½ε²/(√ − D).
    plain, small = (double + wide) * 0.5, softness * 0.5 * (1.0 / (wide - double))
    positive = small.builder.fcmp_ordered(">", double.value, vectors.constant(0.0, double.value.type))
    chi = Vector(double.builder, double.builder.select(positive, plain.value, small.value))
    return 1.0 / chi, 1.0 / wide


def _constants(lanes: Lanes, builder: Any, base: Any, count: int) -> list[Vector]:
    return [lanes.broadcast(builder, builder.load(builder.gep(base, [index(k)]))) for k in range(count)]


class _Rows:
    """Which lanes have a simplex in a row, and its weights: of tetrahedra, or of a mixture in the last arguments."""

    def __init__(
        self, lanes: Lanes, context: Any, builder: Any, kinds: Any, arguments: Any, counts: Any, at: Any
    ) -> None:
        self.of, self.builder, self.mixed, self.counts = lanes, builder, not lanes.is_none(kinds[0]), counts
        if self.mixed:
            self.role, self.present, self.weights = (
                vectors.data_of(context, builder, kind, argument)
                for kind, argument in zip(kinds, arguments, strict=True)
            )
            self.first = builder.udiv(at, index(3 * lanes.width))

    def lanes(self, row: Any) -> Any:
        """A mask."""
        builder = self.builder
        if not self.mixed:
            number = self.of.broadcast(builder, builder.trunc(row, NUMBER)).value
            return builder.icmp_signed("<", number, self.counts)
        return self.of.mask(builder, builder.load(builder.gep(self.present, [builder.add(self.first, row)])))

    def weight(self, row: Any, first: int, last: int) -> list[Vector]:
        """Those of a mixture, by their places."""
        builder = self.builder
        role = builder.load(builder.gep(self.role, [builder.add(self.first, row)]))
        place = builder.shl(builder.zext(role, INDEX), index(3))
        return [
            self.of.broadcast(builder, builder.load(builder.gep(self.weights, [builder.add(place, index(k))])))
            for k in range(first, last)
        ]


@lanewise
def derive(
    lanes: Lanes, local: Any, spoke: Any, at: Any, rows: Any, count: Any, block: Any, power: Any, constants: Any,
    soft: Any, wall: Any, squarings: Any, kept: Any, sums: Any, role: Any, present: Any, weights: Any,
) -> Any:  # fmt: skip
    """Writes what is kept of each simplex, and the sums VALUE to LEAST over them.

    local: as ``relate`` leaves it. spoke: from ``at`` on, so many rows; count: those of each lane, from block·L on,
    L lanes. power: k, constants: (SQUARED + 1,) float32, those named above. soft: (L,) ε of each lane, over the cube of
    its size, or None: in f, D is then χ(D) = (D + √(ε² + D²))/2, which is positive for any D (Garanzha et al.:
    Foldover-free maps in 50 lines of code, 2021), and the Hessian is that without the term of χ''. wall, squarings:
    those of a Power3; with a wall the objective is that of ``mean_ratio3.walled``. role, present, weights: those of a
    Mixture, or None.
    """
    types = lanes.types
    signature = types.void(
        local, spoke, types.int64, types.int64, count, types.int64, types.int64, constants, soft, wall, types.int64,
        kept, sums, role, present, weights,
    )  # fmt: skip
    measured, derivatives = as_written(mean_ratio3.measured), as_written(mean_ratio3.derivatives)
    measured_by = as_written(mean_ratio3.measured_by)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = {k: vectors.data_of(context, builder, signature.args[k], arguments[k]) for k in (0, 1, 4, 7, 11, 12)}
        barrier = _Wall.of(lanes, context, builder, signature.args[9], *arguments[9:11])
        softness = _softness(lanes, context, builder, signature.args[8], arguments[8])
        constants = _constants(lanes, builder, data[7], SQUARED + 1)
        first = builder.mul(arguments[5], index(lanes.width))
        counts = vectors.load(builder, data[4], first, lanes.numbers)
        lay = _Rows(lanes, context, builder, signature.args[13:], arguments[13:], counts, arguments[2])
        four = ir.VectorType(REAL, 4)
        found = [Sum(builder, lanes.reals, FAR_ABOVE if k == LEAST else 0.0) for k in range(LEAST + 1)]
        with cgutils.for_range(builder, arguments[3]) as loop:
            begin = builder.add(arguments[2], builder.mul(loop.index, index(3 * lanes.width)))
            spokes = list[Vector]()
            for k in range(3):
                ends = []
                for lane in range(lanes.width):
                    row = builder.load(builder.gep(data[1], [builder.add(begin, index(k * lanes.width + lane))]))
                    there = builder.add(builder.mul(builder.zext(row, INDEX), index(lanes.width)), index(lane))
                    ends.append(vectors.load(builder, data[0], builder.shl(there, index(2)), four))
                spokes += vectors.transposed(builder, ends)
            on = lay.lanes(loop.index)
            if lay.mixed:
                double, lengths, wx, wy, wz, sx, sy, sz = measured_by(*spokes, *lay.weight(loop.index, 0, 6))
                lengths = lengths.where(on, 1.0)
            else:
                double, lengths, wx, wy, wz, sx, sy, sz = measured(*spokes)
            double = double.where(on, FAR_ABOVE)
            wx, wy, wz = wx.where(on, 0.0), wy.where(on, 0.0), wz.where(on, 0.0)
            to = builder.mul(loop.index, index(KEPT * lanes.width))
            for k, row in enumerate((wx, wy, wz, double, sx, sy, sz, lengths)):
                vectors.store(builder, data[11], builder.add(to, index(k * lanes.width)), row.value)
            inverse, of_d = _inverses(double, softness)
            of_s = 1.0 / lengths
            if barrier is None:
                f, _ = value_of(builder, lengths, inverse, arguments[6], constants)
                f = even = part = f.where(on, 0.0)
                two_p, m, mixed, squared = constants[TWO_P:]
            else:
                (f, part, two_p, m, mixed, squared, even), _ = barrier.around(lengths, inverse, on)
                f, part, even = f.where(on, 0.0), part.where(on, 0.0), even.where(on, 0.0)
            terms = derivatives(part, of_s * two_p, of_d * m, wx, wy, wz, sx, sy, sz, mixed, squared)
            even = even * of_s * lay.weight(loop.index, 7, 8)[0] if lay.mixed else even * of_s
            for k, term in enumerate((f, *terms, even)):
                found[k].add(term)
            found[LEAST].lower(double)
        for k, total in enumerate(found):
            vectors.store(builder, data[12], index(k * lanes.width), total.get(builder).value)
        return context.get_dummy_value()

    return signature, generate


@lanewise
def judge(
    lanes: Lanes, kept: Any, rows: Any, count: Any, block: Any, power: Any, constants: Any, soft: Any, step: Any,
    floor: Any, sums: Any, at: Any, wall: Any, squarings: Any, role: Any, present: Any, weights: Any,
) -> Any:  # fmt: skip
    """Writes the sums AFTER and MARGIN after a step (3·L,), [axis][lane].

    floor: c, of D/S^(3/2). soft, at, wall, squarings, role, present, weights: as in ``derive``.
    """
    types = lanes.types
    signature = types.void(
        kept, types.int64, count, types.int64, types.int64, constants, soft, step, types.float32, sums, types.int64,
        wall, types.int64, role, present, weights,
    )  # fmt: skip
    moved, moved_by = as_written(mean_ratio3.moved), as_written(mean_ratio3.moved_by)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = {k: vectors.data_of(context, builder, signature.args[k], arguments[k]) for k in (0, 2, 5, 7, 9)}
        softness = _softness(lanes, context, builder, signature.args[6], arguments[6])
        constants = _constants(lanes, builder, data[5], SQUARED + 1)
        counts = vectors.load(builder, data[2], builder.mul(arguments[3], index(lanes.width)), lanes.numbers)
        lay = _Rows(lanes, context, builder, signature.args[13:], arguments[13:], counts, arguments[10])
        barrier = _Wall.of(lanes, context, builder, signature.args[11], *arguments[11:13])
        way = [lanes.load(builder, data[7], k) for k in range(3)]
        floor = lanes.broadcast(builder, arguments[8])
        after, margin = Sum(builder, lanes.reals, 0.0), Sum(builder, lanes.reals, FAR_ABOVE)
        with cgutils.for_range(builder, arguments[1]) as loop:
            at = builder.mul(loop.index, index(KEPT * lanes.width))
            rows = [builder.add(at, index(k * lanes.width)) for k in range(KEPT)]
            w = [Vector(builder, vectors.load(builder, data[0], row, lanes.reals)) for row in rows]
            if lay.mixed:
                double, lengths = moved_by(w[3], w[7], *w[:3], *w[4:7], *way, *lay.weight(loop.index, 6, 7))
            else:
                double, lengths = moved(w[3], w[7], *w[:3], *w[4:7], *way)
            on = lay.lanes(loop.index)
            inverse = _inverses(double, softness)[0]
            if barrier is None:
                f, high = value_of(builder, lengths, inverse, arguments[4], constants)
            else:
                (f, *_), high = barrier.around(lengths, inverse, on)
            after.add(f.where(on, 0.0))
            margin.lower((double - high * floor).where(on, FAR_ABOVE))
        vectors.store(builder, data[9], index(AFTER * lanes.width), after.get(builder).value)
        vectors.store(builder, data[9], index(MARGIN * lanes.width), margin.get(builder).value)
        return context.get_dummy_value()

    return signature, generate
