"""Numba's cache of compiled functions, made fit for damaged files, full disks, and several versions in one folder.

Numba looks at a function's own file alone, though what it calls stands in others and is compiled into it. It runs what
a file of its cache holds, whole or not. And it believes the index, which is written before the code and by each process
without regard for others: after a kill, or where two compile at once, an index may name the code of another version or
for other arguments. So each file ends with a hash of its contents and of all the sources, and code lies beside the key
that it was made for. What does not fit is compiled anew.

The files are Python pickles and machine code: whoever can write them can run what they like. The hash is no protection
against that (docs/security.md).
"""

from __future__ import annotations

import contextlib
import hashlib
import pickle
from pathlib import Path
from typing import Any

import numba
from numba.core.runtime.nrt import rtsys

KNOWN = (0, 68)  # the last version of Numba of which it is known that kernels.jit.compilers and .library fit it
SOURCES = hashlib.sha256(
    b"".join(path.read_bytes() for path in sorted(Path(__file__).parents[1].rglob("*.py")))
).digest()  # of all kernels together
VERSION = pickle.dumps(numba.__version__, protocol=-1)  # with which an index begins
SIZE = 16  # bytes of a hash


def loading(context: Any) -> contextlib.AbstractContextManager[None]:
    """How code is loaded from the disk: by Numba alone where it may work otherwise inside. context: of its target."""
    if numba.version_info.short > KNOWN:
        return contextlib.nullcontext()
    from gmsnet.kernels.jit.library import loaded

    return loaded(context)


def make_trustworthy(cache: Any) -> None:
    """Changes the cache of one compiled function."""
    file = cache._cache_file
    file._source_stamp = (file._source_stamp, SOURCES)
    dump, load_index, load_data, load, save = file._dump, file._load_index, file._load_data, file.load, file.save
    save_overload = cache.save_overload

    def hash_of(contents: bytes) -> bytes:
        stamp = hashlib.blake2b(repr(file._source_stamp).encode()).digest()
        return hashlib.blake2b(contents, digest_size=SIZE, key=stamp).digest()

    def is_whole(contents: bytes) -> bool:
        return contents[-SIZE:] == hash_of(contents[:-SIZE])

    def sealed(thing: Any) -> bytes:
        contents: bytes = dump(thing)
        return contents + hash_of(contents)

    def whole_index() -> Any:
        with contextlib.suppress(OSError, AttributeError, ImportError):  # the last two if an argument's class has moved
            contents = Path(file._index_path).read_bytes()
            if contents.startswith(VERSION) and is_whole(contents[len(VERSION) :]):
                return load_index()
        return {}

    def whole_data(name: str) -> Any:
        if not is_whole(Path(file._data_path(name)).read_bytes()):
            raise OSError(f"{name} is damaged")  # which Numba takes for a file that is gone
        return load_data(name)

    def of_key(key: Any) -> Any:
        found = load(key)
        return found[1] if found is not None and found[0] == key else None

    def load_at_once(signature: Any, context: Any) -> Any:
        """As of any cache, but for what Numba loads first that compiling alone needs: its functions for typing and
        lowering, SciPy's BLAS among them, 0.4 s. Compiling loads it itself; the runtime is all that cached code needs.
        """
        rtsys.initialize(context)
        with cache._guard_against_spurious_io_errors(), loading(context):
            return cache._load_overload(signature, context)

    def save_if_there_is_room(signature: Any, result: Any) -> None:
        with contextlib.suppress(OSError):  # a full disk, a folder that may only be read by now
            save_overload(signature, result)  # the next process compiles it again

    file._dump, file._load_index, file._load_data = sealed, whole_index, whole_data
    file.load, file.save = of_key, lambda key, data: save(key, (key, data))
    cache.save_overload = save_if_there_is_room
    cache.load_overload = load_at_once
