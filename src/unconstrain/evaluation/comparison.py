"""How much better a policy predicts held-out recordings than the same model fitted with another risk.

All risks are fitted to the same samples and judged on the same held-out episodes by the same measure, that of what
these samples show as inferred by the adaptive one (`judging`).
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import clone

from unconstrain.demonstrations import Demonstrations
from unconstrain.diagnostics import identifiability
from unconstrain.errors import PolicyError
from unconstrain.evaluation.evaluation import REGRESSION, Evaluation, score_still
from unconstrain.evaluation.findings import collect
from unconstrain.evaluation.scores import find_typical, score
from unconstrain.evaluation.verdict import conclude
from unconstrain.fitting.inference import FREE
from unconstrain.judging import Judge
from unconstrain.policies.base import Policy
from unconstrain.selection import Row, Table, select_policy
from unconstrain.waiting import stage

COMPARED = ("adaptive", "inconsistency", "direct")
"""Risks that every policy is compared with: what its samples show is inferred, none of them is free, or all are."""

NOTICEABLE = 0.01
"""A held-out error that is lower by less than this share is called no better: rounding reaches so far."""

ROUNDING = 1e-6
"""What may be left unexplained by a policy that nothing is better than."""

SURE, MUCH = 2.0, 0.5
"""Standard errors, over folds, by which it must be lower too, as in a fold or two anything may happen; unless it is
lower by this share in the middle one."""


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
    policies : dict of str to Policy
        By risk, those that could be fitted; each knows ordinary regression.
    predictions : dict of str to ndarray of shape (N, d)
        Their predictions of actions held out.
    judge : Judge
        By which all of them were judged.
    chosen : Table or None
        How the policy was chosen, if it was.
    """

    policy: Policy
    rows: dict[str, Row]
    measure: str
    policies: dict[str, Policy] = field(repr=False)
    predictions: dict[str, np.ndarray] = field(repr=False)
    judge: Judge = field(repr=False)
    chosen: Table | None = None

    @property
    def kept(self) -> Row:
        """How well the policy itself predicts held-out samples."""
        return self.rows[self.policy.risk]

    @property
    def better(self) -> str | None:
        """The risk of least held-out error among those that are better than the policy's own, if there are.

        Another has to be surely better; but ordinary regression, the simplest, only has to explain more of what is
        shown, in all and in the middle fold: that measure forgives what was inferred to be constrained, and a policy
        that loses by it all the same has inferred what is not there.
        """
        if self.kept.explained > 1 - ROUNDING:
            return None
        beaten_by = [
            risk
            for risk, row in self.rows.items()
            if row is not self.kept
            and row.problem is None
            and (_is_surely_better(row, self.kept) or (risk == "direct" and _explains_more(row, self.kept)))
        ]
        return min(beaten_by, key=lambda risk: self.rows[risk].error, default=None)

    def taking(self, risk: str) -> "Comparison":
        """Return the same comparison with the policy of another risk as its own."""
        return replace(self, policy=self.policies[risk])


def _explains_more(one: Row, other: Row) -> bool:
    shares = (
        (one.explained, other.explained),
        (np.median(one.explained_by_fold), np.median(other.explained_by_fold)),
    )
    return all(own > rival + NOTICEABLE for own, rival in shares)


def _is_surely_better(one: Row, other: Row) -> bool:
    if not one.error < other.error - NOTICEABLE * abs(other.error):
        return False
    if np.median(one.by_fold) < MUCH * np.median(other.by_fold):  # a single fold may go wrong without bounds
        return True
    gains = np.subtract(other.by_fold, one.by_fold)
    return bool(gains.mean() > SURE * gains.std(ddof=1) / np.sqrt(len(gains)))


@stage("comparing risks")
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
    _tell_regression(result.policies)
    return Comparison(
        result.policies[policy.risk],
        rows,
        result.table.measure,
        result.policies,
        result.predictions,
        result.judge,
        chosen,
    )


def _tell_regression(policies: dict[str, Policy]) -> None:
    """Let every policy know ordinary regression, so that it can be held against that later."""
    direct = policies.get("direct")
    for policy in policies.values():
        if direct is not None and policy.ordinary_regression() is None:
            known = replace(direct.solution_, alphas=None, held_out_risk=None)
            policy.solution_ = replace(
                policy.solution_, record=replace(policy.solution_.record, regression=known)
            )


@stage("evaluating")
def evaluate_held_out(
    compared: Comparison,
    demos: Demonstrations,
    *,
    stable: Policy | None = None,
    label: str = "taken",
    without: Collection[str] = (),
    progress: Callable[[str], None] | None = None,
) -> Evaluation:
    """Say what held-out episodes of the recordings that were learnt from tell of a policy.

    Parameters
    ----------
    compared : Comparison
        Of these recordings.
    demos : Demonstrations
        N samples.
    stable : Policy, optional
        The policy made to end at its goal, which is followed in its place.
    label : str
        What becomes of the policy, for its line of the table.
    without : collection of str
        Options that the recordings were read with, which are not tried as what is missing; see `evaluate`.
    progress : callable, optional
        Called with what is being done.

    Returns
    -------
    Evaluation
        The policy, the other risks, standing still, and a verdict.
    """
    policy, judge = compared.policy, compared.judge
    U = policy.scaled(demos.actions)
    likelihoods = _list_likelihoods(compared)
    kept = policy.risk
    scores = {
        risk: score(
            _name(risk, label, is_kept=risk == kept),
            U,
            policy.scaled(compared.predictions[risk]),
            judge,
            likelihoods.get(risk, np.nan),
        )
        for risk in sorted(compared.rows, key=lambda risk: risk != kept)  # the one that is kept first
        if risk in compared.predictions
    }
    # By ordinary regression, to which all was free, everything is.
    determined = None if kept == "direct" else identifiability(policy, demos).determined_share
    policy.determined_share_ = determined  # for later evaluations
    found = collect(
        policy if stable is None else stable,
        demos,
        "held-out episodes" if demos.n_episodes > 1 else "held-out blocks",
        judge=judge,
        own=scores[kept],
        regression=scores.get("direct"),
        typical=find_typical(U, policy.scaled(compared.predictions[kept]), judge, demos.episodes),
        free=None if policy.solution_.belief is None else scores[kept].free,
        determined=determined,
        without=without,
        progress=progress,
    )
    rows = (*scores.values(), score_still(U, judge))
    return Evaluation(rows, scores.get("direct"), conclude(found))


def _list_likelihoods(compared: Comparison) -> dict[str, float]:
    """List the held-out log-likelihoods of a sample that are known, by risk."""
    adaptive = compared.policies.get("adaptive")
    if adaptive is None:
        return {}
    return {"adaptive": adaptive.log_likelihood_, "direct": adaptive.log_likelihoods_.get(FREE, np.nan)}


def _name(risk: str, label: str, *, is_kept: bool) -> str:
    name = REGRESSION if risk == "direct" else risk
    return f"{name} ({label})" if is_kept else name
