"""Compiled conversion between float64 and decimals, both ways exact.

Reading: up to 19 digits and a power of ten give the 64 leading bits of the value by one product with a table, and a
bound of what is missing; if the bound cannot change the rounding, that is the number (D. Lemire, Number parsing at a
gigabyte per second, 2021). What remains, about one number in a thousand, is left to a slower way.

Printing: the shortest decimal that reads back as the same float64, and of those the nearest, is found among the
multiples of one power of ten and of the next by three products with the 128 leading bits of a power (R. Giulietti, The
Schubfach way to render doubles, 2020).
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import part

LEAST, MOST = -343, 325  # powers of ten in the table
WIDEST = 24  # the most characters of a float64: -1.7976931348623157e+308
LONG = -1  # from nearest_float: not decided

_U = np.uint64
_HALF = _U(0xFFFFFFFF)
_TOP = _U(1 << 63)
_FRACTION = _U((1 << 52) - 1)
_INFINITE = _U(0x7FF << 52)
_TENS = np.array([10**k for k in range(20)], dtype=np.uint64)


def _powers() -> np.ndarray:
    """The 128 leading bits of 10**k, rounded down, as two numbers of 64 bits: (MOST − LEAST + 1, 2)."""
    rows = []
    for k in range(LEAST, MOST + 1):
        if k >= 0:
            power = 10**k
            shift = power.bit_length() - 128
            bits = power >> shift if shift >= 0 else power << -shift
        else:
            power = 10**-k
            bits = (1 << (power.bit_length() + 127)) // power
        rows.append((bits >> 64, bits & (2**64 - 1)))
    return np.array(rows, dtype=np.uint64)


POWERS = _powers()


@part
def high_product(a, b):
    """The upper 64 bits of the product of two numbers of 64 bits."""
    a1, a0, b1, b0 = a >> _U(32), a & _HALF, b >> _U(32), b & _HALF
    middle = a1 * b0 + (a0 * b0 >> _U(32))
    return a1 * b1 + (middle >> _U(32)) + ((a0 * b1 + (middle & _HALF)) >> _U(32))


@part
def nearest_float(digits, scale, cut):
    """The bits of the float64 nearest to digits · 10**scale, or LONG where that is not certain.

    digits: uint64, at least 1. cut: there are more digits, so the number lies between digits and digits + 1.
    """
    if not LEAST <= scale <= 308:
        return np.int64(LONG)
    width = 64
    while digits >> _U(56) == _U(0):
        digits <<= _U(8)
        width -= 8
    while digits < _TOP:
        digits <<= _U(1)
        width -= 1
    # The value is between product and product + bound, times a power of two: the table is less than one too small, as
    # is the product; and the digits are so many that what was cut off is less than 16 units of the last bit.
    bound = _U(18) if cut else _U(2)
    product = high_product(digits, POWERS[scale - LEAST, 0])
    shift = 11 if product >= _TOP else 10
    rest = product & ((_U(1) << _U(shift)) - _U(1))
    half = _U(1) << _U(shift - 1)
    if rest <= half < rest + bound:
        return np.int64(LONG)
    whole = np.int64((product >> _U(shift)) + _U(rest > half))  # 53 bits, the first of which is implied
    exponent = ((scale * 217706) >> 16) + width + shift - 11 + 1023  # 217706 / 2**16 is log2(10)
    if not 1 <= exponent <= 2045:
        return np.int64(LONG)
    return (np.int64(exponent) << 52) + (whole - (np.int64(1) << 52))


@part
def _round_to_odd(high, low, number):
    """The upper 64 bits of the product of a number of 64 bits and one of 128; odd if anything is cut off."""
    lower = high * number
    carried = lower + high_product(low, number)
    upper = high_product(high, number) + _U(carried < lower)
    return upper | _U(carried > _U(1))


@part
def shortest(bits):
    """(digits, scale): the shortest decimal digits · 10**scale with the same float64; bits: of one above zero."""
    fraction = bits & _FRACTION
    field = np.int64(bits >> _U(52))
    number = fraction if field == 0 else fraction | (_FRACTION + _U(1))
    power = field - 1075 if field else np.int64(-1074)
    # Everything is in quarters: what lies between number - 1/2 and number + 1/2 reads back as it, and the ends do if it
    # is even. Below a power of two floats are twice as dense.
    dense = fraction == _U(0) and field > 1
    scale = (power * 1262611 - (524031 if dense else 0)) >> 22  # the power of ten next below the width
    shift = _U(power + ((-scale * 1741647) >> 19) + 1)  # 1741647 / 2**19 is log2(10)
    high, low = POWERS[-scale - LEAST, 0], POWERS[-scale - LEAST, 1] + _U(1)
    high += _U(low == _U(0))
    odd = number & _U(1)
    least = _round_to_odd(high, low, (number * _U(4) - (_U(1) if dense else _U(2))) << shift) + odd
    value = _round_to_odd(high, low, number * _U(4) << shift)
    most = _round_to_odd(high, low, (number * _U(4) + _U(2)) << shift) - odd
    digits = value >> _U(2)
    step = _U(1)
    if digits >= _U(10):
        short = digits // _U(10) * _U(10)
        if (least <= short * _U(4)) != (short * _U(4) + _U(40) <= most):  # the next longer power of ten will do
            digits, step = short, _U(10)
    under = least <= digits * _U(4)
    over = (digits + step) * _U(4) <= most
    middle = digits * _U(4) + _U(2)
    if under != over:
        digits += step * _U(over)
    elif value > middle or (value == middle and digits & _U(1)):
        digits += _U(1)
    while digits % _U(10) == _U(0):
        digits //= _U(10)
        scale += 1
    return digits, scale


@part
def print_decimal(number, places, out, at):
    """Writes number · 10**-places from out[at] on, without a point if places is 0; returns the place behind it."""
    length = len(_TENS) if places < len(_TENS) else places + 1
    while length > places + 1 and number < _TENS[length - 1]:
        length -= 1
    end = at + length + (places > 0)
    k = end
    for j in range(length):
        if j == places and j > 0:
            k -= 1
            out[k] = 46
        rest = number // _U(10)
        k -= 1
        out[k] = np.uint8(_U(48) + number - rest * _U(10))
        number = rest
    return end


@part
def print_float(value, out, at):
    """Writes what repr() gives of a float64 from out[at] on, and returns the place behind it."""
    bits = np.float64(value).view(np.uint64)
    negative = bits & _TOP != _U(0)
    bits &= ~_TOP
    if bits > _INFINITE:
        negative = False
    if negative:
        out[at] = 45
        at += 1
    if bits >= _INFINITE:
        no_number = bits > _INFINITE
        out[at] = 110 if no_number else 105
        out[at + 1] = 97 if no_number else 110
        out[at + 2] = 110 if no_number else 102
        return at + 3
    digits, scale = _U(0), 0
    if bits != _U(0):
        digits, scale = shortest(bits)
    count = 1
    while count < len(_TENS) and digits >= _TENS[count]:
        count += 1
    point = count + scale  # digits before the point
    fixed = -4 < point <= 16
    places = count - 1
    if fixed:
        places = -scale if scale < 0 else 1
        if scale >= 0:
            digits *= _TENS[scale + 1]
    at = print_decimal(digits, places, out, at)
    if not fixed:
        out[at] = 101
        out[at + 1] = 43 if point > 0 else 45
        exponent = point - 1 if point > 0 else 1 - point
        at += 2
        if exponent >= 100:
            out[at] = 48 + exponent // 100
            at += 1
        out[at] = 48 + exponent // 10 % 10
        out[at + 1] = 48 + exponent % 10
        at += 2
    return at
