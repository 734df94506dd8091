"""How Sphinx builds the site: `make docs`, offline, with warnings as errors."""

import os
import shutil
import sys
from pathlib import Path
from types import ModuleType

HERE = Path(__file__).parent
ROOT = HERE.parent
sys.path.insert(0, str(HERE / "_ext"))

import unconstrain  # noqa: E402
from unconstrain.version import __version__  # noqa: E402

# `uc.moments` lives elsewhere than it is named; the reference names things as people write them.
for _name in unconstrain.__all__:
    if isinstance(getattr(unconstrain, _name, None), ModuleType):
        sys.modules.setdefault(f"unconstrain.{_name}", getattr(unconstrain, _name))

project = "unconstrain"
copyright = "the authors of unconstrain"
release = version = __version__
repository = "https://github.com/unconstrain/unconstrain"

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
    "public_names",
    "source_links",
]
root_doc = "index"
exclude_patterns = ["_ext", "_templates"]
templates_path = ["_templates"]
language = "en"
suppress_warnings = ["config.cache"]  # sphinx-gallery's settings hold objects

myst_heading_anchors = 4
myst_enable_extensions = ["deflist"]

toc_object_entries_show_parents = "hide"
default_role = "py:obj"
add_module_names = False
autosummary_generate = True
autosummary_ignore_module_all = False
autodoc_typehints = "none"  # numpydoc's sections say types in words
autodoc_member_order = "groupwise"
numpydoc_show_class_members = False
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

# Examples write files beside themselves, which must not be in the checkout.
examples = ROOT / "out" / "examples"
shutil.copytree(ROOT / "examples", examples, dirs_exist_ok=True)
os.environ.setdefault("MUJOCO_GL", "egl")
sphinx_gallery_conf = {
    "examples_dirs": str(examples),
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "ignore_pattern": r"(__init__|ros2_node)\.py$",
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "plot_gallery": os.environ.get("GALLERY", "run") == "run",
    "capture_repr": (),
    "remove_config_comments": True,
    "download_all_examples": False,
    "write_computation_times": False,
    "show_memory": False,
    "log_level": {"backreference_missing": "info"},
}

html_theme = "pydata_sphinx_theme"
html_title = "unconstrain"
html_favicon = "_static/icon.svg"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_context = {"default_mode": "auto"}
html_theme_options = {
    "logo": {"text": "unconstrain"},
    "github_url": repository,
    "header_links_before_dropdown": 6,
    "navbar_align": "left",
    "show_prev_next": False,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}
html_sidebars = {"index": [], "gallery/*": [], "changelog": []}
