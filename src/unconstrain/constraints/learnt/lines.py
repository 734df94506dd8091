"""Rows as lines: a row and its negative are the same constraint."""

from collections.abc import Sequence

import numpy as np


def align(rows: np.ndarray) -> np.ndarray:
    """Turn rows so that their signs agree.

    Parameters
    ----------
    rows : ndarray of shape (N, d)
        Unit rows.

    Returns
    -------
    ndarray of shape (N, d)
        The rows or their negatives, none of which points away from their mean line.
    """
    return rows * np.where(rows @ mean_line(rows) < 0, -1.0, 1.0)[:, None]


def mean_line(rows: np.ndarray) -> np.ndarray:
    """Find the unit vector nearest to rows, whatever their signs.

    Parameters
    ----------
    rows : ndarray of shape (N, d)
        Unit rows.

    Returns
    -------
    ndarray of shape (d,)
        The largest eigenvector of their moments.
    """
    return np.linalg.eigh(rows.T @ rows)[1][:, -1]


def equation(row: np.ndarray, names: Sequence[str]) -> str:
    """Write a row as the equation it states, its largest term first: ``0.85 z - 0.42 x ≈ 0``.

    Parameters
    ----------
    row : ndarray of shape (d,)
        A constraint row.
    names : sequence of str
        Names of the d actions.

    Returns
    -------
    str
        The equation, without terms that round to zero.
    """
    row = row * np.sign(row[np.argmax(np.abs(row))])
    text = ""
    for i in np.argsort(-np.abs(row)):
        if abs(row[i]) >= 0.0005:
            text += f" {'-' if row[i] < 0 else '+'} {abs(row[i]):.3f} {names[i]}"
    return text.removeprefix(" + ") + " ≈ 0"
