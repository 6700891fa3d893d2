"""The site: ``sphinx-build -W docs site`` (pip install ".[docs]")."""

from __future__ import annotations

import re
import shutil
import sys
from importlib.metadata import version as _version
from importlib.util import find_spec
from pathlib import Path

project, release, author = "gmsnet", _version("gmsnet"), "The gmsnet developers"
copyright = author  # the name is Sphinx's
extensions = ["myst_parser", "sphinx_gallery.gen_gallery"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
myst_heading_anchors = 4
html_theme = "pydata_sphinx_theme"
html_title = f"gmsnet {release}"
html_theme_options = {"show_prev_next": False, "secondary_sidebar_items": ["page-toc"]}
exclude_patterns = ["reproduction/*.md", "_gallery/*", "sg_execution_times.rst"]

# The scripts run in a copy of their folder, which keeps what they write.
_docs = Path(__file__).parent
sys.path.insert(0, str(_docs))
shutil.copytree(_docs.parent / "examples" / "gallery", _docs / "_gallery", dirs_exist_ok=True)
_missing = [name for name in ("gmsh", "pyvista", "skfem") if find_spec(name) is None]
_without = [
    path.name
    for path in (_docs / "_gallery").glob("*.py")
    if any(re.search(rf"^import {name}\b", path.read_text(encoding="utf-8"), re.MULTILINE) for name in _missing)
]
sphinx_gallery_conf = {
    "examples_dirs": "_gallery",
    "gallery_dirs": "gallery",
    "filename_pattern": r"plot_",
    "ignore_pattern": "|".join(map(re.escape, _without)) or r"__init__\.py",
    "image_scrapers": ("gallery_pictures",),
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "write_computation_times": False,
    "show_signature": False,
}
