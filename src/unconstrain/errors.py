"""The family of mistakes a user can make.

Every one is raised with a single sentence that names the file, column or row and says what to do. The
command line prints that sentence and exits with 2; in Python they are all `ValueError`s, as scikit-learn
expects of bad input.
"""


class UnconstrainError(ValueError):
    """A mistake in what the user gave, told in one sentence. Base of the family."""


class DataError(UnconstrainError):
    """A recording, or an array standing for one, that cannot be used: missing, NaN, of the wrong shape."""


class PolicyError(UnconstrainError):
    """A policy asked for what it cannot do: an unknown option, or states of the wrong dimension."""


class ArchiveError(DataError):
    """A saved file that is missing, damaged, of another kind, not of unconstrain, or from a newer release."""


class RobotError(UnconstrainError):
    """A robot file that cannot be used, or a joint or frame that is not in it."""
