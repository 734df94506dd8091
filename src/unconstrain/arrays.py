"""Arrays a user hands over, checked once at the door.

scikit-learn decides what an acceptable array is (`validate_data`); here its verdict becomes one sentence
of ours, and what it reports only in passing (which row holds the NaN) is named.
"""

import re

import numpy as np
from sklearn.utils.validation import (
    _check_sample_weight,
    check_array,
    check_consistent_length,
    validate_data,
)

from unconstrain.errors import DataError, PolicyError

ROUNDED = 0.05
NOT_IDEMPOTENT = (
    "is none, since applied twice it does something else than applied once: give N = I - A⁺A, as "
    "constraints.projection(A) makes it of the rows A"
)


def check_finite(array: np.ndarray, name: str) -> None:
    """Raise a `DataError` naming the first entry of `array` (samples first) that is NaN or infinite."""
    finite = np.isfinite(array)
    if finite.all():
        return
    place = np.argwhere(~finite)[0]
    kind = "NaN" if np.isnan(array[tuple(place)]) else "an infinite value (inf)"
    where = f"row {place[0]}" + (f", column {place[1]}" if array.ndim > 1 else "")
    raise DataError(
        f"{name} contains {kind} in {where} ({np.count_nonzero(~finite)} such entries in all): "
        "remove or interpolate those samples first"
    )


def check_states(estimator, X, *, reset: bool = False) -> np.ndarray:
    """States as an (N, n) float array; with `reset` the estimator learns n from them.

    Raises `DataError` for anything that is not a finite two-dimensional array of the expected width.
    """
    with _one_sentence():
        X = validate_data(estimator, X, reset=reset, dtype=np.float64, ensure_all_finite=False)
    check_finite(X, "X")
    return X


def check_samples(estimator, X, y, *, reset: bool, min_samples: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """States (N, n) and actions (N, d) or (N,) as finite float arrays of equal length.

    Raises `DataError` otherwise, and where there are fewer than `min_samples` samples.
    """
    if y is None:
        raise DataError(f"{type(estimator).__name__} requires y to be passed, but the target y is None")
    with _one_sentence():
        X = validate_data(estimator, X, reset=reset, dtype=np.float64, ensure_all_finite=False)
        y = check_array(y, dtype=np.float64, ensure_2d=False, ensure_all_finite=False, input_name="y")
        check_consistent_length(X, y)
    check_finite(X, "X")
    check_finite(y, "y (the actions)")
    if len(X) < min_samples:
        raise DataError(
            f"one sample (n_samples = {len(X)}) is not enough: a policy needs {min_samples} or more"
        )
    return X, y


def check_numbers(array, name: str) -> np.ndarray:
    """Make an array of float64, of any shape. Raises `DataError` for text, and for rows of different lengths."""
    try:
        return np.asarray(array, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise DataError(
            f"{name} must be an array of numbers, all rows of the same length ({' '.join(str(error).split())})"
        ) from None


def check_actions(U, name: str = "actions") -> np.ndarray:
    """Actions as an (N, d) finite float array; (N,) is read as d = 1. Raises `DataError` otherwise."""
    U = check_numbers(U, name)
    if U.ndim == 1:
        U = U[:, None]
    if U.ndim != 2:
        raise DataError(f"{name} must be (samples, dimensions), got an array of shape {U.shape}")
    check_finite(U, name)
    return U


def check_projections(projections, n_samples: int, n_actions: int, *, unknown: bool = False) -> np.ndarray:
    """Nullspace projections as an (N, d, d) finite float array. Raises `DataError` otherwise.

    With `unknown`, those that are not known may be NaN, as a whole.
    """
    N = check_numbers(projections, "projections")
    if N.shape != (n_samples, n_actions, n_actions):
        raise DataError(
            f"projections must have shape {(n_samples, n_actions, n_actions)}, one d x d matrix a sample, "
            f"got {N.shape}"
        )
    flat = N.reshape(n_samples, -1)
    if not unknown and np.isnan(flat).all(axis=1).any():
        raise DataError(
            f"the projection of row {np.argmax(np.isnan(flat).all(axis=1))} is NaN, that is, not known: "
            'leave such samples out, or choose risk="auto", which does without'
        )
    check_finite(np.where(np.isnan(flat).all(axis=1, keepdims=True), 0.0, flat), "projections")
    odd = not_idempotent(N)
    if len(odd):
        raise DataError(f"the projection of row {odd[0]} {NOT_IDEMPOTENT}")
    return N


def not_idempotent(projections: np.ndarray) -> np.ndarray:
    """Rows of the matrices N (N, d, d) that are no projections, as `N N v` is not `N v` for a v that favours no axis.

    Generous, so that projections rounded to two decimals pass; those that are NaN pass too.
    """
    v = np.cos(np.arange(projections.shape[2]) + 1.0)
    with np.errstate(over="ignore", invalid="ignore"):  # of numbers that are far from any projection's
        once = projections @ v
        twice = np.einsum("nij,nj->ni", projections, once)
        same = np.abs(twice - once).max(axis=1, initial=0.0) <= ROUNDED
    return np.flatnonzero(~same & ~np.isnan(projections).any(axis=(1, 2)))


def check_weights(sample_weight, X: np.ndarray) -> np.ndarray:
    """Sample weights (N,), ones where none are given. Raises `DataError` for a negative one, or none left."""
    with _one_sentence():
        weights = _check_sample_weight(sample_weight, X, dtype=np.float64, ensure_non_negative=True)
    if not weights.any():
        raise DataError("every sample weight is zero: nothing is left to learn from")
    return weights


def check_groups(groups, n_samples: int) -> np.ndarray | None:
    """Episode labels (N,), or None. Raises `DataError` where there is not one label a sample."""
    if groups is None:
        return None
    groups = np.asarray(groups)
    if groups.shape != (n_samples,):
        raise DataError(
            f"groups must hold one episode label a sample, {n_samples} in all, got shape {groups.shape}"
        )
    if groups.dtype.kind == "f" and np.isnan(groups).any():
        raise DataError(
            f"groups contains NaN in row {np.argmax(np.isnan(groups))}: give every sample the label of an episode"
        )
    return groups


def check_number(value, name: str, *, positive: bool) -> float:
    """Check for a finite number, above zero where `positive`, else at least zero. Raises `PolicyError` otherwise."""
    wanted = "above zero" if positive else "of at least zero"
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise PolicyError(f"{name} must be a number {wanted}, got {value!r}") from None
    if not np.isfinite(number) or number < 0 or (positive and number == 0):
        raise PolicyError(f"{name} must be a finite number {wanted}, got {value!r}")
    return number


def check_choice(value, name: str, choices: tuple[str, ...]) -> str:
    """One of the named choices. Raises `PolicyError` that lists them otherwise."""
    if not isinstance(value, str) or value not in choices:
        raise PolicyError(f"{name} must be one of {', '.join(map(repr, choices))}, got {value!r}")
    return value


class _one_sentence:
    """scikit-learn's ValueErrors, on their way out, become one `DataError` sentence."""

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind, error, traceback) -> None:
        if isinstance(error, ValueError) and not isinstance(error, DataError):
            # Some of scikit-learn's messages print the whole array between their two sentences.
            text = re.sub(r":\narray=.*?\n(?=Reshape)", ": ", str(error), flags=re.DOTALL)
            raise DataError(" ".join(text.split())) from None
