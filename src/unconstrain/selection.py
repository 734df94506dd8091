"""Choosing among policies by what they predict of episodes held out, which needs nothing but recordings.

Every candidate that is linear in its parameters is fitted once, its samples added up by fold. Leaving a fold out is a
subtraction of its moments, so the solution without fold k, with λ chosen anew among the other folds, costs no
second pass over the data; candidates of other kinds are fitted anew without each fold. The predictions for the
episodes of fold k are compared with their actions, and all folds' errors are pooled.

All candidates are judged by one measure (`judging`): which samples were free is taken, fold by fold, from the one whose
held-out likelihood is largest among those that infer it. By their inconsistency alone, candidates that learn only along
the motion would be preferred where recordings are free and noisy, since all they miss lies across it.

The folds are the same for all candidates. What features take from the states alone (centres, knots, ranges) they
take from all of them, as one fit does, and so does the inference of contact: a held-out action is judged by parameters
that were solved without it. No true policy is used: that the candidate with the least error is also the one nearest to
the true policy is likely, not certain, since directions that no episode ever moved in are not judged. Where projections
of some samples are known, their error is that under the constraint, which judges more of the policy.
"""

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import clone

from unconstrain import metrics
from unconstrain.arrays import (
    check_actions,
    check_groups,
    check_lets_through,
    check_number,
    check_projections,
    check_samples,
    quote,
)
from unconstrain.constraints.nullspace import in_metric
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import PolicyError
from unconstrain.features import DecoupledFeatures, NormalizedRBF, PotentialFeatures
from unconstrain.fitting.completion import ByBelief
from unconstrain.fitting.contact import judge
from unconstrain.fitting.in_space import in_units
from unconstrain.fitting.solve import EpisodeFolds, splits
from unconstrain.judging import (
    CORRECTED,
    INCONSISTENCY,
    OF_WHAT_IS_KNOWN,
    OF_WHAT_IS_SHOWN,
    OF_WHOLE_ACTIONS,
    Judge,
)
from unconstrain.notebook import format_sentences, format_table
from unconstrain.policies.base import Policy
from unconstrain.policies.inputs import unpack_demonstrations
from unconstrain.policies.linear import LinearPolicy
from unconstrain.policies.locally_linear import LocallyLinearPolicy
from unconstrain.policies.parametric import ParametricPolicy
from unconstrain.samples import Samples
from unconstrain.spaces import Space
from unconstrain.waiting import each, stage

# What a default candidate may have: a cross-validated fit then takes seconds to solve, whatever the dimension.
MOST_PARAMETERS = 1000
MOST_CENTERS = 50
COARSE_KNOTS = 15

LEAST_SHARE = 1e-6
"""Of the variance found by a fit: as much is left to that of what was held out."""


@dataclass(frozen=True)
class Row:
    """One candidate's line of the comparison.

    Parameters
    ----------
    name : str
        Of the candidate.
    error : float
        Mean over held-out samples, in squared units of the action, by the table's measure; NaN where the candidate
        failed, or is not judged yet.
    standard_error : float
        Of the error, over folds. Candidates share the folds, so differences are surer than it says.
    explained : float
        Share of held-out motion explained, as shown: `1 - Σ [γ ‖u - p‖² + (1 - γ) (r - û·p)²] / Σ r²`.
    alpha : float
        Weight decay λ, as chosen on all the data; NaN where there is none.
    n_parameters : int
        Of all actions together, of each local model; 0 where a policy is not linear in any.
    seconds : float
        To fit and to hold out.
    problem : str, optional
        Why the candidate could not be fitted.
    log_likelihood : float
        Of a held-out sample, where the candidate infers which samples were free.
    by_fold, explained_by_fold : tuple of float
        Mean error, and share explained, in each fold.
    """

    name: str
    error: float = np.nan
    standard_error: float = np.nan
    explained: float = np.nan
    alpha: float = np.nan
    n_parameters: int = 0
    seconds: float = 0.0
    problem: str | None = None
    log_likelihood: float = np.nan
    by_fold: tuple[float, ...] = ()
    explained_by_fold: tuple[float, ...] = ()


