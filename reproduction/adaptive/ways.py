"""The ways to learn that are compared, and what is measured of each on one data set."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone

from reproduction.adaptive.bound import compute_bounds, is_free
from reproduction.scores import nupe
from unconstrain.demonstrations import Demonstrations
from unconstrain.diagnostics import identifiability
from unconstrain.errors import PolicyError
from unconstrain.policies import ParametricPolicy
from unconstrain.policies.base import Policy
from unconstrain.policies.linear import LinearPolicy

Array = NDArray[np.float64]

DIRECT, INCONSISTENCY, ADAPTIVE, TOLD = WAYS = ("direct", "inconsistency", "adaptive", "told")
"""Three risks, and the inconsistency with the true projection of every sample known: N = I where it was free."""

CORRECTED = "corrected"
"""The inconsistency less what noise adds, which has a part of its own."""

COLUMNS = (DIRECT, INCONSISTENCY, CORRECTED, ADAPTIVE, TOLD)
"""All ways in the order of tables."""

LEAST_NOISE = 1e-3
"""A share of the rms action: where no noise is added, bounds are those of this much, the limit of little noise."""

Cell = dict[str, float]
"""What was measured on one data set: the error by way, and facts."""


def list_ways() -> tuple[str, ...]:
    """List the ways that this version of the library knows."""
    return tuple(way for way in WAYS if way == TOLD or _knows(way))


def _knows(risk: str) -> bool:
    try:
        ParametricPolicy(risk=risk).check_options()
    except PolicyError:
        return False
    return True


def learn(policy: LinearPolicy, way: str, demos: Demonstrations, known: Array | None = None) -> LinearPolicy:
    """Learn in one of the ways.

    Parameters
    ----------
    policy : LinearPolicy
        Its model; it is copied, and its risk does not matter.
    way : str
        One of `COLUMNS`.
    demos : Demonstrations
        With noise. Their projections are not looked at.
    known : ndarray of shape (N, d, d), optional
        What "told" is told.

    Returns
    -------
    LinearPolicy
        Fitted.
    """
    told = way == TOLD
    mine = clone(policy).set_params(risk=INCONSISTENCY if told else way)
    return mine.fit(demos.states, demos.actions, groups=demos.episodes, projections=known if told else None)


def add_noise(clean: Demonstrations, share: float, rng: np.random.Generator) -> tuple[Demonstrations, float]:
    """Add noise to recorded actions.

    Parameters
    ----------
    clean : Demonstrations
        Their states stay as they are: it is noise of observation.
    share : float
        Of the root mean square of all components of all clean actions.
    rng : Generator
        As many numbers are drawn whatever the share.

    Returns
    -------
    noisy : Demonstrations
        With independent Gaussian noise of the same standard deviation in every component.
    deviation : float
        That standard deviation, in units of the action.
    """
    deviation = share * root_mean_square(clean.actions)
    noise = rng.standard_normal(clean.actions.shape)
    return replace(clean, actions=clean.actions + deviation * noise), deviation


def root_mean_square(U: Array) -> float:
    """Compute the root mean square of all components of actions U (N, d)."""
    return float(np.sqrt(np.mean(U**2)))


def compare_ways(
    policy: LinearPolicy,
    ways: tuple[str, ...],
    clean: Demonstrations,
    test: Demonstrations,
    noise: float,
    rng: np.random.Generator,
) -> Cell:
    """Learn a simulated data set in every way, and measure the nUPE.

    Parameters
    ----------
    policy : LinearPolicy
        The model of all.
    ways : tuple of str
        Of `COLUMNS`.
    clean : Demonstrations
        To learn from, with the true policy and projections.
    test : Demonstrations
        Without noise, with the true policy.
    noise : float
        To be added, as a share of the rms action.
    rng : Generator
        For the noise.

    Returns
    -------
    dict of str to float
        As for `compare_recorded`, with the bounds for this noise.
    """
    noisy, deviation = add_noise(clean, noise, rng)
    least = LEAST_NOISE * root_mean_square(clean.actions)
    result = compare_recorded(policy, ways, noisy, clean, test, clean.projections, deviation or least)
    return result | {"true noise": deviation}


def compare_recorded(
    policy: LinearPolicy,
    ways: tuple[str, ...],
    noisy: Demonstrations,
    clean: Demonstrations,
    test: Demonstrations,
    known: Array | None,
    deviation: float,
) -> Cell:
    """Learn recordings in every way, and measure the nUPE.

    Parameters
    ----------
    policy : LinearPolicy
        The model of all.
    ways : tuple of str
        Of `COLUMNS`.
    noisy : Demonstrations
        To learn from.
    clean : Demonstrations
        The same samples as the method supposes them: actions `N π`, with the true policy and projections.
    test : Demonstrations
        With the true policy.
    known : ndarray of shape (N, d, d), optional
        The projections that "told" is told, NaN where not known.
    deviation : float
        Standard deviation of the noise, for the bounds.

    Returns
    -------
    dict of str to float
        The nUPE by way; "bound" and "told bound"; "determined", the share of the policy that the known projections
        determine; "true noise" and "true free"; what `adaptive` found, see `describe_found`, or `corrected`, its noise.
    """
    assert clean.projections is not None
    free = is_free(clean.projections)
    result: Cell = {"true noise": deviation, "true free": float(free.mean())}
    for way in ways:
        learnt = learn(policy, way, noisy, known)
        result[way] = nupe(test, learnt.predict(test.states))
        if way == ADAPTIVE:
            result |= describe_found(learnt, noisy, free)
        if way == CORRECTED and ADAPTIVE not in ways:
            result["noise"] = float(learnt.noise_)
        if way == TOLD:
            report = identifiability(learnt, noisy.states, noisy.actions, projections=known)
            result["determined"] = report.determined_share
            bounds = compute_bounds(learnt.model_, clean, test, deviation)
            result |= {"bound": bounds.unknown, "told bound": bounds.told}
    return result


def describe_found(learnt: Policy, demos: Demonstrations, free: NDArray[np.bool_] | None = None) -> Cell:
    """Say what an adaptive fit found out about the samples it was learnt from.

    Parameters
    ----------
    learnt : Policy
        Fitted with risk "adaptive".
    demos : Demonstrations
        To these.
    free : ndarray of shape (N,), bool, optional
        Which were free, where it is known.

    Returns
    -------
    dict of str to float
        "noise", in units of the action; "speed noise", a share of the speed; "free", a share of the samples;
        "contact right", the share of samples rightly called free or constrained, where the truth is known.
    """
    found = {
        "noise": float(learnt.noise_),
        "speed noise": float(learnt.speed_noise_),
        "free": float(learnt.free_share_),
    }
    if free is not None:
        found["contact right"] = float(np.mean((probably_free(learnt, demos) > 0.5) == free))
    return found


def probably_free(learnt: Policy, demos: Demonstrations) -> Array:
    """Return the probability (N,) of each sample to have been free, as an adaptive fit has it."""
    inferred = learnt.free_probability(demos.states, demos.actions, groups=demos.episodes)
    return np.asarray(inferred, dtype=np.float64)
