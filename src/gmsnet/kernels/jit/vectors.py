"""Explicit SIMD: LLVM vectors of floats with operators, so that a formula is written once for numbers and for vectors.

A loop over lanes is vectorised by LLVM where offsets are constants. Where each lane reads rows of its own, it is not:
then an intrinsic made of these vectors takes a third of the time, and compiles in half of it. An intrinsic is written
for any number of lanes (``lanewise``): of one lane, which an accelerator has, its vectors are plain numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import wraps
from inspect import signature
from types import FunctionType, SimpleNamespace
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from gmsnet.kernels.jit.compile import Part

WIDTH = 16  # lanes
REAL: Any
DOUBLE: Any
NUMBER: Any
INDEX: Any
BYTE: Any
BIT: Any
REAL, DOUBLE, NUMBER, INDEX, BYTE, BIT = (
    ir.FloatType(), ir.DoubleType(), ir.IntType(32), ir.IntType(64), ir.IntType(8), ir.IntType(1)
)  # fmt: skip


class Lanes:
    """So many lanes, and the types that Numba, or what stands for it there, has for what intrinsics are given.

    reals, doubles, numbers: vectors of float32, float64 and int32.
    """

    def __init__(self, width: int, types: Any = types) -> None:
        self.width, self.types = width, types
        self.reals, self.doubles, self.numbers = self.of(REAL), self.of(DOUBLE), self.of(NUMBER)

    def is_none(self, kind: Any) -> bool:
        """Is that the type of None?"""
        return isinstance(kind, self.types.NoneType)

    def of(self, kind: Any) -> Any:
        """A vector of numbers of a kind."""
        return kind if self.width == 1 else ir.VectorType(kind, self.width)

    def broadcast(self, builder: Any, number: Any) -> Vector:
        """A number in all lanes."""
        if self.width == 1:
            return Vector(builder, number)
        one = builder.insert_element(ir.Constant(self.of(number.type), ir.Undefined), number, ir.Constant(NUMBER, 0))
        return Vector(builder, builder.shuffle_vector(one, one, mask_of(*[0] * self.width)))

    def load(self, builder: Any, base: Any, row: int) -> Vector:
        """A row of float32 of an array of such rows."""
        return Vector(builder, load(builder, base, index(row * self.width), self.reals))

    def load_double(self, builder: Any, base: Any, row: int = 0) -> Vector:
        """A row of an array of rows of float64."""
        return Vector(builder, load(builder, base, index(row * self.width), self.doubles, 8))

    def store_double(self, base: Any, row: int, value: Vector) -> None:
        """Writes one."""
        store(value.builder, base, index(row * self.width), value.value, 8)

    def store_flags(self, builder: Any, base: Any, mask: Any) -> None:
        """Writes a mask as the first row of an array of flags."""
        store(builder, base, index(0), builder.zext(mask, self.of(BYTE)), 1)

    def mask(self, builder: Any, bits: Any) -> Any:
        """That of which whole numbers are the bits."""
        bits = builder.trunc(bits, ir.IntType(self.width)) if bits.type.width > self.width else bits
        return builder.bitcast(bits, self.of(BIT))

    def count(self, builder: Any, mask: Any) -> Any:
        """In how many lanes a mask is set."""
        if self.width == 1:
            return builder.zext(mask, INDEX)
        return builder.zext(builder.ctpop(builder.bitcast(mask, ir.IntType(self.width))), INDEX)


def lanewise(function: Callable[..., Any], width: int = WIDTH) -> Any:
    """An intrinsic of so many lanes, of a function of lanes and of the types of its arguments.

    It returns what the function of an intrinsic does: the signature, and what generates code.
    """
    made: Any = intrinsic(typed(function, Lanes(width)))
    made.lanewise = function
    return made


def typed(function: Callable[..., Any], lanes: Lanes) -> Callable[..., Any]:
    """What is to be made an intrinsic of some lanes."""

    @wraps(function)
    def of_types(_context: Any, *kinds: Any) -> Any:
        return function(lanes, *kinds)

    of_types.__signature__ = signature(function)  # type: ignore[attr-defined]
    return of_types


def index(value: int) -> ir.Constant:
    """A whole number to count with."""
    return ir.Constant(INDEX, value)


def constant(value: float, kind: Any) -> ir.Constant:
    """The same number in all lanes."""
    if isinstance(kind, ir.VectorType):
        return ir.Constant(kind, [constant(value, kind.element)] * kind.count)
    return ir.Constant(kind, float(np.float32(value)) if kind == REAL else value)


class Vector:
    """Floats in a register, or float64 in two."""

    builder: Any
    value: Any

    def __init__(self, builder: Any, value: Any) -> None:
        self.builder, self.value = builder, value

    def _of(self, other: Vector | float) -> Any:
        return other.value if isinstance(other, Vector) else constant(other, self.value.type)

    def __add__(self, other: Vector | float) -> Vector:
        return Vector(self.builder, self.builder.fadd(self.value, self._of(other)))

    __radd__ = __add__

    def __sub__(self, other: Vector | float) -> Vector:
        return Vector(self.builder, self.builder.fsub(self.value, self._of(other)))

    def __mul__(self, other: Vector | float) -> Vector:
        return Vector(self.builder, self.builder.fmul(self.value, self._of(other)))

    __rmul__ = __mul__

    def __truediv__(self, other: Vector | float) -> Vector:
        return Vector(self.builder, self.builder.fdiv(self.value, self._of(other)))

    def __rtruediv__(self, other: float) -> Vector:
        return Vector(self.builder, self.builder.fdiv(self._of(other), self.value))

    def size(self) -> Vector:
        """Without its sign."""
        return Vector(self.builder, self.builder.select(self.below(-1.0 * self), (-1.0 * self).value, self.value))

    def widened(self) -> Vector:
        """In float64."""
        kind = self.value.type
        wide = ir.VectorType(DOUBLE, kind.count) if isinstance(kind, ir.VectorType) else DOUBLE
        return Vector(self.builder, self.builder.fpext(self.value, wide))

    def above(self, least: float) -> Vector:
        """This where it is at least so large, and elsewhere zero; what is not a number stays so."""
        small = self.builder.fcmp_ordered("<", self.value, self._of(least))
        return self.where(self.builder.not_(small), 0.0)

    def below(self, other: Vector) -> Any:
        """A mask: where this is less."""
        return self.builder.fcmp_ordered("<", self.value, other.value)

    def where(self, mask: Any, other: float) -> Vector:
        """This where the mask is set, and elsewhere a number."""
        return Vector(self.builder, self.builder.select(mask, self.value, self._of(other)))


def smaller(one: Vector, other: Vector) -> Vector:
    """The smaller of the two in each lane; ``other`` where one is not a number."""
    return Vector(one.builder, one.builder.select(one.below(other), one.value, other.value))


def larger(one: Vector, other: Vector) -> Vector:
    """The larger of the two in each lane; ``other`` where one is not a number."""
    return Vector(one.builder, one.builder.select(other.below(one), one.value, other.value))


def lesser(one: Vector | float, other: Vector) -> Vector:
    """The smaller of the two in each lane; what is not a number stays so. one: a number in all lanes."""
    builder = other.builder
    old = one if isinstance(one, Vector) else Vector(builder, constant(one, other.value.type))
    lost = builder.fcmp_unordered("uno", other.value, other.value)
    return Vector(builder, builder.select(builder.or_(other.below(old), lost), other.value, old.value))


def root(x: Vector) -> Vector:
    """Square roots."""
    kind = x.value.type
    name = f"llvm.sqrt.v{kind.count}f32" if isinstance(kind, ir.VectorType) else "llvm.sqrt.f32"
    function = cgutils.get_or_insert_function(x.builder.module, ir.FunctionType(kind, [kind]), name)
    return Vector(x.builder, x.builder.call(function, [x.value]))


def as_written(function: Any, **instead: Any) -> Callable[..., Any]:
    """The formula of a part for vectors: what it calls is taken as it is written, too, but for some names."""
    code = function.py_func
    names = {
        name: as_written(value) if isinstance(value, Part) else value for name, value in code.__globals__.items()
        if name in code.__code__.co_names
    } | instead  # fmt: skip
    if names.get("math") is math:
        names["math"] = SimpleNamespace(sqrt=root)
    return FunctionType(code.__code__, names)


def data_of(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    """The address of an array's first number."""
    return context.make_array(kind)(context, builder, array).data


