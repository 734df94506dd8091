"""What is asked of a policy that was saved without it."""

from unconstrain.errors import PolicyError


class MissingSumsError(PolicyError, AttributeError):
    """The sums a policy was solved from; also an `AttributeError`, so that `hasattr`, `dir` and notebooks can ask."""
