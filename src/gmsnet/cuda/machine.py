"""A GPU of NVIDIA: its memory, and kernels that it starts."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cuda.launch import check_rounding, entry, summary_entry
from gmsnet.cuda.library import at_work, checked
from gmsnet.kernels.simplex.summary import Summary

ROWS_EACH = 4  # corner simplices that a thread looks at, at least


class Card:
    """See executor.Machine."""

    name: str

    def __init__(self) -> None:
        self._cuda = checked()
        check_rounding()
        name = self._cuda.get_current_device().name
        self.name = name.decode() if isinstance(name, bytes) else str(name)
        self._pinned, self._points = ExitStack(), np.empty(0)
        self._figures = self.there(np.empty((1, 1)))

    def there(self, values: NDArray[Any]) -> Any:
        """See Machine."""
        with at_work():
            return self._cuda.to_device(np.ascontiguousarray(values))

    def send(self, values: NDArray[Any], there: Any) -> None:
        """See Machine. The array is kept from being swapped out until another one is sent: so copies take a third."""
        with at_work():
            if values is not self._points:
                self.close()
                self._points = values
                if values.flags.c_contiguous:
                    self._pinned.enter_context(self._cuda.pinned(values))
            there.copy_to_device(np.ascontiguousarray(values))

    def fetch(self, there: Any, values: NDArray[Any]) -> None:
        """See Machine."""
        with at_work():
            there.copy_to_host(values)

    def start(self, kernel: Callable[..., None], room: int, stars: int, arguments: tuple[Any, ...]) -> None:
        """See Machine."""
        with at_work():
            entry(kernel, room)(stars, *arguments)

    def summarise(self, summary: Summary, rows: int, arguments: tuple[Any, ...]) -> NDArray[np.float64]:
        """See Machine."""
        launch, (points, cells, rest) = summary_entry(summary), arguments
        threads = max(rows // ROWS_EACH, 1)
        with at_work():
            out = np.empty((launch.blocks(threads, points, cells, rows, rest, self._figures), summary.figures))
            there = self._cuda.device_array_like(out)
            launch(threads, points, cells, rows, rest, there)
        self.fetch(there, out)
        return out

    def close(self) -> None:
        """See Machine."""
        self._pinned.close()
        self._points = np.empty(0)
