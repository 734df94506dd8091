"""The reference describes what is ours: members that scikit-learn's base classes bring along are its own matter."""

from typing import Any

from sphinx.application import Sphinx

INNER = {
    "check_options", "finish", "held_for", "learn", "observe", "place", "prepare_covariance", "resume", "scaled",
    "solved", "start",
}  # fmt: skip
"""What streams, clusters and selection ask of a policy, and people do not."""


def skip(app: Sphinx, what: str, name: str, thing: object, skipped: bool, options: Any) -> bool | None:
    """Leave out members that are defined outside of this package, and those that only its own parts call."""
    home = getattr(getattr(thing, "fget", thing), "__module__", None)
    if what == "class" and isinstance(home, str) and not home.startswith("unconstrain"):
        return True
    if what == "class" and name in INNER and str(home).startswith("unconstrain.policies"):
        return True
    return None


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("autodoc-skip-member", skip)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
