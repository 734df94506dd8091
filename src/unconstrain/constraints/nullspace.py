"""From constraint rows to the projection onto their nullspace."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import check_numbers, check_whole
from unconstrain.errors import DataError
from unconstrain.memory import check_memory

RANK_TOLERANCE = 1e-10
"""A direction counts as constrained if its singular value exceeds this share of the largest one."""

NEGLIGIBLE_ROW = 1e-14
"""A row this much shorter than the longest is rounding (a Jacobian's cos(π/2), say), no constraint."""


def projection(A: ArrayLike) -> NDArray[np.float64]:
    """Compute the nullspace projection ``N = I - A⁺A`` of one constraint matrix, or of one per sample.

    Rows may be zero (nothing is constrained by them), of any length, or depend on one another; there may be
    none, or more than there are actions. Only the directions they span matter.

    Parameters
    ----------
    A : array_like of shape (k, d) or (N, k, d)
        Constraint rows, ``A u = 0``, over d action dimensions.

    Returns
    -------
    ndarray of shape (d, d) or (N, d, d)
        Symmetric and idempotent, with ``A N = 0`` and trace ``d - rank(A)``.

    Raises
    ------
    DataError
        If `A` has another number of axes or holds NaN or infinity.

    Notes
    -----
    Equation (2) of the paper. ``A⁺A = V Vᵀ`` over the right singular vectors whose singular value exceeds
    `RANK_TOLERANCE` times the largest, after each row is scaled to unit length: rows in metres and rows in
    radians then count alike, and so do strong and weak contacts. Rows shorter than `NEGLIGIBLE_ROW` times the
    longest are taken as zero.
    """
    rows = _check_rows(A)
    # Scaling by the largest entry first keeps the length of very small or very large rows finite.
    largest = np.abs(rows).max(axis=-1, keepdims=True, initial=0.0)
    matters = largest > NEGLIGIBLE_ROW * largest.max(axis=-2, keepdims=True, initial=0.0)
    unit = np.divide(rows, largest, out=np.zeros_like(rows), where=matters)
    length = np.linalg.norm(unit, axis=-1, keepdims=True)
    np.divide(unit, length, out=unit, where=length > 0)

    identity = unconstrained(rows.shape[-1])
    if rows.shape[-2] == 0 or rows.shape[-1] == 0:
        return np.broadcast_to(identity, (*rows.shape[:-2], *identity.shape)).copy()
    _, values, right = np.linalg.svd(unit, full_matrices=False)
    constrained = values > RANK_TOLERANCE * values[..., :1]
    spanned = right * constrained[..., None]
    N = identity - np.swapaxes(spanned, -1, -2) @ spanned
    # What blocks all motion leaves exactly none: rounding would pass for a movement with a direction.
    N[constrained.sum(axis=-1) == rows.shape[-1]] = 0.0
    return N


def in_metric(N: NDArray[np.float64], scale: NDArray[np.float64]) -> NDArray[np.float64]:
    """Compute the projections that the constraints behind projections have in units of a scale.

    With `A = I - N`, `A u = 0` is `A S u' = 0` for `u = S u'`.

    Parameters
    ----------
    N : ndarray of shape (N, d, d)
        All NaN where not known.
    scale : ndarray of shape (d,)
        The diagonal of S.

    Returns
    -------
    ndarray of shape (N, d, d)
        All NaN where not known.
    """
    result, known = N.copy(), ~np.isnan(N[:, 0, 0])
    result[known] = projection((np.eye(len(scale)) - N[known]) * scale)
    return result


def constrain(
    N: NDArray[np.float64], U: NDArray[np.float64], scale: NDArray[np.float64] | None
) -> NDArray[np.float64]:
    """Take of actions what projections leave, in the metric of a scale.

    Parameters
    ----------
    N : ndarray of shape (N, d, d)
        Known.
    U : ndarray of shape (N, d)
        Actions.
    scale : ndarray of shape (d,) or None
        What a length of one is along each action.

    Returns
    -------
    ndarray of shape (N, d)
        The nearest actions that the constraints let through.
    """
    if scale is None or np.all(scale == scale[0]):
        return np.einsum("nij,nj->ni", N, U)
    return scale * np.einsum("nij,nj->ni", in_metric(N, scale), U / scale)


def combine(*A: ArrayLike) -> NDArray[np.float64]:
    """Combine constraint matrices into one that asks for all of them, by stacking their rows.

    Parameters
    ----------
    *A : array_like of shape (k_i, d) or (N, k_i, d)
        At least one; those of a single sample hold for all samples of the others.

    Returns
    -------
    ndarray of shape (Σ k_i, d) or (N, Σ k_i, d)
        All rows, those of the first matrix first.

    Raises
    ------
    DataError
        If none is given, the numbers of actions d or of samples N differ, or an entry is not finite.
    """
    if not A:
        raise DataError("there is nothing to combine: give at least one constraint matrix")
    parts = [_check_rows(part) for part in A]
    widths = sorted({part.shape[-1] for part in parts})
    if len(widths) > 1:
        raise DataError(
            f"constraint matrices over {_join(widths)} actions cannot be combined: "
            "give all of them one column per action dimension"
        )
    samples = sorted({len(part) for part in parts if part.ndim == 3})
    if len(samples) > 1:
        raise DataError(
            f"constraint matrices of {_join(samples)} samples cannot be combined: give one matrix per "
            "sample of the same recording, or a single one for all"
        )
    if samples:
        parts = [np.broadcast_to(part, (samples[0], *part.shape[-2:])) for part in parts]
    return np.concatenate(parts, axis=-2)


def unconstrained(d: int, samples: int | None = None) -> NDArray[np.float64]:
    """Make the projection that changes nothing, the identity.

    Parameters
    ----------
    d : int
        Number of actions.
    samples : int, optional
        How many of them to make.

    Returns
    -------
    ndarray of shape (d, d) or (samples, d, d)
        Identity matrices.
    """
    d = check_whole(d, "d", least=1)
    if samples is not None:
        samples = check_whole(samples, "samples", least=0)
    count = 1 if samples is None else samples
    # No more than a float holds: whole numbers may have any number of digits.
    size = 8.0 * float(min(d, 10**100)) ** 2 * float(min(count, 10**100))
    check_memory(size, "the identity of so many actions, for so many samples", "take fewer")
    identity = np.eye(d)
    return identity if samples is None else np.broadcast_to(identity, (samples, d, d)).copy()


def _check_rows(A: ArrayLike) -> NDArray[np.float64]:
    try:
        rows = check_numbers(A, "a constraint matrix")
    except DataError as error:
        raise DataError(
            f"{error}; a constraint matrix must be an array of numbers of shape (k, d) or (N, k, d): pad samples that "
            "have fewer constraints with rows of zeros"
        ) from None
    if rows.ndim not in (2, 3):
        raise DataError(
            f"a constraint matrix must have shape (k, d), or (N, k, d) for one per sample, not {rows.shape}; "
            "write a single row as [[a1, a2, ...]]"
        )
    if not np.isfinite(rows).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(rows))[0])
        raise DataError(f"the constraint matrix has NaN or infinity at index {where}; remove or repair it")
    return rows


def _join(numbers: list[int]) -> str:
    return " and ".join(map(str, numbers))
