"""Libraries that tests do without where they are not installed."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

import pytest


def library(name: str) -> ModuleType:
    """A module; the test is skipped, saying why, where it is missing or lacks a library of the system."""
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        if error.name != name.partition(".")[0]:
            raise
        pytest.skip(f"{name} is not installed")
    except OSError as error:  # of Gmsh: libGLU and the like
        pytest.skip(f"{name} lacks a library of the system: {error}")
