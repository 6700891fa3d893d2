"""Mesh files: ``read`` and ``write``. One format a file; ``formats.py`` is their table."""

from gmsnet.io.files import read as read
from gmsnet.io.formats import FORMATS as FORMATS
from gmsnet.io.output import write as write

__all__ = ["FORMATS", "read", "write"]
