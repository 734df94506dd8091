"""What a batch of samples adds to a fit, apart from everything else: so that batches can be added up anywhere."""

import math
from dataclasses import dataclass, replace
from itertools import zip_longest

from unconstrain.fitting.moments import Moments
from unconstrain.motion import NO_MOTION


@dataclass(frozen=True)
class Tally:
    """Moments by fold, and the counts a fit reports. Tallies add, in any order and grouping.

    moments: by fold, None where a fold has no samples.
    n_samples: samples looked at; n_zero: those of them that do not move; n_known: those whose constraint is known.
    longest: length of the longest action; shortest: of the shortest one that was taken for motion, in the action's
        unit. Whether an action moves depends on the longest of all: one left out stays out whatever is to come, one
        taken in may turn out to be rounding.
    """

    moments: tuple[Moments | None, ...] = ()
    n_samples: int = 0
    n_zero: int = 0
    longest: float = 0.0
    shortest: float = math.inf
    n_known: int = 0

    def __add__(self, other: "Tally") -> "Tally":
        return Tally(
            tuple(
                a if b is None else b if a is None else a + b
                for a, b in zip_longest(self.moments, other.moments)
            ),
            self.n_samples + other.n_samples,
            self.n_zero + other.n_zero,
            max(self.longest, other.longest),
            min(self.shortest, other.shortest),
            self.n_known + other.n_known,
        )

    def dealt_from(self, first: int, n_folds: int) -> "Tally":
        """The same, had its episodes been dealt out to folds beginning with fold `first` instead of 0."""
        moments: list[Moments | None] = [None] * n_folds
        for fold, part in enumerate(self.moments):
            moments[(fold + first) % n_folds] = part
        return replace(self, moments=tuple(moments))

    @property
    def n_counted(self) -> int:
        """How many samples are in the moments."""
        return sum(part.n_samples for part in self.moments if part is not None)

    @property
    def misjudged(self) -> bool:
        """Whether a sample was taken for motion that, beside the longest action, is none."""
        return self.shortest <= NO_MOTION * self.longest
