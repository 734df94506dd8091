"""How much better a policy predicts held-out recordings than the same model fitted with another risk.

All risks are fitted to the same samples and judged on the same held-out episodes by the same measure, that of what
these samples show as inferred by the adaptive one (`judging`).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import clone

from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import PolicyError
from unconstrain.policies.base import Policy
from unconstrain.selection import Row, Table, select_policy

COMPARED = ("adaptive", "inconsistency", "direct")
"""Risks that every policy is compared with: what its samples show is inferred, none of them is free, or all are."""

NOTICEABLE = 0.01
"""A held-out error that is lower by less than this share is called no better: rounding reaches so far."""

SURE, MUCH = 2.0, 0.5
"""Standard errors, over folds, by which it must be lower too, as in a fold or two anything may happen; unless it is
lower by this share."""


@dataclass(frozen=True)
class Comparison:
    """A policy, fitted, beside its model with the other risks.

    Attributes
    ----------
    policy : Policy
        Fitted to all samples.
    rows : dict of str to Row
        How well each risk predicts held-out samples: ordinary regression after those that know of constraints, and the
        policy's own risk last if it is "corrected"; a row's `problem` says so if its risk
        could not be fitted.
    measure : str
        What all are judged by, in words.
    chosen : Table or None
        How the policy was chosen, if it was.
    """

    policy: Policy
    rows: dict[str, Row]
    measure: str
    chosen: Table | None = None

    @property
    def kept(self) -> Row:
        """How well the policy itself predicts held-out samples."""
        return self.rows[self.policy.risk]

    @property
    def better(self) -> str | None:
        """The risk of least held-out error among those that are surely better than the policy's own, if there are."""
        beaten_by = [
            risk for risk, row in self.rows.items() if row is not self.kept and _is_better(row, self.kept)
        ]
        return min(beaten_by, key=lambda risk: self.rows[risk].error, default=None)


def _is_better(one: Row, other: Row) -> bool:
    if one.problem is not None or not one.error < other.error - NOTICEABLE * abs(other.error):
        return False
    if one.error < MUCH * other.error:
        return True
    gains = np.subtract(other.by_fold, one.by_fold)
    return bool(gains.mean() > SURE * gains.std(ddof=1) / np.sqrt(len(gains)))


def compare_risks(
    policy: Policy | None,
    X: ArrayLike | Demonstrations,
    U: ArrayLike | None = None,
    groups: ArrayLike | None = None,
    *,
    projections: ArrayLike | None = None,
    progress: Callable[[Row], None] | None = None,
) -> Comparison:
    """Fit a policy, and its model with the other risks, and judge all on held-out episodes.

    Parameters
    ----------
    policy : Policy or None
        What to fit; it is cloned. With None, `select_policy` chooses among its own candidates first.
    X : array_like of shape (N, n), or Demonstrations
        States. Demonstrations bring their actions, episodes, known projections, space and noise.
    U : array_like of shape (N, d)
        Actions.
    groups : array_like of shape (N,), optional
        Episodes, which are held out whole; without them contiguous blocks are.
    projections : array_like of shape (N, d, d), optional
        What is known of the constraints, NaN where nothing is.
    progress : callable, optional
        Called with the `Row` of each candidate once it is fitted.

    Returns
    -------
    Comparison
        All of them, on the same held-out episodes.

    Raises
    ------
    PolicyError
        The policy cannot be fitted to these samples.
    DataError
        The arrays cannot be used.
    """
    chosen = None
    if policy is None:
        found = select_policy("auto", X, U, groups, projections=projections, progress=progress)
        policy, chosen = found.policy, found.table
    policy.check_options()
    risks = dict.fromkeys((*COMPARED, policy.risk))
    by_risk = {risk: clone(policy).set_params(risk=risk) for risk in risks}
    result = select_policy(by_risk, X, U, groups, projections=projections, progress=progress)
    problem = result.table[policy.risk].problem
    if problem is not None:
        raise PolicyError(problem)
    rows = {risk: result.table[risk] for risk in risks}
    return Comparison(result.policies[policy.risk], rows, result.table.measure, chosen)
