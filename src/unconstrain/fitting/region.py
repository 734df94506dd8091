"""Where states were recorded, in few numbers that add up.

A state is recorded if it lies in one of the boxes of a grid in which samples were. Boxes add in any order: those of a
stream, of several machines, or of samples that come later, are those of all samples together. Where there are many they
are made coarser, eight boxes into one in three dimensions, until they are few.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain import loops
from unconstrain.features.scaling import Scaling

Array = NDArray[np.float64]

OF_SPREAD = 0.5
"""What distances are counted in where there are no receptive fields, as a share of the states' spread."""

FINEST = 0.25
"""Edge of the smallest boxes, in units of the region."""

MOST_BOXES = 512
"""Beyond so many, boxes become coarser."""

SEVERAL = 8
"""How many times as many boxes are told apart before they become coarser."""

PROBED = 4096
"""States that are looked at first: where they alone lie in too many boxes, so do all, and none are sorted for those."""

LARGEST = 2.0**62
"""Number of a box beyond which there is no telling it from the next."""

DISTANCES_IN_BLOCK = 2_000_000
"""How many numbers are computed at a time."""


@dataclass(frozen=True)
class Region:
    """Boxes of a grid in which samples were.

    Parameters
    ----------
    unit : ndarray of shape (m,)
        Along each dimension of the states as features see them: what distances are counted in.
    boxes : ndarray of shape (M, m)
        Whole numbers, in order, of a type no larger than they need: files hold them.
    coarseness : int
        How often two boxes along each dimension became one. So the edge is `FINEST 2^coarseness` units.
    """

    unit: Array
    boxes: NDArray[Any]
    coarseness: int = 0

    @classmethod
    def of(cls, Z: Array, unit: Array, coarseness: int = 0) -> "Region":
        """Find the boxes that states lie in.

        Parameters
        ----------
        Z : ndarray of shape (N, m)
            States as features see them.
        unit : ndarray of shape (m,)
            Above zero.
        coarseness : int
            Of boxes that they are to be added to.

        Returns
        -------
        Region
            Of these states.
        """
        if len(Z) >= 2 * PROBED:
            coarseness = cls.of(Z[:: len(Z) // PROBED], unit, coarseness).coarseness
        compiled = loops.load_for(len(Z), "grid")
        if compiled is not None:
            rows = np.empty(SEVERAL * MOST_BOXES, dtype=np.int64)
            found = compiled.first_rows(
                Z, FINEST * unit, _shift(0, coarseness), 2.0**-coarseness, LARGEST, rows
            )
            Z = Z if found < 0 else Z[rows[:found]]
        with np.errstate(over="ignore"):
            boxes = np.clip(np.floor(Z / (FINEST * unit)), -LARGEST, LARGEST)
        return cls(unit, *_as_few(_coarser(boxes, 0, coarseness), coarseness))

    def __add__(self, other: "Region") -> "Region":
        coarseness = max(self.coarseness, other.coarseness)
        boxes = [_coarser(each.boxes, each.coarseness, coarseness) for each in (self, other)]
        if len(boxes[0]) == len(boxes[1]) and (boxes[0] == boxes[1]).all():
            return self if self.coarseness == coarseness else other
        return Region(self.unit, *_as_few(np.concatenate(boxes), coarseness))

    def distance(self, Z: Array) -> Array:
        """Compute how far states lie from the nearest box.

        Parameters
        ----------
        Z : ndarray of shape (N, m)
            States as features see them.

        Returns
        -------
        ndarray of shape (N,)
            In units; zero for every state that was recorded.
        """
        half, middles = self._edge / 2, self._middles
        away = np.empty(len(Z))
        rows = max(1, DISTANCES_IN_BLOCK // middles.size)
        with np.errstate(over="ignore"):
            for start in range(0, len(Z), rows):
                gap = np.abs(Z[start : start + rows, None] / self.unit - middles) - half
                away[start : start + rows] = np.sqrt(
                    np.min(np.sum(np.maximum(gap, 0.0) ** 2, axis=2), axis=1)
                )
        return away

    @property
    def extent(self) -> float:
        """Diagonal of what holds all boxes, in units."""
        return float(np.linalg.norm(np.ptp(self._middles, axis=0) + self._edge))

    @property
    def middles(self) -> Array:
        """The middles of the boxes, (M, m), as features see states."""
        return self._middles * self.unit

    @property
    def _edge(self) -> float:
        return FINEST * 2.0**self.coarseness

    @property
    def _middles(self) -> Array:
        """The middles of the boxes in units."""
        return (self.boxes + 0.5) * self._edge - _shift(0, self.coarseness) * FINEST


def find_unit(Z: Array, width: float | Array | None) -> Array:
    """Find in what distances from recorded states are counted.

    Parameters
    ----------
    Z : ndarray of shape (N, m)
        States as features see them.
    width : float, ndarray of shape (m,) or None
        Of the receptive fields.

    Returns
    -------
    ndarray of shape (m,)
        The width; without one half of how far the states usually lie from their mean, shared out by their spread.
    """
    if width is not None:
        return np.array(np.broadcast_to(width, Z.shape[1]), dtype=np.float64)
    return OF_SPREAD * np.sqrt(Z.shape[1]) * Scaling.of(Z).spread


def unite(regions: Sequence[Region | None]) -> Region:
    """Add regions up.

    Parameters
    ----------
    regions : sequence of Region or None
        Some of them.

    Returns
    -------
    Region
        All boxes, at most as many as one may have.
    """
    present = [each for each in regions if each is not None]
    return sum(present[1:], present[0])


def find_apart(regions: Sequence[Region | None]) -> float:
    """Find how far recordings lead from each other.

    Parameters
    ----------
    regions : sequence of Region or None
        By fold.

    Returns
    -------
    float
        Half of the folds lead farther than this from all others, in units; zero where there is one.
    """
    present = [each for each in regions if each is not None]
    if len(present) < 2:
        return 0.0
    others = [unite(present[:k] + present[k + 1 :]) for k in range(len(present))]
    return float(
        np.median([other.distance(own.middles).max() for own, other in zip(present, others, strict=True)])
    )


def _shift(coarseness: int, wanted: int) -> float:
    """Return by how many boxes of a coarseness those of another begin earlier, so that zero is no wall."""
    earlier = (2.0 ** (level - coarseness) for level in range(coarseness, wanted) if level % 2 == 0)
    return sum(earlier, 0.0)


def _coarser(boxes: NDArray[Any], coarseness: int, wanted: int) -> Array:
    boxes = boxes.astype(np.float64, copy=False)
    if wanted == coarseness:
        return boxes
    # Halving and rounding down level by level is one division, rounded down once.
    return np.floor((boxes + _shift(coarseness, wanted)) * 2.0 ** (coarseness - wanted))


def _as_few(boxes: Array, coarseness: int) -> tuple[NDArray[Any], int]:
    """Make boxes distinct, in order, and coarser until they are few."""
    boxes = _distinct(boxes)
    while len(boxes) > MOST_BOXES:
        boxes, coarseness = _distinct(_coarser(boxes, coarseness, coarseness + 1)), coarseness + 1
    boxes = boxes[np.lexsort(boxes.T)]
    largest = float(np.abs(boxes).max(initial=0.0))
    kinds: tuple[type, ...] = (np.int8, np.int16, np.int32)
    kind = next((each for each in kinds if largest < np.iinfo(each).max), np.float64)
    return boxes.astype(kind), coarseness


def _distinct(boxes: Array) -> Array:
    """Leave out rows that are there already."""
    boxes = boxes[np.append(True, (boxes[1:] != boxes[:-1]).any(axis=1))] if len(boxes) else boxes
    # Rows as single numbers, which sort much faster; no two of so few in 2^64 are the same by chance.
    factors = np.random.default_rng(0).integers(1, 2**63, size=boxes.shape[1], dtype=np.uint64)
    with np.errstate(over="ignore"):
        numbers = (boxes.astype(np.int64).astype(np.uint64) * (2 * factors + np.uint64(1))).sum(axis=1)
    return boxes[np.unique(numbers, return_index=True)[1]]
