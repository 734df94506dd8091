"""A policy held against recordings that it has not seen, beside ordinary regression and standing still."""

import math
from collections.abc import Callable, Collection
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import clone
from sklearn.utils.validation import check_is_fitted

from unconstrain import metrics
from unconstrain.constraints.nullspace import in_metric
from unconstrain.demonstrations import Demonstrations
from unconstrain.diagnostics import identifiability
from unconstrain.errors import DataError, PolicyError
from unconstrain.evaluation.contact import Contact, find_contact
from unconstrain.evaluation.findings import collect
from unconstrain.evaluation.scores import Score, find_typical, gaussian_log_likelihood, score
from unconstrain.evaluation.verdict import Verdict, conclude
from unconstrain.judging import OF_WHAT_IS_SHOWN, Judge
from unconstrain.notebook import format_sentences, format_table
from unconstrain.policies.base import Policy
from unconstrain.policies.inputs import as_demonstrations
from unconstrain.selection import select_policy
from unconstrain.waiting import stage

if TYPE_CHECKING:
    import pandas

NOISIER = 3.0
"""By how much the noise has to be larger than in the recordings learnt from, for a remark."""

NONSENSE = 10.0
"""Shares explained that are below minus this are written without decimals."""

POLICY, REGRESSION, STILL = "policy", "ordinary regression", "standing still"
COLUMNS = (
    "",
    "samples",
    "free",
    "error (rms)",
    "angle",
    "whole action explained",
    "what is shown explained",
    "likelihood (log)",
)


@dataclass(frozen=True)
class Evaluation:
    """How a policy predicts recordings that it has not learnt from.

    It prints as a table and a verdict.

    Parameters
    ----------
    scores : tuple of Score
        The policy first, then what it is held against: ordinary regression, other risks, standing still.
    regression : Score or None
        That of ordinary regression, which is the policy's own if it is that; None where it could not be fitted.
    verdict : Verdict
        What it comes to.
    episodes : tuple of Score
        The policy's on each of the first episodes, where there are several.
    n_more : int
        Episodes besides these.
    free_rmse : float
        Root mean square error of the policy's whole action where samples were free; NaN where none was.
    nupe : float or None
        The normalised error against the true policy, where the recordings carry it.
    remarks : tuple of str
        What else a reader should know of the figures, a sentence each.
    """

    scores: tuple[Score, ...]
    regression: Score | None
    verdict: Verdict
    episodes: tuple[Score, ...] = ()
    n_more: int = 0
    free_rmse: float = math.nan
    nupe: float | None = None
    remarks: tuple[str, ...] = ()

    @property
    def policy(self) -> Score:
        """The policy's own errors, on all samples."""
        return self.scores[0]

    def rows(self) -> list[tuple[str, ...]]:
        """List the cells of the table under `COLUMNS`.

        Returns
        -------
        list of tuple of str
            A row an episode, then one a policy.
        """
        rows = [_cells(each) for each in self.episodes]
        if self.n_more:
            rows.append((f"... {self.n_more} more", *[""] * (len(COLUMNS) - 1)))
        return [*rows, *(_cells(each) for each in self.scores)]

    def sentences(self) -> list[str]:
        """List what is to be said below the table.

        Returns
        -------
        list of str
            Remarks, and the verdict last.
        """
        said = list(self.remarks)
        if math.isfinite(self.free_rmse) and self.policy.free < 1:
            said.append(f"root mean square error of the action where samples were free: {self.free_rmse:.4g}")
        if self.nupe is not None:
            said.append(f"these recordings carry the true policy: nUPE {self.nupe:.4g}")
        return [*said, f"verdict: {self.verdict}"]

    def to_pandas(self) -> "pandas.DataFrame":
        """Return the table as a data frame.

        Returns
        -------
        pandas.DataFrame
            A row an episode and a policy, indexed by name; columns are the fields of `Score`.

        Raises
        ------
        PolicyError
            pandas is not installed.
        """
        try:
            import pandas
        except ImportError:
            raise PolicyError("to_pandas needs pandas: pip install pandas") from None
        rows = [asdict(each) for each in (*self.episodes, *self.scores)]
        return pandas.DataFrame(rows).set_index("name")

    def __str__(self) -> str:
        widths = [max(len(row[i]) for row in (COLUMNS, *self.rows())) for i in range(len(COLUMNS))]
        lines = [COLUMNS, tuple("-" * width for width in widths), *self.rows()]
        table = [
            "| " + " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) + " |"
            for line in lines
        ]
        return "\n".join([*table, "", *self.sentences()])

    def _repr_html_(self) -> str:
        return format_table(COLUMNS, self.rows()) + format_sentences(self.sentences())