def load(builder: Any, base: Any, offset: Any, kind: Any, align: int = 4) -> Any:
    """A vector that stands at an offset (in numbers of the array)."""
    value = builder.load(builder.bitcast(builder.gep(base, [offset]), kind.as_pointer()))
    value.align = align
    return value


def store(builder: Any, base: Any, offset: Any, value: Any, align: int = 4) -> None:
    """Writes a vector at an offset."""
    place = builder.store(value, builder.bitcast(builder.gep(base, [offset]), value.type.as_pointer()))
    place.align = align


def mask_of(*lanes: int) -> ir.Constant:
    """Which lanes of two vectors a shuffle takes."""
    return ir.Constant(ir.VectorType(NUMBER, len(lanes)), [ir.Constant(NUMBER, lane) for lane in lanes])


def transposed(builder: Any, rows: Sequence[Any]) -> list[Vector]:
    """The components x, y and z of vectors (x, y, z, ·) of four floats, one of each lane.

    Every fourth one goes into one register first: so one shuffle does for all.
    """
    if len(rows) == 1:
        return [Vector(builder, builder.extract_element(rows[0], ir.Constant(NUMBER, k))) for k in range(3)]
    parts = [_joined(builder, rows[k::4]) for k in range(4)]

    def mixed(one: Any, other: Any, *lanes: int) -> Any:
        width = len(rows)
        places = (4 * part + lane + (width - 4) * (lane > 3) for part in range(width // 4) for lane in lanes)
        return builder.shuffle_vector(one, other, mask_of(*places))

    first, second = mixed(parts[0], parts[1], 0, 4, 1, 5), mixed(parts[2], parts[3], 0, 4, 1, 5)
    third, fourth = mixed(parts[0], parts[1], 2, 6, 3, 7), mixed(parts[2], parts[3], 2, 6, 3, 7)
    found = mixed(first, second, 0, 1, 4, 5), mixed(first, second, 2, 3, 6, 7), mixed(third, fourth, 0, 1, 4, 5)
    return [Vector(builder, component) for component in found]


def _joined(builder: Any, parts: Sequence[Any]) -> Any:
    while len(parts) > 1:
        size = parts[0].type.count
        parts = [
            builder.shuffle_vector(parts[k], parts[k + 1], mask_of(*range(2 * size))) for k in range(0, len(parts), 2)
        ]
    return parts[0]


class Sum:
    """A vector that is added to in a loop; LLVM keeps it in a register."""

    place: Any

    def __init__(self, builder: Any, kind: Any, first: float) -> None:
        self.place = cgutils.alloca_once(builder, kind)
        builder.store(constant(first, kind), self.place)

    def get(self, builder: Any) -> Vector:
        """As it is now."""
        return Vector(builder, builder.load(self.place))

    def set(self, value: Vector) -> None:
        """Replaces it."""
        value.builder.store(value.value, self.place)

    def add(self, value: Vector) -> None:
        """Adds to it."""
        self.set(self.get(value.builder) + value)

    def lower(self, value: Vector) -> None:
        """Replaces it where the value is smaller, or is not a number; what is not a number stays so."""
        builder, old = value.builder, self.get(value.builder)
        lost = builder.fcmp_unordered("uno", old.value, old.value)
        kept = builder.or_(builder.fcmp_ordered(">=", value.value, old.value), lost)
        self.set(Vector(builder, builder.select(kept, old.value, value.value)))
