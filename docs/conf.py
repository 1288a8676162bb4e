from importlib import metadata

project = "unmodeled"
author = "The unmodeled founders"
release = metadata.version("unmodeled")
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_build"]
html_theme = "furo"
autodoc_typehints = "description"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
myst_heading_anchors = 3
nitpicky = False
