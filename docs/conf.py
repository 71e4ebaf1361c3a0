"""Sphinx: the pages of this folder, written in Markdown."""

project = "fmu-observer"
author = "The fmu-observer authors"
copyright = "2026, The fmu-observer authors"

extensions = ["myst_parser"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]
html_theme = "alabaster"
html_theme_options = {"page_width": "1100px"}
