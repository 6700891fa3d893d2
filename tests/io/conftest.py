"""What the tests of the formats share."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("io", deadline=None)  # the first example may compile kernels
settings.load_profile("io")
