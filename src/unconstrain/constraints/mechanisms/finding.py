"""Which mechanism recordings moved under: kinds compared by how well they predict points that were held out.

Each kind leaves to a point a line, a circle or a surface. Across it points scatter by the play, and along it they may
be anywhere within the extent of the movement, so that a kind with less freedom promises more, and pays more for points
that stray. Fitted to four fifths of each episode a kind is asked for the likelihood of the last fifth, in turn; the
simplest kind wins that is as likely as the best, to within what its likelihoods scatter by.

References
----------
Sturm, Stachniss, Burgard, "A probabilistic framework for learning kinematic models of articulated objects", Journal of
Artificial Intelligence Research 41, 2011.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain import waiting
from unconstrain.arrays import check_number, check_numbers
from unconstrain.constraints.filtering import split_episodes
from unconstrain.constraints.mechanisms import hand
from unconstrain.constraints.mechanisms.fitting import Fit, fit_shape
from unconstrain.constraints.mechanisms.mechanism import Candidate, Mechanism, Places
from unconstrain.constraints.mechanisms.shapes import Kind
from unconstrain.errors import DataError

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

PLAY = 0.01
"""How far a point strays from what holds it, as a share of the extent of the movement, unless its noise is more."""
MOST_NOISE = 0.03
"""Noise that is found counts up to this share of the extent: beyond it everything would lie on anything."""
POINTS, MOST_POINTS = 50, 600
"""Points of an episode, evenly along its path, and of all episodes."""
LEAST_POINTS = 12
MOST_EPISODES = 50
"""Of more episodes so many are used, evenly, and a mechanism at another place in each is not looked for."""
TOO_SHORT = (
    f"no episode has {LEAST_POINTS} points along its path, too few to tell a mechanism: give longer movements"
)
FOLDS = 5
ORDER: tuple[tuple[Kind, Places], ...] = (
    ("prismatic", "one"), ("plane", "one"), ("sphere", "one"), ("cylinder", "one"), ("hinge", "one"),
    ("prismatic", "each"), ("hinge", "each"),
)  # fmt: skip
"""From the simplest, by how many numbers say where it is. A mechanism at several places has one direction and one
radius, and is no surface: a single smooth movement lies near some arc, and nearly always on some surface."""


@waiting.stage("comparing mechanisms")
def find_mechanism(
    positions: ArrayLike,
    *,
    episodes: ArrayLike | None = None,
    rotations: ArrayLike | None = None,
    play: float | None = None,
) -> Mechanism:
    """Find which mechanism recordings moved under: a drawer, a hinge, a plane, a sphere, a cylinder, or none.

    Positions cannot tell what a person chose not to do from what could not be done: a circle drawn on purpose, as
    exactly as `play`, passes for a hinge.

    Parameters
    ----------
    positions : array_like of shape (N, d)
        Of the hand, in two or three dimensions, in the order of time. In two a plane is no constraint.
    episodes : array_like of shape (N,), optional
        Each may have the mechanism at a place of its own.
    rotations : array_like of shape (N, 3, 3), optional
        Of the hand, from its own frame to that of the positions: a hinge turns it.
    play : float, optional
        How far points stray from a mechanism, in the unit of the positions: a standard deviation, of the sensor's noise
        and of the hand within what it holds. By default 1 % of the extent of a movement, or the noise of the positions
        if that is more.

    Returns
    -------
    Mechanism
        What it is, where, how sure, and what else would nearly do.

    Raises
    ------
    DataError
        If the positions are of another shape or not finite, or hardly move.

    Examples
    --------
    >>> import numpy as np, unconstrain as uc
    >>> angle = np.linspace(0.0, 1.0, 100)[:, None]
    >>> door = np.hstack([0.8 * np.cos(angle), 0.8 * np.sin(angle), np.ones_like(angle)])
    >>> found = uc.constraints.find_mechanism(door)
    >>> found.kind, found.shapes[0].radius.__round__(3), found.shapes[0].direction.round(3)
    ('hinge', 0.8, array([0., 0., 1.]))
    """
    P, R = _check(positions, rotations)
    each = split_episodes(episodes, len(P))
    # In the middle of the points and in their size nothing over- or underflows, wherever they are and in any unit.
    middle = P.mean(axis=0)
    size = float(np.abs(P - middle).max(initial=0.0))
    if not 0.0 < size < np.inf:
        raise DataError("the positions do not move, or beyond all bounds: there is no mechanism to be told")
    P = (P - middle) / size
    extent, sensor = _measure(P, each)
    if play is None:
        play = max(PLAY * extent, min(sensor, MOST_NOISE * extent))
    else:
        play = check_number(play, "play", positive=True) / size
    thinned = _thin(P, each, sensor)
    if not thinned:
        raise DataError(TOO_SHORT)
    if len(thinned) > MOST_EPISODES:
        thinned = [thinned[i] for i in np.linspace(0, len(thinned) - 1, MOST_EPISODES).round().astype(int)]
    problem = _Problem(P, R, [own for own, _ in thinned], play, extent)
    compared: dict[tuple[str, Places], Array] = {("none", "one"): np.zeros((len(problem.each), FOLDS))}
    for kind, places in waiting.each(ORDER, "comparing mechanisms", unit="kinds"):
        curve = kind in ("prismatic", "hinge")
        if (P.shape[1] == 3 or curve) and (places == "one" or 1 < len(each) <= MOST_EPISODES):
            gain = problem.hold_out(kind, places)
            if gain is not None:
                compared[kind, places] = gain
    best = max(compared.values(), key=np.sum)
    candidates = []
    for (name, at), gain in compared.items():
        lag = best - gain
        scatter = float(np.sqrt(lag.size) * lag.std(ddof=1))
        likelihood, distance = float(gain.sum() / problem.size), problem.distance(name, at)
        candidates.append(Candidate(name, at, likelihood, float(lag.sum()), scatter, distance))
    chosen = _choose(candidates)
    candidates.sort(key=lambda c: c.behind)
    found = problem.describe(
        chosen.kind, chosen.places, tuple(candidates), [label for _, label in thinned], len(each)
    )
    return found.moved(middle, size)


def _choose(candidates: list[Candidate]) -> Candidate:
    """Choose the simplest that is as likely as the best; no mechanism is the simplest of all."""
    simplest = (("none", "one"), *ORDER)
    near = [c for c in candidates if c.nearly]
    return min(near, key=lambda c: simplest.index((c.kind, c.places)))


class _Problem:
    """Thinned points by episode and fold, and the kinds fitted to them."""

    def __init__(self, P: Array, R: Array | None, each: list[Rows], play: float, extent: float) -> None:
        most = max(LEAST_POINTS, MOST_POINTS // len(each))
        self.each = [
            own[np.linspace(0, len(own) - 1, most).round().astype(int)] if len(own) > most else own
            for own in each
        ]
        self.P, self.R, self.play, self.extent = P, R, play, extent
        self.size = sum(map(len, self.each))
        # Another fifth of each episode, so that other episodes show what is held out of one.
        self.fold = [
            (FOLDS * np.arange(len(own)) // len(own) + number) % FOLDS for number, own in enumerate(self.each)
        ]
        self.fits: dict[tuple[str, str], Fit] = {}
        self.parts: dict[tuple[str, str], list[Fit]] = {}

    def hold_out(self, kind: Kind, places: Places) -> Array | None:
        """Compute by how much points held out are likelier than in free movement, (E, F); None where nothing fits."""
        gain = np.zeros((len(self.each), FOLDS))
        whole = self._fit(kind, places, None)
        if whole is None:
            return None
        self.fits[kind, places] = whole
        self.parts[kind, places] = []
        for held in range(FOLDS):
            fit = self._fit(kind, places, held)
            if fit is not None:
                self.parts[kind, places].append(fit)
            for number, (own, fold) in enumerate(zip(self.each, self.fold, strict=True)):
                gain[number, held] = self._gain(fit, number if places == "each" else 0, own, fold == held)
        return gain

    def _fit(self, kind: Kind, places: Places, held: int | None) -> Fit | None:
        own = [
            self.P[own if held is None else own[fold != held]]
            for own, fold in zip(self.each, self.fold, strict=True)
        ]
        return fit_shape(kind, [np.concatenate(own)] if places == "one" else own, self.play, self.extent)

    def _gain(self, fit: Fit | None, place: int, own: Rows, test: NDArray[np.bool_]) -> float:
        P = self.P[own]
        free = np.full(len(own), -P.shape[1] * np.log(self.extent))
        density = free if fit is None else fit.log_density(P, place, self.play, self.extent)
        gain = (density - free)[test].sum()
        if self.R is not None:
            shape = None if fit is None else fit.shapes[place]
            gain += hand.log_density(shape, P, self.R[own], ~test)[test].sum()
            gain -= hand.log_density(None, P, self.R[own], ~test)[test].sum()
        return float(gain)

    def distance(self, kind: str, places: Places) -> float:
        """Compute the root mean square distance of all points; zero for free movement."""
        fit = self.fits.get((kind, places))
        if fit is None:
            return 0.0
        squares = [np.sum(fit.shapes[place].residuals(P) ** 2) for place, P in self._placed(places)]
        return float(np.sqrt(sum(squares) / self.size))

    def _distance_on(self, fit: Fit, places: Places) -> float:
        """Compute the root mean square distance of the points that lie on the shapes."""
        total = count = 0.0
        for place, P in self._placed(places):
            on = fit.on_shape(P, place, self.play, self.extent)
            total += float(on @ np.sum(fit.shapes[place].residuals(P) ** 2, axis=1))
            count += float(on.sum())
        return float(np.sqrt(total / count))

    def _placed(self, places: Places) -> list[tuple[int, Array]]:
        return [(number if places == "each" else 0, self.P[own]) for number, own in enumerate(self.each)]

    def describe(
        self, kind: str, places: Places, candidates: tuple[Candidate, ...], used: list[int], n_episodes: int
    ) -> Mechanism:
        """Gather what is known of the kind that was chosen."""
        fit = self.fits.get((kind, places))
        if fit is None:
            return Mechanism(
                "none",
                "one",
                (),
                candidates,
                self.extent,
                self.play,
                0.0,
                np.nan,
                (),
                (np.nan, np.nan),
                len(self.each),
            )
        turned, words = [], []
        for number, own in enumerate(self.each):
            P, shape = self.P[own], fit.shapes[number if places == "each" else 0]
            if kind == "hinge":
                turned.append(float(min(np.ptp(shape.angles(P)), 2.0 * np.pi)))
            if self.R is not None and kind in ("hinge", "prismatic"):
                words.append(hand.describe(shape, P, self.R[own]))
        shapes = fit.shapes
        if places == "each" and len(used) < n_episodes:
            # Episodes too short to tell have the place of the one before.
            at = np.clip(np.searchsorted(used, np.arange(n_episodes), side="right") - 1, 0, None)
            shapes = tuple(shapes[i] for i in at)
            turned = [turned[i] for i in at] if turned else turned
        on, uncertainty = self._distance_on(fit, places), _jackknife(self.parts[kind, places], fit)
        return Mechanism(
            kind, places, shapes, candidates, self.extent, self.play, 1.0 - fit.outside, on, tuple(turned), uncertainty,
            len(self.each), words[0] if words else "",
        )  # fmt: skip


def _jackknife(parts: list[Fit], whole: Fit) -> tuple[float, float]:
    """Compute standard errors of direction and place from fits that lack a fold each."""
    if len(parts) < 2:
        return np.nan, np.nan
    factor = (len(parts) - 1) / len(parts)
    axis = whole.shapes[0].direction
    cosines = [min(abs(float(part.shapes[0].direction @ axis)), 1.0) for part in parts]
    away = np.array(
        [[a.point - b.point for a, b in zip(part.shapes, whole.shapes, strict=True)] for part in parts]
    )
    if whole.shapes[0].kind == "cylinder":
        away = away - (away @ axis)[..., None] * axis
    squares = np.mean(np.sum(away**2, axis=2), axis=1)
    return float(np.sqrt(factor * np.sum(np.arccos(cosines) ** 2))), float(np.sqrt(factor * np.sum(squares)))


def _check(positions: ArrayLike, rotations: ArrayLike | None) -> tuple[Array, Array | None]:
    P = check_numbers(positions, "positions")
    if P.ndim != 2 or P.shape[1] not in (2, 3):
        raise DataError(
            f"positions must be (samples, 2) or (samples, 3) for a mechanism, got shape {P.shape}"
        )
    if not np.isfinite(P).all():
        raise DataError(
            f"positions have NaN or infinity in row {np.argwhere(~np.isfinite(P))[0][0]}: leave such samples out"
        )
    if rotations is None:
        return P, None
    R = check_numbers(rotations, "rotations")
    if R.shape != (len(P), 3, 3) or P.shape[1] != 3:
        raise DataError(
            f"rotations must be ({len(P)}, 3, 3) beside positions in three dimensions, got shape {R.shape}"
        )
    if not np.allclose(R @ R.swapaxes(1, 2), np.eye(3), atol=1e-3):
        raise DataError("rotations must be matrices that turn, with orthonormal rows")
    return P, R


def _measure(P: Array, each: list[Rows]) -> tuple[float, float]:
    """Measure how far a movement leads, the median over episodes, and the noise of the positions."""
    extents, jumps = [], []
    for own in (own for own in each if len(own) >= LEAST_POINTS):
        centred = P[own] - P[own].mean(axis=0)
        along = centred @ np.linalg.svd(centred, full_matrices=False)[2][0]
        extents.append(np.ptp(along))
        jumps.append(np.linalg.norm(np.diff(P[own], n=3, axis=0), axis=1))
    if not extents:
        raise DataError(TOO_SHORT)
    extent = float(np.median(extents))
    if not extent > 0:
        raise DataError("most episodes do not move: there is no mechanism to be told")
    third = np.concatenate(jumps)
    # Noise makes third differences of √20 times its size in each component; their norm has a median of √(d - 0.65).
    sensor = float(np.median(third)) / np.sqrt(20.0 * (P.shape[1] - 0.65)) if len(third) else 0.0
    return extent, sensor


def _thin(P: Array, each: list[Rows], sensor: float) -> list[tuple[Rows, int]]:
    """Choose points evenly along the path of each episode that leads somewhere, with the number of the episode."""
    chosen = []
    for number, own in enumerate(each):
        steps = np.linalg.norm(np.diff(P[own], axis=0), axis=1)
        # A step within the noise is rest, whose path would be endless.
        length = np.concatenate([[0.0], np.cumsum(np.maximum(steps - 3.0 * sensor, 0.0) + 1e-12 * steps)])
        if len(own) < LEAST_POINTS or not length[-1] > 0:
            continue
        at = np.unique(np.searchsorted(length, np.linspace(0.0, length[-1], POINTS)).clip(0, len(own) - 1))
        if len(at) >= LEAST_POINTS:
            chosen.append((own[at], number))
    return chosen
