"""How the documentation is built: ``python -m sphinx -W docs docs/_build``, without a network."""

import re
import sys
import warnings
from pathlib import Path

import matplotlib as mpl
import pyvista

import quadcurv

sys.path.insert(0, str(Path(__file__).parent))
mpl.use("agg")
pyvista.OFF_SCREEN = True
warnings.simplefilter("ignore", quadcurv.MeshWarning)  # the gallery shows them where it speaks of them

from gallery import ORDER, Pictures  # noqa: E402
from sphinx_gallery.sorting import ExplicitOrder  # noqa: E402

project = "quadcurv"
author = "The quadcurv developers"
copyright = "2026, the quadcurv developers"
version = release = quadcurv.__version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "mathml",
    "numpydoc",
    "myst_parser",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build", "packaging", "paper.md", "auto_examples/*.ipynb", "auto_examples/*.py"]
myst_enable_extensions = ["dollarmath", "deflist", "colon_fence"]
myst_heading_anchors = 3
suppress_warnings = ["config.cache"]
html_math_renderer = "mathml"

autosummary_generate = True
autosummary_imported_members = False
autodoc_typehints = "none"
numpydoc_show_class_members = False
numpydoc_validation_checks = set()
add_module_names = False

sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "auto_examples",
    "filename_pattern": r"\.py",
    "ignore_pattern": r"readme_picture\.py",
    "within_subsection_order": ExplicitOrder([f"{name}.py" for name in ORDER]),
    "image_scrapers": (Pictures(), "matplotlib"),
    "capture_repr": ("_repr_html_",),
    "abort_on_example_error": True,
    "plot_gallery": True,
    "download_all_examples": False,
    "show_memory": False,
    "show_signature": False,
    "write_computation_times": False,
    "min_reported_time": 10_000,
    "reset_modules": ("matplotlib",),
}

html_theme = "pydata_sphinx_theme"
html_title = f"quadcurv {version}"
html_static_path = ["_static"]
html_css_files = ["quadcurv.css"]
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "show_prev_next": False,
    "secondary_sidebar_items": ["page-toc"],
    "navbar_end": ["theme-switcher"],
    "navigation_with_keys": False,
    "footer_start": ["copyright"],
    "footer_end": [],
    "header_links_before_dropdown": 6,
}
html_sidebars = {"start": [], "theory": [], "performance": [], "peers": [], "trust": [], "contributing": []}


def _escape(app, what, name, obj, options, lines):
    """Let docstrings say |x| and X_-1 as they stand: outside of backticks no markup is meant by these."""
    for k, line in enumerate(lines):
        parts = line.split("`")
        parts[::2] = (re.sub(r"(?<!\\)\||(?<=\w)_(?![\w`])", r"\\\g<0>", part) for part in parts[::2])
        lines[k] = "`".join(parts)


def setup(app):
    """Connect ahead of numpydoc."""
    app.connect("autodoc-process-docstring", _escape, priority=100)
