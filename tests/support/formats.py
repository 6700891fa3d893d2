"""The formats that any mesh can be written in: all but those whose meshes are folders of files."""

from __future__ import annotations

from gmsnet.io.formats import FORMATS

FILES = {key: entry for key, entry in FORMATS.items() if not entry.own}
