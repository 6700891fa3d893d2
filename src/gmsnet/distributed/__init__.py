"""Meshes that are spread over the ranks of a cluster (docs/distributed.md)."""

from gmsnet.distributed.api import smooth
from gmsnet.distributed.result import RankResult

__all__ = ["RankResult", "smooth"]
