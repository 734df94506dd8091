"""Choosing among policies by their inconsistency on episodes held out, which needs nothing but recordings.

Every candidate is fitted once, its samples added up by fold. Leaving a fold out is a subtraction of its moments, so
the solution without fold k, with λ chosen anew among the other folds, costs no second pass over the data. Its
predictions for the episodes of fold k are compared with their actions, and all folds' errors are pooled:

    E_i = 1/N Σ_k Σ_(n in fold k) (r_n - û_nᵀ π_(without k)(x_n))²

The folds are the same for all candidates. What features take from the states alone (centres, knots, ranges) they
take from all of them, as one fit does; nothing of a held-out action enters. No true policy is used: that the least
inconsistent candidate is also the one nearest to the true policy is likely, not certain, since directions that no
episode ever moved in are not judged. Where projections of some samples are known, their error is that under the
constraint, which judges more of the policy.
"""

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
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
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import PolicyError
from unconstrain.features import DecoupledFeatures, NormalizedRBF, PotentialFeatures
from unconstrain.fitting.observation import observe, squared_errors
from unconstrain.fitting.solve import splits
from unconstrain.policies.base import Policy
from unconstrain.policies.inputs import unpack_demonstrations
from unconstrain.policies.locally_linear import LocallyLinearPolicy
from unconstrain.policies.parametric import ParametricPolicy

# What a default candidate may have: a cross-validated fit then takes seconds to solve, whatever the dimension.
MOST_PARAMETERS = 1000
MOST_CENTERS = 50
COARSE_KNOTS = 15

INCONSISTENCY = "held-out inconsistency"
OF_WHAT_IS_KNOWN = "held-out error of what is known"


@dataclass(frozen=True)
class Row:
    """One candidate's line of the comparison.

    Parameters
    ----------
    name : str
        Of the candidate.
    inconsistency : float
        Pooled over held-out samples, in squared units of the action; NaN where the candidate failed. Where projections
        are known it is the error under them.
    standard_error : float
        Of the inconsistency, over folds. Candidates share the folds, so differences are surer than it says.
    explained : float
        Share of held-out motion explained, `1 - Σ (r - û·p)² / Σ r²`.
    alpha : float
        Weight decay λ, as chosen on all the data.
    n_parameters : int
        Of all actions together, of each local model.
    seconds : float
        To fit and to hold out.
    problem : str, optional
        Why the candidate could not be fitted.
    """

    name: str
    inconsistency: float = np.nan
    standard_error: float = np.nan
    explained: float = np.nan
    alpha: float = np.nan
    n_parameters: int = 0
    seconds: float = 0.0
    problem: str | None = None


@dataclass(frozen=True)
class Table:
    """The comparison.

    Parameters
    ----------
    rows : tuple of Row
        The least inconsistent candidate first, and the failed ones last.
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
        head = ("candidate", self.measure, "explained", "λ", "parameters", "seconds")
        lines = [head, *(_cells(row) for row in self.rows if row.problem is None)]
        widths = [max(len(line[i]) for line in lines) for i in range(len(head))]
        text = [_line([c.ljust(w) for c, w in zip(line, widths, strict=True)]) for line in lines]
        text.insert(1, _line(["-" * w for w in widths]))
        failed = [f"{row.name}: {row.problem}" for row in self.rows if row.problem is not None]
        return "\n".join([*text, *([""] if failed else []), *failed])


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
    """

    policy: Policy
    name: str
    table: Table
    policies: dict[str, Policy] = field(repr=False)

    def __str__(self) -> str:
        return f"{self.table}\n\nchosen: {self.name}"


