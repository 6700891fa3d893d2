"""A callback of the first rank, whose answers all ranks get."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from gmsnet.errors import GmsnetError
from gmsnet.run.sweep import Sweep


@dataclass(frozen=True)
class Answered:
    """To be called by all ranks alike: the first one asks its own and tells the others the answer.

    own: that of the first rank, which calls it where it works alone.
    """

    comm: Any
    own: Callable[[Sweep], bool | None] | None

    def __call__(self, sweep: Sweep) -> bool | None:
        """Ends the run on all ranks? Raises KeyboardInterrupt on all where the first one's does, and on the others a
        GmsnetError where that raises anything else."""
        answer: Any = None
        if self.comm.rank == 0:
            try:
                answer = self.own is not None and bool(self.own(sweep))
            except KeyboardInterrupt:
                answer = KeyboardInterrupt
            except BaseException as error:
                self.comm.bcast(f"the callback of rank 0 failed: {type(error).__name__}: {error}")
                raise
        answer = self.comm.bcast(answer)
        if answer is KeyboardInterrupt:
            raise KeyboardInterrupt
        if isinstance(answer, str):
            raise GmsnetError(answer)
        return bool(answer)
