"""exp and log in float32 without branches, so that loops over lanes which call them are vectorised.

A library's functions are called lane by lane, and their last bits differ from machine to machine. These are sums and
products in a fixed order: the same bits everywhere.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined

ONE, TWO = np.float32(1.0), np.float32(2.0)
MOST_EXPONENT = np.float32(80.0)  # arguments of exp are brought to ±this, so that nothing overflows
PER_LN2 = np.float32(1.4426950408889634)
LN2, LN2_HIGH, LN2_LOW = np.float32(0.6931471805599453), np.float32(0.693359375), np.float32(-2.12194440e-4)
TO_INTEGER = np.float32(12582912.0)  # 1.5·2²³: what is added to it is rounded to an integer
EXP2, EXP3, EXP4 = np.float32(0.5), np.float32(0.16666667163), np.float32(4.1665795e-2)
EXP5, EXP6 = np.float32(8.3334519e-3), np.float32(1.3981999e-3)
LOG3, LOG5, LOG7 = np.float32(0.33333334327), np.float32(0.2), np.float32(0.14285714924)
ROOT_HALF_BITS = 0x3F3504F3  # of √½
MANTISSA_BITS = 23


@inlined
def exponential(x):
    """exp(x) within 2e-7 of its value, for x between −80 and 80; beyond, that of the end."""
    x = min(max(x, -MOST_EXPONENT), MOST_EXPONENT)
    k = (x * PER_LN2 + TO_INTEGER) - TO_INTEGER
    r = (x - k * LN2_HIGH) - k * LN2_LOW  # |r| ≤ ln 2 / 2
    p = EXP2 + r * (EXP3 + r * (EXP4 + r * (EXP5 + r * EXP6)))
    power = np.int32((np.int32(k) + 127) << MANTISSA_BITS).view(np.float32)
    return (ONE + (r + r * r * p)) * power


@inlined
def logarithm(x):
    """log(x) within 2e-7·(1 + |log x|) for positive normal numbers: x = 2ᵏ·m, m in [√½, √2), log m = 2·artanh s."""
    bits = np.float32(x).view(np.int32)
    k = np.int32(bits - ROOT_HALF_BITS) >> MANTISSA_BITS
    m = np.int32(bits - (np.int32(k) << MANTISSA_BITS)).view(np.float32)
    s = (m - ONE) / (m + ONE)
    s2 = s * s
    return np.float32(np.int32(k)) * LN2 + TWO * s * (ONE + s2 * (LOG3 + s2 * (LOG5 + s2 * LOG7)))
