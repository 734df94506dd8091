"""What a force sensor feels without a contact: its bias, and the weight of what it carries.

A sensor at a wrist measures in its own frame ``F = Rᵀ (f + w) + b``: the contact force f and the weight w of what it
carries, turned into its frame by the rotation R of the hand, and a bias b, which is what it felt when it was zeroed.
Where the hand is free, f = 0, and w and b are linear regression: whatever turns with the hand is weight, what stays is
bias. A sensor that was zeroed as it hung shows no force there and some as soon as it tilts, which tilts the normal.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import check_numbers
from unconstrain.constraints.contacts import check_forces, detect_contact
from unconstrain.constraints.filtering import split_episodes
from unconstrain.constraints.stuck import detect_stuck
from unconstrain.errors import DataError

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

WINDOW = 5
LEAST_FREE = 20
"""Free samples below which an episode's bias is not read off."""
ROUNDS, TURNS = 6, 20
MOST_COMPARED = 300
"""Forces of an episode, evenly in time, of which the most frequent is chosen."""
HUBER = 1.345
"""Residuals beyond so many standard deviations count less: a hand that is led is touched now and then."""


@dataclass(frozen=True)
class Payload:
    """The weight that a sensor carries, and its bias in each episode.

    Parameters
    ----------
    weight : float
        In the unit of the forces. Below zero where more was taken out beforehand than there is.
    vertical : ndarray of shape (3,)
        Unit vector that points up.
    biases : ndarray of shape (E, 3)
        In the frame of the sensor; all NaN where an episode had no free samples.
    free : ndarray of shape (N,), bool
        The samples that were taken for free.
    noise : float
        Standard deviation of free forces about weight and bias.
    """

    weight: float
    vertical: Array
    biases: Array
    free: NDArray[np.bool_]
    noise: float

    def remove(self, forces: ArrayLike, rotations: ArrayLike, *, episodes: ArrayLike | None = None) -> Array:
        """Compute contact forces in the frame of the world.

        Parameters
        ----------
        forces : array_like of shape (N, 3)
            As measured, in the frame of the sensor.
        rotations : array_like of shape (N, 3, 3)
            From the frame of the sensor to that of the world.
        episodes : array_like of shape (N,), optional
            As they were given to `find_payload`.

        Returns
        -------
        ndarray of shape (N, 3)
            What presses on the hand; all NaN in episodes whose bias is not known.

        Raises
        ------
        DataError
            If shapes do not match.
        """
        F, R = _check(forces, rotations)
        each = split_episodes(episodes, len(F))
        if len(each) != len(self.biases):
            raise DataError(f"the payload is of {len(self.biases)} episodes, and these are {len(each)}")
        f = np.empty_like(F)
        for bias, own in zip(self.biases, each, strict=True):
            f[own] = np.einsum("nij,nj->ni", R[own], F[own] - bias) + self.weight * self.vertical
        return f


