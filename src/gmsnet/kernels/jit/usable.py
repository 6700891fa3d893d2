"""The error that says that Numba cannot be used. It is apart, so that it can be caught without loading Numba."""

from __future__ import annotations


class UnusableNumbaError(ImportError):
    """Numba cannot be used as it is set up. The message names the setting."""
