"""What all tests share."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("gmsnet", deadline=None)  # the first example may compile kernels
settings.load_profile("gmsnet")


@pytest.fixture(scope="session")
def real_meshes() -> Path:
    """The folder of real meshes that GMSNET_MESHES names."""
    folder = os.environ.get("GMSNET_MESHES")
    if not folder:
        pytest.skip("GMSNET_MESHES does not name the folder of real meshes")
    return Path(folder)