@dataclass(frozen=True)
class Table:
    """The comparison.

    Parameters
    ----------
    rows : tuple of Row
        The candidate with the least error first, and the failed ones last.
    measure : str
        What the candidates are judged by.
    """

    rows: tuple[Row, ...]
    measure: str = INCONSISTENCY

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)

    def __getitem__(self, name: str) -> Row:
        """Return the row of the candidate of that name."""
        for row in self.rows:
            if row.name == name:
                return row
        raise KeyError(name)

    def __str__(self) -> str:
        """Format a Markdown table, its columns aligned."""
        lines = [self._head, *(_cells(row) for row in self.rows if row.problem is None)]
        widths = [max(len(line[i]) for line in lines) for i in range(len(self._head))]
        text = [_line([c.ljust(w) for c, w in zip(line, widths, strict=True)]) for line in lines]
        text.insert(1, _line(["-" * w for w in widths]))
        failed = self._failed
        return "\n".join([*text, *([""] if failed else []), *failed])

    def to_html(self) -> str:
        """Format a table in HTML, which notebooks show.

        Returns
        -------
        str
            HTML.
        """
        rows = (_cells(row) for row in self.rows if row.problem is None)
        return format_table(self._head, rows) + format_sentences(self._failed)

    def _repr_html_(self) -> str:
        return self.to_html()

    @property
    def _head(self) -> tuple[str, ...]:
        return ("candidate", self.measure, "explained", "λ", "parameters", "seconds")

    @property
    def _failed(self) -> list[str]:
        return [f"{row.name}: {row.problem}" for row in self.rows if row.problem is not None]


@dataclass(frozen=True)
class Selection:
    """What `select_policy` found.

    Parameters
    ----------
    policy : Policy
        The chosen one, fitted to all the data.
    name : str
        Its name.
    table : Table
        The comparison.
    policies : dict
        All candidates that could be fitted, fitted to all the data, by name.
    predictions : dict of ndarray of shape (N, d)
        Their predictions of held-out actions, by name.
    judge : Judge
        By which they were judged.
    """

    policy: Policy
    name: str
    table: Table
    policies: dict[str, Policy] = field(repr=False)
    predictions: dict[str, np.ndarray] = field(repr=False)
    judge: Judge = field(repr=False)

    def __str__(self) -> str:
        return f"{self.table}\n\nchosen: {self.name}"

    def _repr_html_(self) -> str:
        return self.table.to_html() + format_sentences([f"chosen: {self.name}"])