def find_payload(
    forces: ArrayLike,
    rotations: ArrayLike,
    threshold: float,
    *,
    episodes: ArrayLike | None = None,
    vertical: ArrayLike = (0.0, 0.0, 1.0),
    margin: int = 0,
) -> Payload:
    """Find the weight that a force sensor carries, the same in all episodes, and its bias in each.

    Which samples are free is told by the forces that are left, in turn with weight and biases.

    Parameters
    ----------
    forces : array_like of shape (N, 3)
        As measured, in the frame of the sensor, in the order of time.
    rotations : array_like of shape (N, 3, 3)
        From the frame of the sensor to that of the world.
    threshold : float
        A force that exceeds this is a contact, as for `contact`.
    episodes : array_like of shape (N,), optional
        Between episodes the sensor may have been zeroed anew.
    vertical : array_like of shape (3,)
        Up, in the frame of the world.
    margin : int
        Samples beside a contact that are not taken for free either.

    Returns
    -------
    Payload
        With a `remove` for the forces.

    Raises
    ------
    DataError
        If shapes do not match, or no sample is free.
    """
    F, R = _check(forces, rotations)
    up = check_numbers(vertical, "vertical")
    if up.shape != (3,) or not np.linalg.norm(up) > 0:
        raise DataError(f"vertical must be three numbers that point up, got shape {up.shape}")
    up = up / np.linalg.norm(up)
    each = split_episodes(episodes, len(F))
    usable = ~detect_stuck(F, each)
    hanging = -np.einsum("nji,j->ni", R, up)
    left = F
    if not (usable & _free(F, threshold, margin, each)).any():
        # It was not zeroed: what it feels most often stands for what it feels when it is free.
        left = F.copy()
        for own in each:
            left[own] -= _most_frequent(F[own], threshold / 2)
    for _ in range(ROUNDS):
        free = usable & _free(left, threshold, margin, each)
        known = [free[own].sum() >= LEAST_FREE for own in each]
        if not any(known):
            raise DataError(
                "no episode is free of contact for long enough to tell the weight from the force; a higher threshold "
                "takes more for free"
            )
        weight, biases, noise = _regress(F, hanging, [own[free[own]] for own in each], known)
        before, left = left, F - weight * hanging
        for bias, own in zip(biases, each, strict=True):
            left[own] -= np.nan_to_num(bias)
        if np.allclose(before, left, atol=1e-3 * threshold):
            break
    return Payload(weight, up, biases, free, noise)


def _free(F: Array, threshold: float, margin: int, each: list[Rows]) -> NDArray[np.bool_]:
    touching, _ = detect_contact(F, F, threshold, None, WINDOW, each)
    free = touching == 0
    for own in each if margin else []:
        near = np.convolve(~free[own], np.ones(2 * margin + 1), mode="same") > 0.5
        free[own] &= ~near[: len(own)]
    return free


def _most_frequent(F: Array, radius: float) -> Array:
    """Find the force that has most others within a radius."""
    some = F[:: -(-len(F) // MOST_COMPARED)]
    near = np.linalg.norm(some[:, None] - some, axis=2) < radius
    return np.asarray(some[np.argmax(near.sum(axis=1))], dtype=np.float64)


def _regress(F: Array, hanging: Array, rows: list[Rows], known: list[bool]) -> tuple[float, Array, float]:
    """Solve for weight and biases by least squares in which large residuals count less."""
    used = [own for own, is_known in zip(rows, known, strict=True) if is_known]
    number = np.repeat(np.arange(len(used)), [3 * len(own) for own in used])
    all_rows = np.concatenate(used)
    y, h = F[all_rows].ravel(), hanging[all_rows].ravel()
    component = 3 * number + np.tile(np.arange(3), len(all_rows))
    w, weight, means = np.ones(len(y)), 0.0, np.zeros(3 * len(used))
    spread = 0.0
    for _ in range(TURNS):
        # Biases are weighted means of what the weight leaves, so that only the weight is solved for.
        total = np.bincount(component, w)
        mean_y, mean_h = (np.bincount(component, w * v) / total for v in (y, h))
        dy, dh = y - mean_y[component], h - mean_h[component]
        square = float(w @ dh**2)
        weight = float(w @ (dh * dy)) / square if square > 1e-9 * len(y) else 0.0
        means = mean_y - weight * mean_h
        r = np.abs(y - weight * h - means[component])
        spread = float(1.4826 * np.median(r))
        new = np.minimum(1.0, HUBER * spread / np.maximum(r, 1e-300))
        if np.abs(new - w).max() < 1e-3:
            break
        w = new
    biases = np.full((len(rows), 3), np.nan)
    biases[np.array(known)] = means.reshape(-1, 3)
    return weight, biases, spread


def _check(forces: ArrayLike, rotations: ArrayLike) -> tuple[Array, Array]:
    F, R = check_forces(forces), check_numbers(rotations, "rotations")
    if F.shape[1] != 3 or R.shape != (len(F), 3, 3):
        raise DataError(
            f"forces must be (samples, 3) and rotations (samples, 3, 3), got shapes {F.shape} and {R.shape}"
        )
    return F, R
