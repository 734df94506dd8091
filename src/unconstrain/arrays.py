"""Check arrays and numbers that users hand over, once, where they come in.

scikit-learn decides what an acceptable array is (`validate_data`); its verdict becomes one sentence here, which also
names what it reports only in passing, such as the row that holds a NaN. scikit-learn is imported when it is asked.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from unconstrain.errors import DataError, NotNumbersError, PolicyError

if TYPE_CHECKING:
    from sklearn.base import BaseEstimator

SQUARABLE = 1e150
"""Numbers between the inverse of this and this can be squared and summed in double precision."""

ROUNDED = 0.05
"""How far `N N v` may be from `N v` in each component: projections rounded to two decimals pass."""

BLOCKED = 0.5**0.5
"""Share of an action, or of a typical one where that is longer, beyond which its own projection may not block it: it
then blocks more than it lets through. Noise, friction in the forces, and the moment of contact block some."""

EXPLAINED = 0.2
"""Share that another projection may block where it is said to be the one meant."""

NOT_IDEMPOTENT = (
    "is none, since applied twice it does something else than applied once: give N = I - A⁺A, as "
    "constraints.projection(A) makes it of the rows A"
)


def check_numbers(array: ArrayLike, name: str) -> np.ndarray:
    """Convert to an array of float64, of any shape.

    Parameters
    ----------
    array : array_like
        Numbers.
    name : str
        What the array is, to begin the sentence of an error with.

    Returns
    -------
    ndarray
        The numbers, NaN and infinity among them.

    Raises
    ------
    DataError
        For text, complex numbers, and rows of different lengths.
    """
    try:
        given = np.asarray(unmask(array))
        numbers = given.real.astype(np.float64, copy=False)
    except (TypeError, ValueError, OverflowError) as error:
        raise DataError(
            f"{name} must be an array of numbers, all rows of the same length ({' '.join(str(error).split())})"
        ) from None
    if np.iscomplexobj(given):
        raise DataError(f"{name} must be real numbers, and these are complex: give their parts as columns")
    return numbers


def unmask(array: ArrayLike | None) -> ArrayLike | None:
    """Return an array whose masked entries are NaN: what is behind a mask is missing, and no number.

    Parameters
    ----------
    array : array_like or None
        Whatever was given.

    Returns
    -------
    array_like or None
        The same, but for masked arrays.
    """
    return np.ma.filled(array.astype(np.float64), np.nan) if isinstance(array, np.ma.MaskedArray) else array


def check_finite(array: np.ndarray, name: str) -> None:
    """Check that no entry is NaN or infinite.

    Parameters
    ----------
    array : ndarray of shape (N, ...)
        Numbers, samples first.
    name : str
        What the array is, to begin the sentence of an error with.

    Raises
    ------
    DataError
        Which names the row and the column of the first entry that is not finite.
    """
    finite = np.isfinite(array)
    if finite.all():
        return
    place = np.argwhere(~finite)[0]
    kind = "NaN" if np.isnan(array[tuple(place)]) else "an infinite value (inf)"
    where = f"row {place[0]}" + (f", column {place[1]}" if array.ndim > 1 else "")
    raise DataError(
        f"{name} contains {kind} in {where} ({np.count_nonzero(~finite)} such entries in all): "
        "remove or interpolate those samples first",
        row=int(place[0]),
        column=int(place[1]) if array.ndim > 1 else None,
    )


def check_squarable(names: str, *arrays: np.ndarray) -> None:
    """Check that the largest of some numbers has a square that double precision holds.

    Parameters
    ----------
    names : str
        What the arrays are, as the subject of a sentence in the plural.
    *arrays : ndarray
        Finite numbers, all in one unit.

    Raises
    ------
    DataError
        If the square of the largest would be infinite, or zero though the number is not.
    """
    largest = max(_largest(array) for array in arrays)
    if largest and not 1 / SQUARABLE <= largest <= SQUARABLE:
        raise DataError(
            f"{names} reach {largest:.3g}, whose square double precision does not hold: give them in another unit"
        )


def check_states(estimator: "BaseEstimator", X: ArrayLike, *, reset: bool = False) -> np.ndarray:
    """Check states for an estimator of scikit-learn's kind.

    Parameters
    ----------
    estimator : estimator
        Whose `n_features_in_` the states have to match.
    X : array_like of shape (N, n)
        States.
    reset : bool
        Whether the estimator learns n from them.

    Returns
    -------
    ndarray of shape (N, n)
        The states, in double precision.

    Raises
    ------
    DataError
        For anything that is not a finite two-dimensional array of the expected width.
    """
    from sklearn.utils.validation import validate_data

    expected = None if reset else getattr(estimator, "n_features_in_", None)
    with _one_sentence(lambda: _hint_at_states(X, expected)):
        states = validate_data(estimator, unmask(X), reset=reset, dtype=np.float64, ensure_all_finite=False)
    if not _largest(states) <= SQUARABLE:
        check_finite(states, "X")
        _check_not_too_large("the states X", states)
    return states


def check_samples(
    estimator: "BaseEstimator", X: ArrayLike, y: ArrayLike | None, *, reset: bool, min_samples: int = 1
) -> tuple[np.ndarray, np.ndarray]:
    """Check states and actions for an estimator of scikit-learn's kind.

    Parameters
    ----------
    estimator : estimator
        Whose `n_features_in_` the states have to match.
    X : array_like of shape (N, n)
        States.
    y : array_like of shape (N, d) or (N,)
        Actions.
    reset : bool
        Whether the estimator learns n from them.
    min_samples : int
        How many samples it needs.

    Returns
    -------
    X : ndarray of shape (N, n)
        The states, in double precision.
    y : ndarray of shape (N, d) or (N,)
        The actions, in double precision.

    Raises
    ------
    DataError
        If either is not finite, lengths differ, there are too few samples, or squares would overflow.
    """
    from sklearn.utils.validation import check_array, check_consistent_length, validate_data

    if y is None:
        raise DataError(f"{type(estimator).__name__} requires y to be passed, but the target y is None")
    with _one_sentence(lambda: _hint_at_samples(X, y)):
        states = validate_data(estimator, unmask(X), reset=reset, dtype=np.float64, ensure_all_finite=False)
        actions = check_array(
            unmask(y), dtype=np.float64, ensure_2d=False, ensure_all_finite=False, input_name="y"
        )
        check_consistent_length(states, actions)
    check_finite(states, "X")
    check_finite(actions, "y (the actions)")
    _check_not_too_large("the states X", states)
    check_squarable("the actions y", actions)
    if len(states) < min_samples:
        raise DataError(
            f"one sample (n_samples = {len(states)}) is not enough: a policy needs {min_samples} or more"
        )
    return states, actions


def check_actions(U: ArrayLike, name: str = "actions") -> np.ndarray:
    """Check actions.

    Parameters
    ----------
    U : array_like of shape (N, d) or (N,)
        Actions; (N,) is read as d = 1.
    name : str
        What they are, to begin the sentence of an error with.

    Returns
    -------
    ndarray of shape (N, d)
        The actions, in double precision.

    Raises
    ------
    DataError
        If they are of another shape or not finite.
    """
    U = check_numbers(U, name)
    if U.ndim == 1:
        U = U[:, None]
    if U.ndim != 2:
        raise DataError(f"{name} must be (samples, dimensions), got an array of shape {U.shape}")
    check_finite(U, name)
    return U


def check_projections(
    projections: ArrayLike, n_samples: int, n_actions: int, *, unknown: bool = False
) -> np.ndarray:
    """Check nullspace projections.

    Parameters
    ----------
    projections : array_like of shape (N, d, d)
        One matrix a sample.
    n_samples, n_actions : int
        N and d.
    unknown : bool
        Whether a projection may be all NaN, for one that is not known.

    Returns
    -------
    ndarray of shape (N, d, d)
        The projections, in double precision.

    Raises
    ------
    DataError
        If they are of another shape or not finite, or one is no projection.
    """
    N = check_numbers(projections, "projections")
    if N.shape != (n_samples, n_actions, n_actions):
        raise DataError(
            f"projections must have shape {(n_samples, n_actions, n_actions)}, one d x d matrix a sample, "
            f"got {N.shape}"
        )
    missing = np.isnan(N).reshape(n_samples, -1).all(axis=1)
    if not unknown and missing.any():
        raise DataError(
            f"the projection of row {np.argmax(missing)} is NaN, that is, not known: leave such samples out"
        )
    check_finite(np.where(missing[:, None, None], 0.0, N), "projections")
    odd = not_idempotent(N)
    if len(odd):
        raise DataError(f"the projection of row {odd[0]} {NOT_IDEMPOTENT}", row=int(odd[0]))
    return N


def not_idempotent(projections: np.ndarray) -> np.ndarray:
    """Find the matrices that are no projections, as `N N v` is not `N v` for a v that favours no axis.

    Parameters
    ----------
    projections : ndarray of shape (N, d, d)
        Matrices; those that are NaN pass, and so do projections rounded to two decimals.

    Returns
    -------
    ndarray of int
        Their rows.
    """
    v = np.cos(np.arange(projections.shape[2]) + 1.0)
    with np.errstate(over="ignore", invalid="ignore"):  # of numbers that are far from any projection's
        once = projections @ v
        twice = np.einsum("nij,nj->ni", projections, once)
        same = np.abs(twice - once).max(axis=1, initial=0.0) <= ROUNDED
    return np.flatnonzero(~same & ~np.isnan(projections).any(axis=(1, 2)))


def check_lets_through(projections: np.ndarray, U: np.ndarray) -> None:
    """Check that known projections let their samples' own actions through, `N u = u` but for noise.

    Parameters
    ----------
    projections : ndarray of shape (N, d, d)
        All NaN where not known.
    U : ndarray of shape (N, d)
        Actions.

    Raises
    ------
    DataError
        One blocks much of the action that was recorded under it; the sentence names the row and the likely cause.
    """
    known = np.flatnonzero(~np.isnan(projections).any(axis=(1, 2)))
    largest = float(np.abs(U[known]).max(initial=0.0))
    if not largest:
        return
    N, u = projections[known], U[known] / largest
    through = np.einsum("nij,nj->ni", N, u)
    r = np.linalg.norm(u, axis=1)
    size = np.maximum(r, np.sqrt(np.mean(r**2)))
    bad = np.flatnonzero(np.linalg.norm(u - through, axis=1) > BLOCKED * size)
    if not len(bad):
        return
    first = bad[0]
    others = "" if len(bad) == 1 else f" (nor do those of {len(bad) - 1} other rows)"
    raise DataError(
        f"the projection of row {known[first]} does not let through the action that was recorded under it: of "
        f"{largest * r[first]:.3g} it blocks {largest * np.linalg.norm(u[first] - through[first]):.3g}{others}. "
        f"{_cause_of_blocking(N, u, through, size, bad)}",
        row=int(known[first]),
    )


def _cause_of_blocking(
    N: np.ndarray, u: np.ndarray, through: np.ndarray, size: np.ndarray, bad: np.ndarray
) -> str:
    """Find what would let most of the blocked actions through, and say so."""

    def explains(remaining: np.ndarray) -> bool:
        return bool(np.mean(np.linalg.norm(remaining, axis=1) <= EXPLAINED * size[bad]) > 0.8)

    if explains(through[bad]):
        return (
            "Likely it is the projection onto what the constraint forbids: give I minus it, the projection onto what "
            "the constraint leaves free"
        )
    for by, word in ((1, "before"), (-1, "after")):
        beside = np.clip(bad - by, 0, len(u) - 1)
        if explains(u[bad] - np.einsum("nij,nj->ni", N[beside], u[bad])):
            return (
                f"Likely it belongs to another row, since that of the row {word} fits: give projections in the order "
                "of the actions"
            )
    return (
        "Likely it is in another frame than the actions, or their columns are in another order; where it is not known "
        "what the constraint was, make it NaN"
    )


def check_weights(sample_weight: ArrayLike | None, X: np.ndarray) -> np.ndarray:
    """Check sample weights.

    Parameters
    ----------
    sample_weight : array_like of shape (N,), float, or None
        Weights of the samples; None is one for each.
    X : ndarray of shape (N, ...)
        The samples.

    Returns
    -------
    ndarray of shape (N,)
        The weights, in double precision.

    Raises
    ------
    DataError
        If one is negative, all are zero, or they are too large to be added.
    """
    from sklearn.utils.validation import _check_sample_weight

    with _one_sentence():
        weights = _check_sample_weight(sample_weight, X, dtype=np.float64, ensure_non_negative=True)
    if not weights.any():
        raise DataError("every sample weight is zero: nothing is left to learn from")
    check_squarable("the sample weights", weights)
    return weights


def check_groups(groups: ArrayLike | None, n_samples: int, name: str = "groups") -> np.ndarray | None:
    """Check episode labels.

    Parameters
    ----------
    groups : array_like of shape (N,), or None
        A label a sample, numbers or text.
    n_samples : int
        N.
    name : str
        What the labels are, to begin the sentence of an error with.

    Returns
    -------
    ndarray of shape (N,), or None
        The labels; None where none are given.

    Raises
    ------
    DataError
        If there is not one label a sample.
    """
    if groups is None:
        return None
    try:
        labels = np.asarray(groups)
    except ValueError:  # rows of different lengths
        labels = np.asarray(None)
    if labels.shape != (n_samples,):
        shape = f", got shape {labels.shape}" if labels.ndim else ""
        raise DataError(f"{name} must hold one label a sample, {n_samples} in all{shape}")
    if labels.dtype.kind in "fc" and np.isnan(labels).any():
        raise DataError(
            f"{name} contains NaN in row {np.argmax(np.isnan(labels))}: give every sample the label of an episode"
        )
    if labels.dtype.kind == "O":
        try:
            np.unique(labels)
        except TypeError:
            raise DataError(
                f"{name} holds labels that cannot be compared with each other: give numbers, or text"
            ) from None
    return labels


def check_number(value: object, name: str, *, positive: bool) -> float:
    """Check an option that is a finite number.

    Parameters
    ----------
    value : object
        What was given.
    name : str
        Of the option.
    positive : bool
        Whether it has to be above zero; else zero will do.

    Returns
    -------
    float
        The number.

    Raises
    ------
    PolicyError
        If it is not such a number.
    """
    wanted = "above zero" if positive else "of at least zero"
    try:
        number = float(value)  # type: ignore[arg-type]  # anything else is what is caught
    except (TypeError, ValueError, OverflowError):
        raise PolicyError(f"{name} must be a number {wanted}, got {quote(value)}") from None
    if not np.isfinite(number) or number < 0 or (positive and number == 0):
        raise PolicyError(f"{name} must be a finite number {wanted}, got {quote(value)}")
    return number


def check_widths(value: object, name: str, n: int) -> np.ndarray:
    """Check a width: one positive number for all dimensions, or one for each.

    Parameters
    ----------
    value : object
        To check.
    name : str
        Of the argument.
    n : int
        Number of dimensions.

    Returns
    -------
    ndarray of shape (n,)
        The widths.

    Raises
    ------
    PolicyError
        If it is neither.
    """
    if np.ndim(value) == 0:  # type: ignore[arg-type]
        return np.full(n, check_number(value, name, positive=True))
    widths = check_numbers(value, name)  # type: ignore[arg-type]
    if widths.shape != (n,) or not np.all(np.isfinite(widths) & (widths > 0)):
        raise PolicyError(
            f"{name} must be a positive number, or one for each of the {n} states, got {quote(value)}"
        )
    return widths


def check_whole(value: object, name: str, *, least: int, most: int | None = None) -> int:
    """Check an option that is a whole number.

    Parameters
    ----------
    value : object
        What was given.
    name : str
        Of the option.
    least, most : int
        Bounds, which are allowed themselves; None is no bound.

    Returns
    -------
    int
        The number.

    Raises
    ------
    PolicyError
        If it is not such a number.
    """
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not whole or value < least or (most is not None and value > most):  # type: ignore[operator]  # it is a number
        wanted = f"of at least {least}" if most is None else f"from {least} to {most}"
        raise PolicyError(f"{name} must be a whole number {wanted}, got {quote(value)}")
    return int(value)  # type: ignore[call-overload]


def check_names(names: Sequence[str], name: str, count: int) -> tuple[str, ...]:
    """Check names of dimensions.

    Parameters
    ----------
    names : sequence of str
        What was given.
    name : str
        Of the argument.
    count : int
        How many there must be.

    Returns
    -------
    tuple of str
        The names.

    Raises
    ------
    DataError
        If they are not so many texts.
    """
    listed = names if isinstance(names, list | tuple | np.ndarray) and np.ndim(names) == 1 else ()
    if len(listed) != count or not all(isinstance(each, str) for each in listed):
        raise DataError(f"{name} must be {count} names, one for each dimension, got {quote(names)}")
    return tuple(str(each) for each in listed)


def quote(value: object) -> str:
    """Write a value into a sentence: in one line, and cut short.

    Parameters
    ----------
    value : object
        What was given.

    Returns
    -------
    str
        Its representation, or where it has none, its type.
    """
    try:
        text = " ".join(repr(value).split())
    except Exception:  # an integer of too many digits, an object that fails to describe itself
        text = f"a {type(value).__name__}"
    return text if len(text) <= 60 else f"{text[:57]}..."


def check_choice(value: object, name: str, choices: tuple[str, ...]) -> str:
    """Check an option that is one of several names.

    Parameters
    ----------
    value : object
        What was given.
    name : str
        Of the option.
    choices : tuple of str
        What may be given.

    Returns
    -------
    str
        The choice.

    Raises
    ------
    PolicyError
        Which lists the choices, if it is none of them.
    """
    if not isinstance(value, str) or value not in choices:
        raise PolicyError(f"{name} must be one of {', '.join(map(repr, choices))}, got {quote(value)}")
    return value


def _check_not_too_large(names: str, array: np.ndarray) -> None:
    # States close to zero are no mistake: nothing is learnt from how long a state is.
    if _largest(array) > SQUARABLE:
        check_squarable(names, array)


def _largest(array: np.ndarray) -> float:
    # Without the copy that the absolute values would be. NaN where a number is NaN.
    high, low = float(array.max(initial=0.0)), float(array.min(initial=0.0))
    return np.nan if np.isnan(high) else max(high, -low)


def _hint_at_samples(X: ArrayLike, y: ArrayLike) -> str:
    """Say so where states have a column, and not a row, for each of the actions."""
    shape, length = np.shape(X), np.shape(y)[:1]
    if len(shape) == 2 and shape[0] != shape[1] and shape[1:] == length:
        return f"; X has shape {shape} and y has {shape[1]} samples: did you mean the transpose, X.T?"
    return ""


def _hint_at_states(X: ArrayLike, expected: int | None) -> str:
    """Say so where states have a row, and not a column, for each state that is expected."""
    shape = np.shape(X)
    if len(shape) == 2 and shape[1] != shape[0] == expected:
        return f"; X has shape {shape}: did you mean the transpose, X.T?"
    return ""


@contextmanager
def _one_sentence(hint: Callable[[], str] = str) -> Iterator[None]:
    """Turn what scikit-learn raises into one `DataError` sentence, with a hint at its end."""
    try:
        yield
    except DataError:
        raise
    except (TypeError, ValueError, OverflowError) as error:
        # Some of scikit-learn's messages print the whole array between their two sentences, or after them.
        text = re.sub(r":\narray=.*?\n(?=Reshape)", ": ", str(error), flags=re.DOTALL)
        text = re.sub(r"(?<=not supported)\n\W.*", "", text, flags=re.DOTALL)
        with suppress(ValueError):  # rows of different lengths have no shape
            text += hint()
        kind = NotNumbersError if isinstance(error, TypeError) else DataError
        raise kind(" ".join(text.split())) from None
