"""One family of errors. Each says what was wrong with what the user gave, where, and how to mend it."""

from __future__ import annotations


class GmsnetError(Exception):
    """The base of every error that gmsnet raises on purpose. The command line prints it in one line and exits 2."""


class InputError(GmsnetError, ValueError):
    """A mesh, an option or an argument that cannot be used: out of range, of the wrong shape, contradictory."""


class FormatError(InputError):
    """A file that cannot be read or written in its format. The message starts with the file and, if known, the line."""


class MissingExtraError(GmsnetError, ImportError):
    """An optional dependency is not installed. The message names the command that installs it."""
