"""A mechanism that was found: its kind, where it is, how sure that is, and what else would nearly do."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import check_numbers
from unconstrain.constraints.filtering import split_episodes
from unconstrain.constraints.mechanisms.shapes import Shape
from unconstrain.constraints.nullspace import projection
from unconstrain.errors import DataError

Array = NDArray[np.float64]
Places = Literal["one", "each"]

LEAST_GAIN = 5.0
"""A less simple mechanism, or several places, have to be better by this logarithm of the odds, 150 to 1."""

SINGLE = "  found in a single movement, and one made freely lies near some line, arc or surface as well: record several"
LEAST_SURE = 0.5
"""A hinge whose place is less sure than this share of its radius has an axis of which only the direction is told."""


@dataclass(frozen=True)
class Candidate:
    """A kind of mechanism, and how well it explains.

    Parameters
    ----------
    kind : str
        "prismatic", "hinge", "plane", "sphere", "cylinder", or "none".
    places : {"one", "each"}
        One place for all episodes, or another in each, with one direction and one radius.
    likelihood : float
        Mean logarithm of the likelihood of a point that was held out, more than that of free movement.
    behind : float
        How much less than the best, summed over the points.
    scatter : float
        Standard error of that.
    distance : float
        Root mean square distance of the points, in the unit of the positions.
    """

    kind: str
    places: Places
    likelihood: float
    behind: float
    scatter: float
    distance: float

    @property
    def nearly(self) -> bool:
        """Whether it explains as well as the best, as far as can be told."""
        return self.behind <= max(self.scatter, LEAST_GAIN)


@dataclass(frozen=True)
class Mechanism:
    """What held the hand, as far as positions tell.

    Parameters
    ----------
    kind : str
        "prismatic", "hinge", "plane", "sphere", "cylinder", or "none".
    places : {"one", "each"}
        Whether it is at one place in all episodes, or at another in each.
    shapes : tuple of Shape
        Where: one, or one for each episode. Empty for "none".
    candidates : tuple of Candidate
        All that were tried, the best first.
    extent, play : float
        Of a movement, and how far points may stray, in the unit of the positions.
    share, distance : float
        Of the points, those that lie on it, and their root mean square distance from it.
    turned : tuple of float
        By how much a hinge turned in each episode, in radians; empty for others.
    uncertainty : tuple of float
        Standard error of the direction in radians, and of the place in the unit of the positions, by leaving out
        points.
    n_movements : int
        Episodes it was found in.
    hand : str
        How the hand turned, where rotations were given.
    """

    kind: str
    places: Places
    shapes: tuple[Shape, ...]
    candidates: tuple[Candidate, ...]
    extent: float
    play: float
    share: float
    distance: float
    turned: tuple[float, ...]
    uncertainty: tuple[float, float]
    n_movements: int
    hand: str = ""

    def moved(self, middle: Array, size: float) -> "Mechanism":
        """Return the same mechanism in another unit and elsewhere.

        Parameters
        ----------
        middle : ndarray of shape (d,)
            Where the origin comes to lie.
        size : float
            What a length of one becomes.

        Returns
        -------
        Mechanism
            All else is the same.
        """
        return replace(
            self,
            shapes=tuple(
                replace(shape, point=size * shape.point + middle, radius=size * shape.radius)
                for shape in self.shapes
            ),
            candidates=tuple(replace(each, distance=size * each.distance) for each in self.candidates),
            extent=size * self.extent,
            play=size * self.play,
            distance=size * self.distance,
            uncertainty=(self.uncertainty[0], size * self.uncertainty[1]),
        )

    def rows(self, positions: ArrayLike, episodes: ArrayLike | None = None) -> Array:
        """Compute constraint rows A with ``A v = 0`` for the velocities v that the mechanism lets through.

        Parameters
        ----------
        positions : array_like of shape (N, d)
            Of the hand.
        episodes : array_like of shape (N,), optional
            Needed where the mechanism is at another place in each; in the order in which they were given.

        Returns
        -------
        ndarray of shape (N, k, d)
            For `rollout` and `projection`. k is 0 without a mechanism.

        Raises
        ------
        DataError
            If shapes do not match, or an episode is not one of those recorded.
        """
        P = check_numbers(positions, "positions")
        if not self.shapes:
            return np.zeros((len(P), 0, P.shape[-1]))
        d = len(self.shapes[0].point)
        if P.ndim != 2 or P.shape[1] != d:
            raise DataError(f"positions must be (samples, {d}), got shape {P.shape}")
        if len(self.shapes) == 1:
            return self.shapes[0].rows(P)
        each = split_episodes(episodes, len(P))
        if len(each) != len(self.shapes):
            raise DataError(
                f"the mechanism is at another place in each of {len(self.shapes)} episodes, and these are {len(each)}: "
                "give the episodes it was found in"
            )
        A = np.empty((len(P), d - 1, d))
        for shape, own in zip(self.shapes, each, strict=True):
            A[own] = shape.rows(P[own])
        return A

    def projections(self, positions: ArrayLike, episodes: ArrayLike | None = None) -> Array:
        """Compute nullspace projections, to be given to ``policy.fit(..., projections=)``.

        Parameters
        ----------
        positions : array_like of shape (N, d)
            Of the hand.
        episodes : array_like of shape (N,), optional
            As for `rows`.

        Returns
        -------
        ndarray of shape (N, d, d)
            The identity without a mechanism.

        Raises
        ------
        DataError
            As for `rows`.
        """
        return projection(self.rows(positions, episodes))

    def describe(self, names: Sequence[str], labels: Sequence[str] = ()) -> str:
        """Say which mechanism it is, where, how sure that is, and what else would nearly do.

        Parameters
        ----------
        names : sequence of str
            Names of the d positions.
        labels : sequence of str, optional
            Names of the episodes.

        Returns
        -------
        str
            Several lines.
        """
        if self.kind == "none":
            line = "mechanism: none"
            nearest = next((c for c in self.candidates if c.kind != "none"), None)
            if nearest is not None:
                line += (
                    f" (the nearest, {_words(nearest.kind, nearest.places)}, is missed by "
                    f"{nearest.distance:.2g}, {nearest.distance / self.extent:.1%} of the movement, root mean square)"
                )
            return "\n".join([line, *self._others()])
        several = len(self.shapes) > 1
        where = ", one for each episode, of one direction" if several else ""
        lines = [
            f"mechanism: {_words(self.kind, self.places)}{where}; {self.share:.0%} of the path lies on it, to within "
            f"{self.distance:.2g}, {self.distance / self.extent:.1%} of the movement"
        ]
        for number, shape in enumerate(self.shapes):
            label = f"episode {labels[number] if len(labels) else number + 1}: " if several else ""
            lines.append(f"  {label}{shape.describe(names)}{self._turned_words(number if several else None)}")
        lines.append(self._sure_words())
        if self.n_movements == 1:
            lines.append(SINGLE)
        if self.hand:
            lines.append(f"  {self.hand}")
        return "\n".join([*lines, *self._others()])

    def _sure_words(self) -> str:
        direction, place = self.uncertainty
        parts = [f"of the direction {np.degrees(direction):.2g}°"] if self.shapes[0].direction.any() else []
        parts += [f"of the place {place:.2g}"] if self.kind not in ("prismatic", "plane") else []
        said = f"  how sure: standard error {', '.join(parts)}"
        if self.kind == "hinge" and place > LEAST_SURE * self.shapes[0].radius:
            said += ": the arc is too short to tell where the axis is"
        return said

    def _turned_words(self, number: int | None) -> str:
        if not self.turned:
            return ""
        angles = np.degrees(self.turned if number is None else self.turned[number : number + 1])
        if angles.min() >= 359.0:
            return ", turned all around"
        least, most = f"{angles.min():.0f}°", f"{angles.max():.0f}°"
        return f", turned by {least}" if least == most else f", turned by {least} to {most}"

    def _others(self) -> list[str]:
        others = [c for c in self.candidates if c.kind != "none"]
        near = [
            _words(c.kind, c.places)
            for c in others
            if c.nearly and (c.kind, c.places) != (self.kind, self.places)
        ]
        lines = []
        if self.kind != "none":
            lines.append(
                "  no other is as likely"
                if not near
                else f"  as likely, though less simple: {', '.join(near)}"
            )
        if others:
            table = ", ".join(f"{_words(c.kind, c.places)} {c.likelihood:+.2f}" for c in others)
            lines.append(f"  log-likelihood of a point held out, more than of free movement: {table}")
        return lines


def _words(kind: str, places: Places) -> str:
    word = "prismatic (a drawer)" if kind == "prismatic" else kind
    return f"{word} at several places" if places == "each" else word