@stage("evaluating")
def evaluate(
    policy: Policy,
    X: Demonstrations | ArrayLike,
    U: ArrayLike | None = None,
    *,
    groups: ArrayLike | None = None,
    most_episodes: int = 20,
    without: Collection[str] = (),
    progress: Callable[[str], None] | None = None,
) -> Evaluation:
    """Hold a policy against recordings that it has not learnt from.

    Parameters
    ----------
    policy : Policy
        Fitted, to others.
    X : Demonstrations, or array_like of shape (N, n)
        Recordings, or their states.
    U : array_like of shape (N, d), optional
        Actions, beside states.
    groups : array_like of shape (N,), optional
        Episodes, beside states.
    most_episodes : int
        How many episodes are listed by themselves.
    without : collection of str
        Options that the recordings were read with, which are not tried as what is missing: "relative_to",
        "moving_centre", "order", "phase".
    progress : callable, optional
        Called with what is being done.

    Returns
    -------
    Evaluation
        Errors of the policy, of ordinary regression by the same model, and of standing still; and a verdict.

    Raises
    ------
    DataError
        The recordings have other numbers of states or actions than the policy, or the arrays cannot be used.
    PolicyError
        It is no fitted policy of this library.

    Notes
    -----
    Ordinary regression is that of the samples that the policy has learnt from, where it knows it
    (`Policy.ordinary_regression`). Otherwise it is learnt from these recordings alone, each episode predicted by the
    others, and that is said.

    Examples
    --------
    >>> import unconstrain as uc
    >>> from unconstrain.limit_cycle import demonstrate
    >>> policy = uc.ParametricPolicy(uc.NormalizedRBF()).fit(demonstrate(20, random_state=0))
    >>> found = uc.evaluate(policy, demonstrate(5, random_state=1))
    >>> found.policy.shown > 0.97 > 0.7 > found.regression.shown
    True
    """
    if not isinstance(policy, Policy):
        raise PolicyError(f"evaluate is about a policy of unconstrain, got {type(policy).__name__}")
    check_is_fitted(policy)
    demos = as_demonstrations(X, U, groups)
    if demos.states.shape[1] != policy.n_features_in_ or demos.actions.shape[1] != policy.n_actions_:
        raise DataError(
            f"the policy maps {policy.n_features_in_} states to {policy.n_actions_} actions, but the recordings have "
            f"{demos.states.shape[1]} and {demos.actions.shape[1]}: choose the columns it was learnt from"
        )
    U = policy.scaled(demos.actions)
    P = policy.scaled(policy.predict(demos.states).reshape(U.shape))
    contact = find_contact(policy, demos)
    free = contact.free
    judge = Judge(OF_WHAT_IS_SHOWN, free, _projections(policy, demos))
    remarks = [*_describe_noise(policy, contact)]
    if len(demos) == policy.n_samples_seen_:
        remarks.append(
            f"these are {len(demos)} samples, as many as it was learnt from: if they are the same, this says "
            "nothing of others"
        )
    regression, said = _score_regression(policy, demos, U, judge)
    remarks += said
    total = score(POLICY, U, P, judge, contact.log_likelihood)
    several = demos.n_episodes > 1
    labels = demos.episode_labels[:most_episodes] if several else ()
    episodes = [score(label, U, P, judge, rows=demos.episodes == code) for code, label in enumerate(labels)]
    nupe = None
    if demos.policy is not None:
        true = policy.scaled(demos.policy)
        nupe = metrics.normalized(metrics.unconstrained_policy_error(true, P), true)
    found = collect(
        policy,
        demos,
        "these recordings",
        judge=judge,
        own=total,
        regression=regression,
        typical=find_typical(U, P, judge, demos.episodes),
        free=float(free.mean()) if policy.solution_.belief is not None else None,
        determined=_find_determined(policy),
        without=without,
        progress=progress,
    )
    return Evaluation(
        (total, regression, score_still(U, judge)),
        regression,
        conclude(found),
        tuple(episodes),
        demos.n_episodes - len(labels) if several else 0,
        float(np.sqrt(metrics.free_error(U, P, free))) if free.any() and np.isfinite(P).all() else math.nan,
        nupe,
        tuple(remarks),
    )


