"""Configuration of the site: Sphinx with MyST Markdown, the Furo theme, and pages generated at build time.

`make docs` builds it, or `sphinx-build -W docs docs/_build`.
"""

import sys
from importlib.metadata import version as version_of
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import docstrings
import generate
import mathml

project = "hfsa"
author = "The hfsa developers"
copyright = "The hfsa developers, BSD-3-Clause"
version = release = version_of("hfsa")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]
exclude_patterns = ["_build", "_generated"]
nitpicky = False

myst_enable_extensions = ["deflist", "dollarmath"]
myst_heading_anchors = 3
myst_links_external_new_tab = True

# Docstrings write code in single backticks.
default_role = "literal"
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
napoleon_use_ivar = True
napoleon_use_rtype = False
napoleon_custom_sections = [("Further arguments", "params_style")]

html_theme = "furo"
html_title = f"hfsa {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_math_renderer = "mathml"


def setup(app):
    """Write the generated pages before Sphinx looks for sources, and let formulas be MathML."""
    generate.write(Path(app.srcdir))
    mathml.setup(app)
    docstrings.setup(app)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
