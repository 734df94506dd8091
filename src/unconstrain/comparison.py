"""How much better a policy predicts held-out recordings than the same model fitted with another risk.

Ordinary regression, the risk "direct", is what a policy learnt by inconsistency is to be compared with, and the other
way round: both are fitted to the same samples and judged on the same held-out episodes by the same measure.
"""

from collections.abc import Callable
from dataclasses import dataclass

from numpy.typing import ArrayLike
from sklearn.base import clone

from unconstrain.errors import PolicyError
from unconstrain.policies.base import Policy
from unconstrain.selection import Row, Table, select_policy

NOTICEABLE = 0.01
"""A held-out error that is lower by less than this share is called no better: rounding reaches so far."""


@dataclass(frozen=True)
class Comparison:
    """A policy, fitted, beside its model with the other risk.

    Attributes
    ----------
    policy : Policy
        Fitted to all samples.
    kept : Row
        How well it predicts held-out samples.
    other : Row
        How well its model with the other risk does; its `problem` says so if that could not be fitted.
    other_risk : str
        "direct", or "inconsistency" where the policy's own risk is "direct".
    measure : str
        What both are judged by, in words.
    chosen : Table or None
        How the policy was chosen, if it was.
    """

    policy: Policy
    kept: Row
    other: Row
    other_risk: str
    measure: str
    chosen: Table | None = None

    @property
    def is_beaten(self) -> bool:
        """Whether the other risk's held-out error is lower, by more than `NOTICEABLE`."""
        return self.other.inconsistency < (1.0 - NOTICEABLE) * self.kept.inconsistency

    def by_risk(self) -> dict[str, Row]:
        """Return both rows by their risk, ordinary regression last."""
        both = {self.policy.risk: self.kept, self.other_risk: self.other}
        return dict(sorted(both.items(), key=lambda item: item[0] == "direct"))


def compare_risks(
    policy: Policy | None,
    X: ArrayLike,
    U: ArrayLike,
    groups: ArrayLike | None = None,
    *,
    projections: ArrayLike | None = None,
    progress: Callable[[Row], None] | None = None,
) -> Comparison:
    """Fit a policy, and its model with the other risk, and judge both on held-out episodes.

    Parameters
    ----------
    policy : Policy or None
        What to fit; it is cloned. With None, `select_policy` chooses among its own candidates first.
    X : array_like of shape (N, n)
        States.
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
        Both, on the same held-out episodes.

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
    other_risk = "inconsistency" if policy.risk == "direct" else "direct"
    kept, other = policy.risk, other_risk
    pair = {kept: clone(policy), other: clone(policy).set_params(risk=other_risk)}
    result = select_policy(pair, X, U, groups, projections=projections, progress=progress)
    if result.table[kept].problem:
        raise PolicyError(str(result.table[kept].problem))
    return Comparison(
        result.policies[kept],
        result.table[kept],
        result.table[other],
        other_risk,
        result.table.measure,
        chosen,
    )
