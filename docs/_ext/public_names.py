"""The reference describes what is ours: members that scikit-learn's base classes bring along are its own matter."""

from typing import Any

from sphinx.application import Sphinx


def skip(app: Sphinx, what: str, name: str, thing: object, skipped: bool, options: Any) -> bool | None:
    """Leave out members that are defined outside of this package."""
    home = getattr(getattr(thing, "fget", thing), "__module__", None)
    if what == "class" and isinstance(home, str) and not home.startswith("unconstrain"):
        return True
    return None


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("autodoc-skip-member", skip)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
