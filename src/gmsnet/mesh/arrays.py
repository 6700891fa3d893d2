"""What users give as arrays, made arrays: checked, converted, and read-only without copies that are not needed."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError

MOST_FLOAT = 2.0**53  # below it every whole number has a float64 of its own


def plain_array(thing: Any, what: str) -> NDArray[Any]:
    """``np.asarray(thing)``. Raises InputError, starting with ``what``, for ragged lists and masked values."""
    if np.ma.is_masked(thing):
        raise InputError(f"{what} hold masked values: give a plain array of the unmasked ones")
    try:
        return np.asarray(thing)
    except (ValueError, TypeError, RuntimeError) as error:  # the last from tensors that are not on the CPU
        raise InputError(f"{what} cannot be made an array: {error}") from error


def whole_numbers(thing: Any, what: str, *, bools: bool = False) -> NDArray[np.int64]:
    """A read-only int64 array of the same values; floats pass where each is a whole number.

    bools: take True and False for 1 and 0. Raises InputError, starting with ``what``, where a value would change.
    """
    array = plain_array(thing, what)
    if array.dtype == np.int64:
        return read_only(array)
    kind = array.dtype.kind
    if array.size and kind == "f":
        with np.errstate(over="ignore"):
            values = array.astype(np.float64)
        wrong = values[~((values == np.rint(values)) & (np.abs(values) < MOST_FLOAT))]
        if wrong.size:
            raise InputError(f"{what} must be whole numbers, got {wrong[0]}")
    elif array.size and kind not in ("iub" if bools else "iu"):
        raise InputError(f"{what} must be whole numbers, got {array.dtype} values: give integers, as by .astype(int)")
    if array.size and kind == "u" and int(array.max()) > np.iinfo(np.int64).max:
        raise InputError(f"{what} must be whole numbers below 2**63, got {array.max()}")
    return _sealed(array.astype(np.int64) if array.size else np.zeros(array.shape, dtype=np.int64))


def coordinates(thing: Any) -> NDArray[Any]:
    """Points as an array (N × 2 or N × 3) of their own type of number. Raises InputError where they are none."""
    array = plain_array(thing, "points")
    if array.dtype.kind not in "iuf" or array.ndim != 2:
        raise InputError(f"points must be an array of N×2 or N×3 numbers, got {array.dtype} of shape {array.shape}")
    if array.shape[1] not in (2, 3):
        mend = ": give points.T" if array.shape[0] in (2, 3) else ""
        raise InputError(f"points must be N×2 or N×3, got shape {array.shape}{mend}")
    return array


def float64_rows(array: NDArray[Any]) -> NDArray[np.float64]:
    """Numbers as a read-only float64 array, row after row in memory. What is too large for one becomes infinite.

    Raises InputError for whole numbers so large that neighbours share a float64.
    """
    if array.dtype == np.float64 and array.flags.c_contiguous:
        return read_only(array)
    with np.errstate(over="ignore"):
        rows = np.array(array, dtype=np.float64, order="C")
    if array.size and array.dtype.kind in "iu" and array.dtype.itemsize == 8 and np.abs(rows).max() >= MOST_FLOAT:
        raise InputError("whole numbers from 2**53 on are no exact coordinates: give floats, or less an offset")
    return _sealed(rows)


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """A read-only copy; the array itself where nobody can write to its memory, so that copies of values stay cheap."""
    owner: Any = array
    while isinstance(owner, np.ndarray) and not owner.flags.writeable:
        if owner.base is None:
            return array
        owner = owner.base
    return _sealed(array.copy(order="K"))


def _sealed(array: NDArray[Any]) -> NDArray[Any]:
    array.flags.writeable = False
    return array
