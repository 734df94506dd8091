"""One look at all samples before networks are made: how large states and actions are, and what is held out."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.arrays import check_lets_through
from unconstrain.errors import DataError
from unconstrain.fitting.accumulator import NO_DIRECTION
from unconstrain.fitting.observation import unknown
from unconstrain.fitting.plausible import check_scale
from unconstrain.fitting.region import Region, find_unit
from unconstrain.fitting.solve import EpisodeFolds
from unconstrain.motion import NO_MOTION, lengths
from unconstrain.samples import Samples

Floats = NDArray[np.float64]

HELD_OUT_ROWS = 50_000
"""Samples of a fold that are held out, at most; further ones of it are not used."""


@dataclass(frozen=True)
class Survey:
    """What there is to learn from.

    Parameters
    ----------
    center, spread : ndarray of shape (m,)
        Mean and standard deviation of the states as a space lays them out.
    scale : float
        Mean squared length of the actions, in units of the action scale.
    n_samples, n_zero, n_known : int
        How many samples, how many of them do not move, and of how many the projection is known.
    regions : tuple of Region or None
        By fold: where the states lie.
    """

    center: Floats
    spread: Floats
    scale: float
    n_samples: int
    n_zero: int
    n_known: int
    regions: tuple[Region | None, ...]


@dataclass
class Data:
    """Samples that can be read again and again, dealt out to folds.

    Parameters
    ----------
    read : callable
        Returns the samples in blocks, in units of the scale, always the same.
    in_memory : bool
        Whether that is one block that is there anyway.
    folds : EpisodeFolds
        Where episodes are dealt out to.
    by_rows : bool
        Whether blocks of rows are dealt out instead, as they are where there is one episode.
    """

    read: Callable[[], Iterable[Samples]]
    in_memory: bool
    folds: EpisodeFolds = field(default_factory=EpisodeFolds)
    by_rows: bool = False

    def blocks(self) -> Iterator[tuple[Samples, NDArray[np.int_]]]:
        """Read the samples.

        Yields
        ------
        samples : Samples
            A block of them, those of weight zero left out.
        fold : ndarray of shape (N,), int
            The fold of each.
        """
        for samples in self.read():
            if samples.weights is not None and not samples.weights.all():
                samples = samples.select(np.flatnonzero(samples.weights))
            if len(samples.states):
                yield samples, self._deal(samples)

    def look(self, lay_out: Callable[[Floats], Floats]) -> Survey:
        """Read all samples once.

        Parameters
        ----------
        lay_out : callable
            Lays states out as networks see them.

        Returns
        -------
        Survey
            Of them.

        Raises
        ------
        DataError
            Nothing moves, or a known projection does not let its sample's own action through.
        """
        weight, squares, longest = 0.0, 0.0, 0.0
        n_samples = n_known = 0
        shift: Any = None
        unit: Any = None
        first: Any = 0.0
        second: Any = 0.0
        rs: list[Floats] = []
        regions: dict[int, Region] = {}
        for samples, fold in self.blocks():
            Z = np.asarray(lay_out(samples.states), dtype=np.float64)
            r = lengths(samples.actions)
            omega = np.ones(len(Z)) if samples.weights is None else samples.weights
            if shift is None:
                shift, unit = Z.mean(axis=0), find_unit(Z, None)
            away = Z - shift
            weight += omega.sum()
            first, second = first + omega @ away, second + omega @ away**2
            longest = max(longest, float(r.max()))
            with np.errstate(over="ignore", under="ignore"):
                squares += float(omega @ r**2)
            n_samples += len(Z)
            rs.append(r.astype(np.float32))
            if samples.projections is not None:
                check_lets_through(samples.projections, samples.actions)
                n_known += int(np.sum(~unknown(samples.projections)))
            for k in np.unique(fold).tolist():
                found = Region.of(Z[fold == k], unit, regions[k].coarseness if k in regions else 0)
                regions[k] = regions[k] + found if k in regions else found
        if shift is None or longest == 0.0:
            raise DataError(NO_DIRECTION)
        check_scale(squares / weight, "networks'")
        mean = first / weight
        spread = np.sqrt(np.maximum(second / weight - mean**2, 0.0))
        floor = 1e-9 * max(float(np.abs(shift).max()), float(spread.max()), 1e-300)
        n_zero = sum(int(np.count_nonzero(r <= NO_MOTION * longest)) for r in rs)
        return Survey(
            shift + mean,
            np.where(spread > floor, spread, 1.0),
            squares / weight,
            n_samples,
            n_zero,
            n_known,
            tuple(regions.get(k) for k in range(self.folds.n_folds)),
        )

    def without(self, fold: int) -> Iterator[Samples]:
        """Read the samples that are not held out.

        Parameters
        ----------
        fold : int
            That is held out.

        Yields
        ------
        Samples
            Block by block.
        """
        for samples, of in self.blocks():
            yield samples if not (of == fold).any() else samples.select(np.flatnonzero(of != fold))

    def held_out(self, fold: int) -> Samples:
        """Read the samples that are held out.

        Parameters
        ----------
        fold : int
            Which.

        Returns
        -------
        Samples
            At most some `HELD_OUT_ROWS` of it, from the beginning.
        """
        parts, count = [], 0
        for samples, of in self.blocks():
            rows = np.flatnonzero(of == fold)
            if len(rows):
                parts.append(samples.select(rows))
                count += len(rows)
            if count >= HELD_OUT_ROWS:
                break
        return _join(parts)

    def present(self) -> list[int]:
        """List the folds that have samples, of which there are two at least.

        Returns
        -------
        list of int
            In order.
        """
        found: set[int] = set()
        for _, of in self.blocks():
            found |= set(np.unique(of).tolist())
            if len(found) == self.folds.n_folds:
                break
        if len(found) < 2 and not self.by_rows:
            self.by_rows = True
            return self.present()
        return sorted(found)

    def _deal(self, samples: Samples) -> Any:
        groups = None if self.by_rows else samples.groups
        return self.folds.assign(groups, len(samples.states))


def _join(parts: list[Samples]) -> Samples:
    if len(parts) == 1:
        return parts[0]
    columns = zip(*parts, strict=True)
    joined = [None if column[0] is None else np.concatenate(column) for column in columns]
    return Samples(*joined)  # type: ignore[arg-type]
