"""Sphinx configuration of the documentation site: ``sphinx-build -W docs build/docs``."""

import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import generated_pages

import gaitopt

project = "gaitopt"
author = "The gaitopt developers"
release = version = gaitopt.__version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton", "mathml"]
exclude_patterns = ["jupyter_execute", "examples", "images", "gallery.json", "*_head.md"]
# ref.python: if classes share the name of an attribute, a docstring that lists it has two targets.
suppress_warnings = ["mystnb.unknown_mime_type", "ref.python"]

smartquotes_action = "qe"  # quotes and ellipses; the hyphens of ``--option`` remain
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath", "fieldlist"]
myst_heading_anchors = 3
myst_update_mathjax = False  # equations are MathML, which needs no script
html_math_renderer = "mathml"
nb_execution_mode = "force"  # execute every cell of every page, so that no output is out of date
nb_execution_raise_on_error = True
nb_execution_timeout = 180
nb_merge_streams = True

autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings state types, with shapes and units
napoleon_use_ivar = True
napoleon_use_rtype = False

html_theme = "pydata_sphinx_theme"
html_title = f"gaitopt {release}"
html_show_sourcelink = False
html_static_path = ["static"]
html_css_files = ["site.css"]
html_js_files = ["scrolling.js", "figures.js"]
html_theme_options = {
    "navigation_with_keys": True,
    "show_toc_level": 2,
    "secondary_sidebar_items": ["page-toc"],
    "header_links_before_dropdown": 7,
    "footer_start": ["copyright"],
    "footer_end": [],
}
if versions := os.environ.get("GAITOPT_DOCS_VERSIONS"):  # URL of the list of the versions that are published together
    html_theme_options |= {
        "switcher": {"json_url": versions, "version_match": version},
        "check_switcher": False,  # the list is published with the pages and may not exist yet
        "navbar_end": ["version-switcher", "theme-switcher", "navbar-icon-links"],
    }
html_sidebars = {"developers": [], "changelog": []}  # no other pages belong to them
html_context = {"default_mode": "auto"}
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True


def setup(app):
    """Generate pages from the code before Sphinx collects the pages."""
    app.connect("builder-inited", lambda app: generated_pages.write(Path(app.srcdir) / "generated"))
