"""Sphinx: the pages of this folder, written in Markdown, and the API reference from the docstrings."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import api_pages

project = "fmu-observer"
author = "The fmu-observer authors"
copyright = "2026, The fmu-observer authors"

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_heading_anchors = 3
autodoc_member_order = "bysource"
napoleon_numpy_docstring = False
exclude_patterns = ["_build", "gallery"]
html_theme = "alabaster"
html_theme_options = {"page_width": "1100px"}

api_pages.write(Path(__file__).parent / "reference" / "api")
