"""Recordings that were made under a constraint that was learnt before."""

from dataclasses import replace

import numpy as np

from unconstrain.constraints.learnt.base import LearntConstraint
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError

ACROSS = 0.5
"""Share of its length by which an action may cross the constraint that it was recorded under, since there is noise."""


def tell_constraint(demos: Demonstrations, constraint: LearntConstraint) -> Demonstrations:
    """Give demonstrations the projections of a constraint, as far as they moved under it.

    Parameters
    ----------
    demos : Demonstrations
        N samples.
    constraint : LearntConstraint
        Over states and actions of the same meaning.

    Returns
    -------
    Demonstrations
        With the constraint's `projections` where none were known and the action keeps within it, and a note of how many
        do not.

    Raises
    ------
    DataError
        The constraint is over other numbers of states or actions, or most of the motion crosses it.
    """
    n, d = constraint.n_features_in_, constraint.n_actions_
    if (n, d) != (demos.states.shape[1], demos.actions.shape[1]):
        raise DataError(
            f"the constraint is over {n} states and {d} actions, and the recordings have {demos.states.shape[1]} and "
            f"{demos.actions.shape[1]}: choose the columns it was learnt from"
        )
    N, U = constraint.predict(demos.states), demos.actions
    crossing = np.linalg.norm(U - np.einsum("nij,nj->ni", N, U), axis=1)
    crosses = crossing > ACROSS * np.linalg.norm(U, axis=1)
    if 2 * np.sum(crosses) > len(U):
        raise DataError(
            f"{np.sum(crosses)} of {len(U)} samples move across the constraint, so they were not recorded under it: "
            "leave out constraint=, or give the recordings that it is of"
        )
    N[crosses] = np.nan
    known = demos.projections
    if known is not None:
        told = ~np.isnan(known).any(axis=(1, 2))
        N[told] = known[told]
    note = f"{np.sum(crosses)} of {len(U)} samples move across the constraint, and are taken for not known"
    return replace(demos, projections=N, notes=(*demos.notes, note) if crosses.any() else demos.notes)
