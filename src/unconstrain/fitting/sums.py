"""What samples add to a fit: moments by fold, and counts."""

import math
from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import Any

from unconstrain.fitting.contact import Tally
from unconstrain.fitting.corrected import Part
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.region import Region
from unconstrain.fitting.wide.held import HeldSamples
from unconstrain.motion import NO_MOTION


@dataclass(frozen=True)
class Sums:
    """Moments by fold, and the counts that a fit reports. Sums add, in any order and grouping.

    Whether an action moves depends on the longest action of all. A sample left out stays out whatever is to come; a
    sample counted earlier may turn out to have no motion, and `misjudged` records that.

    Parameters
    ----------
    moments : tuple of Moments or None
        By fold; None where a fold has no samples. For "corrected" they are `CorrectedMoments`.
    n_samples : int
        Samples added, including those without motion.
    n_zero : int
        Samples that do not move.
    n_known : int
        Samples whose projection is known.
    longest : float
        Length of the longest action, in its unit.
    shortest : float
        Length of the shortest action that was counted as motion.
    judges : tuple of Moments or None
        By fold, of the risk that λ is chosen by where it is another than the one that is minimised.
    tallies : tuple of Tally
        What was found of contact and noise: one, or one for each of several beliefs that are compared.
    regions : tuple of Region or None
        By fold: where the samples lie, if that is kept.
    """

    moments: tuple[Part | None, ...] = ()
    n_samples: int = 0
    n_zero: int = 0
    n_known: int = 0
    longest: float = 0.0
    shortest: float = math.inf
    judges: tuple[Moments | HeldSamples | None, ...] = ()
    tallies: tuple[Tally, ...] = ()
    regions: tuple[Region | None, ...] = ()

    def __add__(self, other: "Sums") -> "Sums":
        return Sums(
            _add(self.moments, other.moments),
            self.n_samples + other.n_samples,
            self.n_zero + other.n_zero,
            self.n_known + other.n_known,
            max(self.longest, other.longest),
            min(self.shortest, other.shortest),
            _add(self.judges, other.judges),
            _add(self.tallies, other.tallies),
            _add(self.regions, other.regions),
        )

    def rotated(self, by: int, n_folds: int) -> "Sums":
        """Rename fold k to fold (k + by) mod n_folds.

        Parameters
        ----------
        by : int
            By how many.
        n_folds : int
            Number of folds.

        Returns
        -------
        Sums
            Of the same samples.
        """

        def rename(parts: tuple[Any, ...]) -> tuple[Any, ...]:
            renamed: list[Any] = [None] * n_folds
            for fold, part in enumerate(parts):
                renamed[(fold + by) % n_folds] = part
            return tuple(renamed) if parts else ()

        return replace(
            self,
            moments=rename(self.moments),
            judges=rename(self.judges),
            regions=rename(self.regions),
        )

    @property
    def present(self) -> list[Part]:
        """The moments of the folds that have samples."""
        return [part for part in self.moments if part is not None]

    @property
    def n_counted(self) -> int:
        """How many samples the moments hold."""
        return sum(part.n_samples for part in self.present)

    @property
    def misjudged(self) -> bool:
        """Whether a sample was counted as motion that has none beside the longest action."""
        return self.shortest <= NO_MOTION * self.longest


def _add(mine: tuple[Any, ...], others: tuple[Any, ...]) -> tuple[Any, ...]:
    """Add two tuples by their places; None is nothing."""
    return tuple(a if b is None else b if a is None else a + b for a, b in zip_longest(mine, others))
