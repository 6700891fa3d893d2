"""Files of a training, each written whole or not at all, the same bytes for the same content."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError

_NAMES = {"float32": "F32", "float64": "F64", "int64": "I64"}


def safetensors_bytes(tensors: Mapping[str, NDArray[Any]], metadata: Mapping[str, str]) -> bytes:
    """A safetensors file. (The library's own writer puts the metadata in a new random order each time.)"""
    header: dict[str, Any] = {"__metadata__": dict(sorted(metadata.items()))}
    pieces = []
    at = 0
    for name, tensor in sorted(tensors.items()):
        data = np.ascontiguousarray(tensor, dtype=tensor.dtype.newbyteorder("<")).tobytes()
        header[name] = {
            "dtype": _NAMES[tensor.dtype.name],
            "shape": list(tensor.shape),
            "data_offsets": [at, at + len(data)],
        }
        pieces.append(data)
        at += len(data)
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)  # tensors start at a multiple of eight
    return len(text).to_bytes(8, "little") + text + b"".join(pieces)


def write_atomic(path: Path, data: bytes) -> None:
    """Write a file beside its place and move it there, so that a kill leaves the old one or the new one whole."""
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=path.name, suffix=".part")
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from error
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise
