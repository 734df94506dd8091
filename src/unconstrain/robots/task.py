"""Constraints on the motion of a robot's hand, and what they mean for its joints.

A hand moves with velocity v (m/s) and angular velocity ω (rad/s), together six numbers, counted from 1 to 6. A
constraint blocks k combinations of them, ``S (v, ω) = 0``. Through the Jacobian, ``(v, ω) = J q̇``, it
becomes rows ``A = S J`` with ``A q̇ = 0`` over the joints.
"""

import re
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.constraints.nullspace import projection
from unconstrain.errors import DataError, UnconstrainError

Array = NDArray[np.float64]

ROWS = re.compile(r"[0-9]+(-[0-9]+)*")
"""How task rows are written: "1-2-3"."""


@dataclass(frozen=True, eq=False)
class TaskConstraint:
    """The combinations of a hand's velocities that are blocked.

    Parameters
    ----------
    selection : ndarray of shape (k, 6)
        S, over the three velocities and the three angular velocities in the world.
    name : str
        The constraint as the user wrote it.

    Examples
    --------
    >>> TaskConstraint.parse("1-2-3").selection.shape          # the hand stays in place and may turn
    (3, 6)
    >>> TaskConstraint.parse("0,0,1").selection                # the hand slides on a level table
    array([[0., 0., 1., 0., 0., 0.]])
    >>> TaskConstraint.parse("1-3-5").complement().name        # what the other leaves free
    '2-4-6'
    """

    selection: Array = field(repr=False)
    name: str

    @classmethod
    def parse(cls, given: "str | ArrayLike | TaskConstraint") -> "TaskConstraint":
        """Understand a constraint as a user writes it.

        Parameters
        ----------
        given : str, array_like, or TaskConstraint
            Task rows, ``"1-2-3"``; the normal of a plane on which the hand slides, ``"0,0,1"`` or an array
            (3,), of any length but zero; or a matrix S, an array (k, 6) or its rows as text,
            ``"1,0,0,0,0,0; 0,0,1,0,0,0"``.

        Returns
        -------
        TaskConstraint
            With the text as its name; a `TaskConstraint` is returned as it is.

        Raises
        ------
        UnconstrainError
            If the text is none of these, a row is not one of 1 to 6, or a normal is zero.
        DataError
            If an array has another shape or is not finite.
        """
        if isinstance(given, TaskConstraint):
            return given
        if not isinstance(given, str):
            try:
                numbers = np.asarray(given, dtype=np.float64)
            except (TypeError, ValueError):
                raise DataError(
                    "a constraint must be numbers: the normal of a plane (3,) or a matrix (k, 6)"
                ) from None
            return cls(_selection(numbers), _written(numbers))
        text = given.strip()
        if ROWS.fullmatch(text):
            return cls._of_rows([int(row) for row in text.split("-")], text)
        try:
            rows = [[float(number) for number in row.split(",")] for row in text.split(";")]
        except ValueError:
            raise _misunderstood(given) from None
        if {len(row) for row in rows} != {6} and [len(row) for row in rows] != [3]:
            raise _misunderstood(given)
        return cls(_selection(np.array(rows[0] if len(rows[0]) == 3 else rows)), text)

    @classmethod
    def _of_rows(cls, rows: list[int], text: str) -> "TaskConstraint":
        if wrong := [row for row in rows if not 1 <= row <= 6]:
            raise UnconstrainError(
                f"there is no task row {wrong[0]} as in {text!r}: 1 to 3 are the hand's velocity along x, y and "
                "z, 4 to 6 its angular velocity about them"
            )
        if len(set(rows)) < len(rows):
            raise UnconstrainError(f"a task row is named twice in {text!r}: name each once, as in 1-2-3")
        return cls(np.eye(6)[np.array(rows) - 1], text)

    def rows(self, jacobians: Array) -> Array:
        """Compute the constraint rows over the joints, ``A = S J``.

        Parameters
        ----------
        jacobians : ndarray of shape (N, 6, n)
            Of the hand, as `Robot.jacobian` gives them.

        Returns
        -------
        ndarray of shape (N, k, n)
            A, one matrix for each Jacobian.
        """
        return self.selection @ jacobians

    def projections(self, jacobians: Array) -> Array:
        """Compute the nullspace projections over the joints, ``N = I - A⁺A``, in singular postures as well.

        Parameters
        ----------
        jacobians : ndarray of shape (N, 6, n)
            Of the hand, as `Robot.jacobian` gives them.

        Returns
        -------
        ndarray of shape (N, n, n)
            N, one matrix for each Jacobian.
        """
        return projection(self.rows(jacobians))

    def complement(self) -> "TaskConstraint":
        """Return the constraint that blocks exactly what this one leaves free: 4-5-6 for 1-2-3.

        Returns
        -------
        TaskConstraint
            Its rows span the rest of the six velocities.

        Raises
        ------
        UnconstrainError
            If this constraint leaves nothing free.
        """
        chosen = np.flatnonzero(self.selection.any(axis=0))
        if len(chosen) == len(self.selection) and np.all(self.selection.sum(axis=0)[chosen] == 1):
            rows = [row for row in range(1, 7) if row - 1 not in chosen]
            rest, name = np.eye(6)[np.array(rows, dtype=int) - 1], "-".join(map(str, rows))
        else:
            from scipy.linalg import null_space  # costs more to import than all else here

            rest, name = null_space(self.selection).T, f"complement of {self.name}"
        if not len(rest):
            raise UnconstrainError(f"the constraint {self.name} leaves nothing free, so it has no complement")
        return TaskConstraint(rest, name)


def _selection(numbers: Array) -> Array:
    if not np.isfinite(numbers).all():
        raise DataError("a constraint has NaN or infinity: give finite numbers")
    if numbers.shape == (3,):
        length = np.linalg.norm(numbers)
        if length == 0:
            raise UnconstrainError("the normal of a plane cannot be 0,0,0: give a direction, such as 0,0,1")
        return np.concatenate([numbers / length, np.zeros(3)])[None]
    if numbers.ndim != 2 or numbers.shape[1] != 6:
        raise DataError(
            f"a constraint on a hand is the normal of a plane (3,) or a matrix (k, 6), not {numbers.shape}"
        )
    return numbers


def _misunderstood(given: str) -> UnconstrainError:
    return UnconstrainError(
        f"{given!r} is no constraint: give task rows such as 1-2-3, the normal of a plane such as 0,0,1, or the "
        "rows of a matrix over the six velocities such as '1,0,0,0,0,0; 0,0,1,0,0,0'"
    )


def _written(numbers: Array) -> str:
    return "; ".join(",".join(f"{number:g}" for number in row) for row in np.atleast_2d(numbers))
