"""Sphinx settings: MyST pages, formulas by MathJax."""

import tomllib
from pathlib import Path

_project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]

project = _project["name"]
author = "The fsci developers"
release = _project["version"]
extensions = ["myst_parser", "sphinx.ext.mathjax"]
myst_enable_extensions = ["amsmath", "deflist", "dollarmath"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "notes"]
# Anchors on pages of code hosts are made by scripts; a server that is busy gets a second chance.
linkcheck_anchors = False
linkcheck_retries = 2
linkcheck_timeout = 20
html_theme = "alabaster"
html_theme_options = {"description": _project["description"], "page_width": "1080px"}
html_extra_path = ["reference/fsci.schema.json"]
