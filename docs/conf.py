# SPDX-License-Identifier: Apache-2.0
"""How Sphinx builds these pages: ``make docs``. Warnings are errors; nothing is fetched."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

project = "Gapkeeper"
author = "The Gapkeeper authors"
copyright = "the Gapkeeper authors, Apache-2.0"

extensions = ["myst_parser"]
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]
nitpicky = True

html_theme = "furo"
html_title = "Gapkeeper"
html_static_path = ["_static"]
html_css_files = ["gapkeeper.css"]
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}
