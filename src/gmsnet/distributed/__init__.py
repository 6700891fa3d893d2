"""Meshes that are spread over the ranks of a cluster (docs/distributed.md)."""

from gmsnet.distributed.api import quality, smooth
from gmsnet.distributed.result import RankResult
from gmsnet.measure.overview import Overview

__all__ = ["Overview", "RankResult", "quality", "smooth"]