def candidates(n: int, d: int) -> dict[str, Policy]:
    """Make the candidates of "auto", all with λ chosen by held-out inconsistency.

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
    """Choose the candidate with the least inconsistency on held-out episodes, and fit it to all the data.

    Parameters
    ----------
    candidates : "auto", or list or dict of Policy
        Policies in a list are named after themselves, in a dict by their keys; "auto" stands for those that
        `candidates(n, d)` makes. They are cloned, never changed.
    X : array_like of shape (N, n), or Demonstrations
        States. Demonstrations bring their actions, episodes and known projections.
    U : array_like of shape (N, d)
        Actions.
    groups : array_like of shape (N,), optional
        Episodes, which are held out whole; without them contiguous blocks are.
    projections : array_like of shape (N, d, d), optional
        The nullspace projections, all NaN where one is not known. Candidates are then judged by the error under them,
        and those with the risk "inconsistency" learn from them.
    n_jobs : int, optional
        Candidates fitted at a time, in threads (joblib; most of the work is in BLAS and LAPACK).
    progress : callable, optional
        Called with each candidate's `Row` once it is done, in the order given.

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

    states, U, groups, projections = unpack_demonstrations(X, U, groups, projections)
    X, U = check_samples(ParametricPolicy(), states, U, reset=True, min_samples=2)
    actions, groups = check_actions(U), check_groups(groups, len(X))
    named = _name_candidates(candidates, X.shape[1], actions.shape[1])
    if projections is not None:
        projections = check_projections(projections, *actions.shape, unknown=True)
        check_lets_through(projections, actions)
    # What no candidate could be judged on is told here, as the mistake it is, and not as each one's failure.
    next(splits(len(X), groups))
    metrics.explained(actions, np.zeros_like(actions))

    parallel = joblib.Parallel(n_jobs=n_jobs, prefer="threads", return_as="generator")
    rows, policies = [], {}
    judged = parallel(
        joblib.delayed(_judge)(name, policy, X, U, groups, projections) for name, policy in named.items()
    )
    for row, policy in judged:
        rows.append(row)
        if policy is not None:
            policies[row.name] = policy
        if progress is not None:
            progress(row)
    rows.sort(key=lambda row: (row.problem is not None, row.inconsistency))
    if rows[0].problem is not None:
        if len({row.problem for row in rows}) == 1:
            raise PolicyError(rows[0].problem)
        raise PolicyError(
            f"none of the candidates could be fitted; the first, {rows[0].name}: {rows[0].problem}"
        )
    table = Table(tuple(rows), INCONSISTENCY if projections is None else OF_WHAT_IS_KNOWN)
    return Selection(policies[rows[0].name], rows[0].name, table, policies)


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


def _judge(
    name: str,
    policy: Policy,
    X: np.ndarray,
    U: Any,
    groups: np.ndarray | None,
    projections: np.ndarray | None,
) -> tuple[Row, Policy | None]:
    start = time.perf_counter()
    try:
        known = None if policy.risk == "direct" else projections
        fitted, predictions, fold = _hold_out(policy, X, U, groups, known)
        observation = observe("inconsistency", check_actions(U), projections)
        errors = squared_errors(observation, predictions)
        means = np.array([errors[fold == k].mean() for k in np.unique(fold)])
        row = Row(
            name,
            inconsistency=float(errors.mean()),
            standard_error=float(means.std(ddof=1) / np.sqrt(len(means))),
            explained=1.0 - float(errors.sum() / observation.squares.sum()),
            alpha=fitted.alpha_,
            n_parameters=fitted.solution_.w.size,
            seconds=time.perf_counter() - start,
        )
    except ValueError as error:  # ours, and those of transformers from elsewhere
        sentence = " ".join(str(error).split())
        return Row(name, seconds=time.perf_counter() - start, problem=sentence), None
    return row, fitted


def _hold_out(
    policy: Policy, X: np.ndarray, U: Any, groups: np.ndarray | None, projections: np.ndarray | None
) -> tuple[Policy, np.ndarray, np.ndarray]:
    """Fit a policy to all samples, predict held-out ones (N, d), and tell the fold of each sample (N,)."""
    if policy.alpha != "cv":  # `fit` does not get to see it
        check_number(policy.alpha, "alpha", positive=False)
    fitted = clone(policy).set_params(alpha="cv").fit(X, U, groups=groups, projections=projections)
    if policy.alpha != "cv":  # the folds are needed all the same, the choice is not
        fitted = fitted.set_params(alpha=policy.alpha).solved()
    accumulator = fitted.resume()
    assert accumulator.folds is not None
    fold = accumulator.folds.assign(groups, len(X))
    predictions = np.empty((len(X), fitted.n_actions_))
    present = [k for k, part in enumerate(accumulator.total.moments) if part is not None]
    for k in np.unique(fold).tolist():
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
        predictions[fold == k] = check_actions(left.predict(X[fold == k]), "predictions")
    return fitted, predictions, fold


def _cells(row: Row) -> tuple[str, ...]:
    return (
        row.name,
        f"{row.inconsistency:.4g} ± {row.standard_error:.1g}",
        f"{row.explained:.6f}",
        f"{row.alpha:.2g}",
        str(row.n_parameters),
        f"{row.seconds:.2f}",
    )


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"
