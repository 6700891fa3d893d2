"""Files of several ranks that are all replaced, or none of them."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from gmsnet.distributed.agreement import everywhere, raise_everywhere
from gmsnet.errors import GmsnetError, InputError
from gmsnet.io.atomic import replace_files
from gmsnet.io.linked import folders_for
from gmsnet.io.pieces import Piece
from gmsnet.io.stamps import Stamps


def replace_together(
    comm: Any, name: str, files: Mapping[str, bytes | Iterable[Piece]], every: Sequence[str], stamps: Stamps
) -> None:
    """``replace_files`` over all ranks: what each writes reaches the disk, all say so, and only then is any replaced.

    files: path → contents of this rank. every: the paths of all ranks, whose folders below that of ``name`` the first
    makes. Raises InputError, on all ranks, with what the first says that failed; then no temporary file is left.
    """
    with contextlib.ExitStack() as folders:
        everywhere(comm, lambda: folders.enter_context(folders_for(name, every if comm.rank == 0 else ())))
        asked, wrong = False, ""

        def agree() -> None:
            nonlocal asked
            asked = True
            raise_everywhere(comm, "")

        try:
            replace_files(files, stamps, agree)
        except Exception as error:  # whatever it is, the others wait for an answer
            wrong = str(error) if isinstance(error, GmsnetError) else _unforeseen(error)
            if not asked:
                with contextlib.suppress(InputError):  # raised below, when no rank has temporary files any more
                    raise_everywhere(comm, wrong)
        raise_everywhere(comm, wrong)


def _unforeseen(error: Exception) -> str:
    if isinstance(error, MemoryError):
        return "there is not enough memory to write this mesh"
    return f"the mesh cannot be written: {type(error).__name__}: {error}"
