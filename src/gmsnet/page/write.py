"""Pages are written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

from gmsnet.errors import InputError
from gmsnet.io.atomic import replace_files
from gmsnet.page.contents import Contents
from gmsnet.page.document import pieces

SUFFIXES = (".html", ".htm")


def check_page(path: str | os.PathLike[str]) -> None:
    """InputError where the name of a page is not one of an HTML file."""
    if Path(path).suffix.lower() not in SUFFIXES:
        raise InputError(f"{os.fspath(path)}: a report is an HTML file: name it .html")


def write_page(path: str | os.PathLike[str], contents: Contents) -> None:
    """Write a page. Raises InputError for another suffix, and where the file cannot be written."""
    check_page(path)
    replace_files({os.fspath(path): pieces(contents)})
