"""``--metric`` and ``--size``: values at nodes in Medit's files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping


def values_at_nodes(metric: str | None, size: str | None) -> Mapping[str, Any]:
    """The options of ``gmsnet.smooth`` of these names, of those files that are given.

    Raises InputError for files that cannot be read and that hold something else.
    """
    from gmsnet.io.sol import read_metric, read_sizes

    found: dict[str, Any] = {}
    if metric is not None:
        found["metric"] = read_metric(metric)
    if size is not None:
        found["size"] = read_sizes(size)
    return found