def score_still(U: np.ndarray, judge: Judge) -> Score:
    """Score what never moves, the floor of every comparison.

    Parameters
    ----------
    U : ndarray of shape (N, d)
        Recorded actions.
    judge : Judge
        Of these samples.

    Returns
    -------
    Score
        Nothing explained.
    """
    P = np.zeros_like(U)
    return score(STILL, U, P, judge, gaussian_log_likelihood(U, P))


def _score_regression(
    policy: Policy, demos: Demonstrations, U: np.ndarray, judge: Judge
) -> tuple[Score, list[str]]:
    known = policy.ordinary_regression()
    if known is not None:
        P = policy.scaled(known.predict(demos.states).reshape(U.shape))
        return score(REGRESSION, U, P, judge, gaussian_log_likelihood(U, P)), []
    here = f"{REGRESSION} of these"
    direct = clone(policy).set_params(risk="direct")
    try:
        found = select_policy([direct], demos, groups=demos.folds())
    except (DataError, PolicyError) as error:
        nothing = np.full_like(U, np.nan)
        return score(REGRESSION, U, nothing, judge), [f"ordinary regression could not be compared: {error}"]
    P = policy.scaled(next(iter(found.predictions.values())))
    remark = (
        "the policy does not know ordinary regression of what it was learnt from, so that was learnt from these "
        "recordings alone, each episode predicted by the others"
    )
    return score(here, U, P, judge, gaussian_log_likelihood(U, P)), [remark]


def _describe_noise(policy: Policy, contact: Contact) -> list[str]:
    belief = policy.solution_.belief
    if belief is None:
        return []
    before = float(np.sqrt(belief.noise.action))
    if contact.noise <= NOISIER * before:
        return []
    return [
        f"the policy misses these recordings by more than those it was learnt from, {contact.noise:.3g} against "
        f"{before:.3g}: they are noisier, go where it has not been, or show something else"
    ]


def _find_determined(policy: Policy) -> float | None:
    """Return the share of the policy that what it was learnt from determines, where it is known or can be found."""
    if policy.determined_share_ is not None or policy.risk == "direct":
        return policy.determined_share_
    try:
        return identifiability(policy).determined_share
    except (PolicyError, DataError):  # it was saved without its sums
        return None


def _projections(policy: Policy, demos: Demonstrations) -> np.ndarray | None:
    """Return the projections that are known, in the metric of the policy; ordinary regression knows of none."""
    scale, known = policy.model_.scale, demos.projections
    if known is None or policy.risk == "direct":
        return None
    return known if scale is None else in_metric(known, scale)


def _cells(each: Score) -> tuple[str, ...]:
    def share(value: float) -> str:
        if math.isnan(value):
            return ""
        return f"{value:.0%}" if value < -NONSENSE else f"{round(value, 6) + 0.0:.2%}"

    return (
        each.name,
        str(each.n_samples),
        f"{each.free:.2f}",
        f"{each.rmse:.4g}",
        "" if math.isnan(each.angle) else f"{math.degrees(each.angle):.3g}°",
        share(each.whole) or "nothing moves",
        share(each.shown),
        "" if math.isnan(each.log_likelihood) else f"{each.log_likelihood:.4g}",
    )
