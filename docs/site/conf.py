"""Configuration of Sphinx for the site; the sources are staged by ``docs.site.stage``."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from nlsdesign.foundation import locations
from nlsdesign.presentation.figures.style import TONES

FONTS = {"font-stack": "system-ui, sans-serif", "font-stack--monospace": "ui-monospace, monospace"}

project = "nlsdesign"
author = "the nlsdesign authors"
copyright = "the nlsdesign authors, MIT licence"
release = locations.version()
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "docs.site.typeset",
    "docs.site.navigation",
]
source_suffix = {".md": "markdown"}
root_doc = "index"
exclude_patterns: list[str] = []

myst_enable_extensions = ["dollarmath", "attrs_inline", "deflist"]
myst_heading_anchors = 4
myst_dmath_double_inline = True
suppress_warnings = ["myst.header"]

html_theme = "furo"
html_title = f"nlsdesign {release}"
html_static_path = ["static"]
html_favicon = "../../nlsdesign/live/page/icon.svg"
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_theme_options = {
    "light_css_variables": FONTS | {tone.name: tone.light for tone in TONES},
    "dark_css_variables": {tone.name: tone.dark for tone in TONES},
    "navigation_with_keys": True,
}
html_math_renderer = "mathml"
pygments_style = "a11y-high-contrast-light"
pygments_dark_style = "a11y-high-contrast-dark"
highlight_language = "text"

autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_param = True
