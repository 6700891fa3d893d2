"""The HDF5 file that an XDMF file names: its name in the text, and another one in its place."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from xml.sax.saxutils import escape, unescape

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.packed import split_name

H5 = ".h5"  # what the file beside it goes by in a mesh
# The text of an item that is kept in HDF5: the name of the file, a colon, the path within it.
_HDF = rb"\bFormat\s{0,9}=\s{0,9}[\"']HDF[\"']"
REFERENCE = re.compile(  # all lengths are bounded, so that no file takes long
    rb"(<DataItem\b[^<>]{0,500}" + _HDF + rb"[^<>]{0,500}>\s{0,99})([^<>:\"/\\]{1,255}):(/[^<>]{0,999}?)(?=\s{0,99}</)"
)


def links(data: Data) -> dict[str, str]:
    """The name of the HDF5 file that the items name, which lies beside, under the suffix ``H5``.

    Raises FormatError where they name several, or one in another folder.
    """
    names = {unescape(found[2].decode("utf-8", "replace")).strip() for found in REFERENCE.finditer(data)}
    if len(names) > 1:
        raise FormatError(f"the items name {len(names)} HDF5 files: put the arrays into one")
    if not names and re.search(_HDF, data):
        raise FormatError("an item of Format HDF must name a file beside this one, as in mesh.h5:/points")
    return {H5: names.pop()} if names else {}


def placed(name: str, links: Mapping[str, str], in_place: bool) -> dict[str, str]:
    """The name that the HDF5 file gets beside a file of this name: others may name the old one, too."""
    return {key: os.path.basename(split_name(name)[0]) + H5 for key in links}


def relinked(data: bytes, names: Mapping[str, str]) -> bytes:
    """The file with another name for the HDF5 file."""
    new = escape(names[H5]).encode()
    return REFERENCE.sub(lambda found: found[1] + new + b":" + found[3], data)
