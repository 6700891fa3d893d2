"""The site: ``sphinx-build -W docs site`` (pip install ".[docs]")."""

from __future__ import annotations

from importlib.metadata import version as _version

project, release, author = "gmsnet", _version("gmsnet"), "The gmsnet developers"
copyright = author  # the name is Sphinx's
extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
myst_heading_anchors = 4
html_theme = "pydata_sphinx_theme"
html_title = f"gmsnet {release}"
html_theme_options = {"show_prev_next": False, "secondary_sidebar_items": ["page-toc"]}
exclude_patterns = ["reproduction/*.md"]