def candidates(n: int, d: int) -> dict[str, Policy]:
    """Make the candidates of "auto", which infer what was free, and choose λ by cross-validation.

    Numbers of centres and knots shrink with the dimension, so that solving stays a matter of seconds; splines, where
    even the fewest knots are too many, are left out. Those that pair actions with states are there where n = d.

    Parameters
    ----------
    n, d : int
        Numbers of states and actions.

    Returns
    -------
    dict of Policy
        By name.
    """
    from sklearn.preprocessing import SplineTransformer

    # Each local model solves for d (n + 1) numbers by itself, which costs their cube.
    models = np.clip(MOST_PARAMETERS**3 // (d * (n + 1)) ** 3, 1, MOST_CENTERS)
    centers = np.clip(MOST_PARAMETERS // d, 2, MOST_CENTERS)
    named: dict[str, Policy] = {
        "linear": ParametricPolicy(),
        "locally linear": LocallyLinearPolicy(n_centers=int(models)),
        "RBF": ParametricPolicy(NormalizedRBF(int(centers))),
    }
    knots = min(7, MOST_PARAMETERS // (n * d) - 2)
    if knots >= 2:
        named["splines"] = ParametricPolicy(SplineTransformer(n_knots=knots, extrapolation="linear"))
    if n == d:
        # Fine knots for policies with a corner, such as ∇|x|^1.5; coarse ones where data are few or dimensions many.
        fine = DecoupledFeatures()
        if n * (fine.n_knots + fine.degree - 1) <= MOST_PARAMETERS:
            named["decoupled"] = ParametricPolicy(fine)
        named["decoupled, coarse"] = ParametricPolicy(DecoupledFeatures(COARSE_KNOTS))
        named["potential"] = ParametricPolicy(PotentialFeatures(NormalizedRBF(2 * MOST_CENTERS)))
    return named


def select_policy(
    candidates: str | Sequence[Policy] | Mapping[str, Policy],
    X: ArrayLike | Demonstrations,
    U: ArrayLike | None = None,
    groups: ArrayLike | None = None,
    *,
    projections: ArrayLike | None = None,
    n_jobs: int | None = None,
    progress: Callable[[Row], None] | None = None,
) -> Selection:
    """Choose the candidate with the least error on held-out episodes, and fit it to all the data.

    The error is that of what held-out samples show: of the whole action as far as a sample was free, of what lies
    along the motion otherwise. Which samples were free is inferred, by the likeliest candidate with the risk
    "adaptive"; where there is none, and risks differ, by one made of the candidate that is least inconsistent.
    Candidates that all have the risk "inconsistency" are judged by their inconsistency, those that all have
    "corrected" by the same less what noise adds (the least that any of them finds), and those that all have "direct" by
    whole actions.

    Parameters
    ----------
    candidates : "auto", or list or dict of Policy
        Policies in a list are named after themselves, in a dict by their keys; "auto" stands for those that
        `candidates(n, d)` makes. They are cloned, never changed.
    X : array_like of shape (N, n), or Demonstrations
        States. Demonstrations bring their actions, episodes, known projections and noise.
    U : array_like of shape (N, d)
        Actions.
    groups : array_like of shape (N,), optional
        Episodes, which are held out whole; without them contiguous blocks are.
    projections : array_like of shape (N, d, d), optional
        The nullspace projections, all NaN where one is not known. Candidates are then judged by the error under them,
        and those with other risks than "direct" learn from them.
    n_jobs : int, optional
        Candidates fitted at a time, in threads (joblib; most of the work is in BLAS and LAPACK).
    progress : callable, optional
        Called with each candidate's `Row` once it is fitted, in the order given. Errors are there only once all are.

    Returns
    -------
    Selection
        A candidate that cannot be fitted to these data is listed with the reason.

    Raises
    ------
    PolicyError
        None of the candidates can be fitted, or one is not a policy.
    DataError
        The arrays do not fit together, there is one episode alone, or nothing moves.

    Examples
    --------
    >>> import numpy as np, unconstrain as uc
    >>> X = np.random.default_rng(0).normal(size=(200, 2))
    >>> N = uc.constraints.projection(np.random.default_rng(1).normal(size=(200, 1, 2)))
    >>> U = np.einsum("nij,nj->ni", N, -np.tanh(X))
    >>> uc.select_policy("auto", X, U).name
    'decoupled, coarse'
    """
    import joblib

    known = (X.space, X.noise) if isinstance(X, Demonstrations) else (None, None)
    states, U, groups, projections = unpack_demonstrations(X, U, groups, projections)
    X, U = check_samples(ParametricPolicy(), states, U, reset=True, min_samples=2)
    actions, groups = check_actions(U), check_groups(groups, len(X))
    named = _told(_name_candidates(candidates, X.shape[1], actions.shape[1]), *known)
    if projections is not None:
        projections = check_projections(projections, *actions.shape, unknown=True)
        check_lets_through(projections, actions)
    # What no candidate could be judged on is told here, as the mistake it is, and not as each one's failure.
    next(splits(len(X), groups))
    metrics.explained(actions, np.zeros_like(actions))

    parallel = joblib.Parallel(n_jobs=n_jobs, prefer="threads", return_as="generator")
    rows, held_out = [], {}
    fitting = parallel(
        joblib.delayed(_try)(name, policy, X, U, groups, projections) for name, policy in named.items()
    )
    with stage("fitting policies", len(named), "fitted") as report:
        for row, found in fitting:
            rows.append(row)
            report(len(rows), len(named))
            if found is not None:
                held_out[row.name] = found
            if progress is not None:
                progress(row)
    problems = [row.problem for row in rows]
    if not held_out:
        if len(set(problems)) == 1:
            raise PolicyError(str(problems[0]))
        raise PolicyError(
            f"none of the candidates could be fitted; the first, {rows[0].name}: {rows[0].problem}"
        )
    # All are judged in one metric, that of the first: the same for all unless they were given different scales.
    metric = next(iter(held_out.values())).policy
    judge = _choose_judge(held_out, metric, X, U, groups, projections)
    rows = [
        _judge(row, held_out[row.name], judge, metric, actions) if row.problem is None else row
        for row in rows
    ]
    rows.sort(key=lambda row: (row.problem is not None, row.error))
    policies = {name: found.policy for name, found in held_out.items()}
    return Selection(
        policies[rows[0].name],
        rows[0].name,
        Table(tuple(rows), judge.measure),
        policies,
        {name: found.predictions for name, found in held_out.items()},
        judge,
    )


def _told(named: dict[str, Policy], space: Space | None, noise: float | None) -> dict[str, Policy]:
    """Tell candidates that do not know it what the states of demonstrations are, and the noise of their actions."""
    told = {}
    for name, policy in named.items():
        more: dict[str, Any] = {}
        if policy.space is None and space is not None and not space.is_flat:
            more["space"] = space
        if policy.noise is None and policy.scale is None and noise is not None:
            more["noise"] = noise
        told[name] = clone(policy).set_params(**more) if more else policy
    return told


@dataclass(frozen=True)
class _HeldOut:
    """A candidate, and what it says of samples that it has not learnt from."""

    policy: Policy
    predictions: np.ndarray
    fold: np.ndarray
    free: np.ndarray | None = None
    noise: float | None = None
    log_likelihood: float = np.nan


def _name_candidates(
    given: str | Sequence[Policy] | Mapping[str, Policy], n: int, d: int
) -> dict[str, Policy]:
    if isinstance(given, str):
        if given != "auto":
            raise PolicyError(
                f'candidates must be policies, in a list or a dict by name, or "auto", got {quote(given)}'
            )
        return candidates(n, d)
    if not isinstance(given, Iterable) or isinstance(given, np.ndarray):
        raise PolicyError(
            f'candidates must be policies, in a list or a dict by name, or "auto", got {quote(given)}'
        )
    named: dict[str, Policy] = {}
    for key, policy in given.items() if isinstance(given, Mapping) else ((None, policy) for policy in given):
        own = " ".join(repr(policy).split()) if key is None else str(key)
        twins = sum(name == own or name.startswith(f"{own} (") for name in named)
        named[f"{own} ({twins + 1})" if twins else own] = policy
    if not named:
        raise PolicyError("there are no candidates to choose from: give at least one policy")
    for name, policy in named.items():
        if not isinstance(policy, Policy):
            raise PolicyError(
                f"candidate {name} must be a policy of unconstrain, got {type(policy).__name__}"
            )
    return named


def _try(
    name: str,
    policy: Policy,
    X: np.ndarray,
    U: Any,
    groups: np.ndarray | None,
    projections: np.ndarray | None,
) -> tuple[Row, _HeldOut | None]:
    """Fit a candidate, or say why it cannot be."""
    start = time.perf_counter()
    try:
        found = _hold_out(policy, X, U, groups, None if policy.risk == "direct" else projections)
    except ValueError as error:  # ours, and those of transformers from elsewhere
        sentence = " ".join(str(error).split())
        return Row(name, seconds=time.perf_counter() - start, problem=sentence), None
    row = Row(
        name,
        alpha=getattr(found.policy, "alpha_", np.nan),
        n_parameters=np.size(found.policy.solution_.w) if isinstance(found.policy, LinearPolicy) else 0,
        seconds=time.perf_counter() - start,
        log_likelihood=found.log_likelihood,
    )
    return row, found


def _choose_judge(
    held_out: Mapping[str, _HeldOut],
    metric: Policy,
    X: np.ndarray,
    U: Any,
    groups: np.ndarray | None,
    projections: np.ndarray | None,
) -> Judge:
    """Find out which samples were free, by the candidate that says so best."""
    actions = metric.scaled(check_actions(U))
    risks = {found.policy.risk for found in held_out.values()}
    inferred = [found for found in held_out.values() if found.free is not None]
    none_free = np.zeros(len(actions))
    known = projections
    if known is not None and metric.model_.scale is not None:
        known = in_metric(known, metric.model_.scale)
    inconsistency = Judge(INCONSISTENCY if known is None else OF_WHAT_IS_KNOWN, none_free, known)
    if risks == {"inconsistency"}:
        return inconsistency
    if risks == {"corrected"}:
        measure = CORRECTED if projections is None else OF_WHAT_IS_KNOWN
        noise = min(found.policy.solution_.noise for found in held_out.values())
        return Judge(measure, none_free, known, noise)
    if risks == {"direct"}:
        measure = OF_WHOLE_ACTIONS if projections is None else OF_WHAT_IS_KNOWN
        return Judge(measure, np.ones(len(actions)), known)
    if not inferred:
        best = min(
            held_out.values(),
            key=lambda found: np.mean(inconsistency.errors(actions, metric.scaled(found.predictions))),
        )
        _, added = _try("", clone(best.policy).set_params(risk="adaptive"), X, U, groups, projections)
        if added is None:
            return inconsistency
        inferred = [added]
    likeliest = max(inferred, key=lambda found: found.log_likelihood)
    assert likeliest.free is not None
    measure = OF_WHAT_IS_SHOWN if projections is None else OF_WHAT_IS_KNOWN
    return Judge(measure, likeliest.free, known, likeliest.noise)


def _judge(row: Row, found: _HeldOut, judge: Judge, metric: Policy, U: np.ndarray) -> Row:
    """Complete a candidate's row."""
    U, predictions = metric.scaled(U), metric.scaled(found.predictions)
    errors = judge.errors(U, predictions)
    missed, motion = judge.unexplained(U, predictions), np.einsum("nd,nd->n", U, U)
    folds = [found.fold == k for k in np.unique(found.fold)]
    means = np.array([errors[own].mean() for own in folds])
    shares = [1.0 - float(missed[own].sum() / motion[own].sum()) for own in folds if motion[own].any()]
    return replace(
        row,
        error=float(errors.mean()),
        standard_error=float(means.std(ddof=1) / np.sqrt(len(means))),
        explained=1.0 - float(missed.sum() / motion.sum()),
        by_fold=tuple(means.tolist()),
        explained_by_fold=tuple(shares),
    )


def _hold_out(
    policy: Policy, X: np.ndarray, U: Any, groups: np.ndarray | None, projections: np.ndarray | None
) -> _HeldOut:
    """Fit a policy to all samples, and judge each sample by parameters that were solved without its fold."""
    if not isinstance(policy, LinearPolicy):
        return _hold_out_by_refitting(policy, X, U, groups, projections)
    if policy.alpha != "cv":  # `fit` does not get to see it
        check_number(policy.alpha, "alpha", positive=False)
    fitted = clone(policy).set_params(alpha="cv").fit(X, U, groups=groups, projections=projections)
    if policy.alpha != "cv":  # the folds are needed all the same, the choice is not
        fitted = fitted.set_params(alpha=policy.alpha).solved()
    accumulator = fitted.resume()
    assert accumulator.folds is not None
    fold = accumulator.folds.assign(groups, len(X))
    predictions = np.empty((len(X), fitted.n_actions_))
    is_inferred = policy.risk == "adaptive"
    free = np.empty(len(X)) if is_inferred else None
    present = [k for k, part in enumerate(accumulator.total.moments) if part is not None]
    for k in each(np.unique(fold).tolist(), "predicting each fold", unit="folds"):
        if policy.alpha == "cv" and len(present) - (k in present) < 2:
            # One fold is left, and λ is chosen within it.
            train = fold != k
            several = groups is not None and len(np.unique(groups[train])) > 1
            left = clone(policy).fit(
                X[train],
                np.asarray(U)[train],
                groups=groups[train] if several and groups is not None else None,
                projections=None if projections is None else projections[train],
            )
        else:
            left = fitted.solved(without=k)
        rows = fold == k
        predictions[rows] = check_actions(left.predict(X[rows]), "predictions")
        if free is not None:
            free[rows] = left.free_probability(
                X[rows],
                np.asarray(U)[rows],
                groups=None if groups is None else groups[rows],
                projections=None if projections is None else projections[rows],
            )
    if not is_inferred:
        return _HeldOut(fitted, predictions, fold)
    belief, likelihood = fitted.solution_.belief, fitted.log_likelihood_
    assert belief is not None
    if policy.alpha != "cv":  # contact was inferred with another λ than the one asked for
        fitted = clone(policy).fit(X, U, groups=groups, projections=projections)
    return _HeldOut(fitted, predictions, fold, free, belief.noise.action, likelihood)


def _hold_out_by_refitting(
    policy: Policy, X: np.ndarray, U: Any, groups: np.ndarray | None, projections: np.ndarray | None
) -> _HeldOut:
    """Fit a policy anew without each fold, where no sums are kept that it could be solved from."""
    fold = EpisodeFolds().assign(groups, len(X))
    actions = check_actions(U)
    predictions = np.empty_like(actions)
    for k in each(np.unique(fold).tolist(), "fitting without each fold", unit="folds"):
        rest = fold != k
        left = clone(policy).fit(
            X[rest],
            np.asarray(U)[rest],
            groups=None if groups is None else groups[rest],
            projections=None if projections is None else projections[rest],
        )
        predictions[~rest] = check_actions(left.predict(X[~rest]), "predictions")
    fitted = clone(policy).fit(X, U, groups=groups, projections=projections)
    belief = fitted.solution_.belief
    if belief is None:
        return _HeldOut(fitted, predictions, fold)
    samples = in_units(fitted.model_.scale, Samples(X, actions, groups, projections))
    rule = ByBelief(samples, belief, LEAST_SHARE * belief.noise.action)
    P = fitted.scaled(predictions)
    settled = rule.settle(P)
    return _HeldOut(
        fitted, predictions, fold, judge(P, settled, samples).free, settled.noise.action, rule.judge(P)
    )


def _cells(row: Row) -> tuple[str, ...]:
    return (
        row.name,
        f"{row.error:.4g} ± {row.standard_error:.1g}",
        f"{row.explained:.6f}",
        "" if np.isnan(row.alpha) else f"{row.alpha:.2g}",
        str(row.n_parameters or ""),
        f"{row.seconds:.2f}",
    )


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"
