"""The linear policy behind the samples, which far less data determine than a network: one more place to start from."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.features.base import fit_features
from unconstrain.features.full import as_features
from unconstrain.fitting.accumulator import Accumulator
from unconstrain.fitting.contact import Belief
from unconstrain.fitting.global_model import GlobalModel
from unconstrain.fitting.inference import infer_contact
from unconstrain.networks.model import NetworkModel
from unconstrain.networks.survey import Data
from unconstrain.samples import Samples

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Linear:
    """A linear policy, and what was inferred with it.

    Parameters
    ----------
    slopes : ndarray of shape (d, n)
        Of standardised states, in the unit of the network.
    intercept : ndarray of shape (d,)
        Where these are zero.
    belief : Belief
        Of contact and noise; `held` where no contact was found.
    log_likelihood : float
        Of a sample, each held out in turn.
    """

    slopes: Floats
    intercept: Floats
    belief: Belief
    log_likelihood: float


def fit_linear(network: NetworkModel, model: Any, data: Data, least: float) -> Linear:
    """Learn the linear policy by the adaptive risk, from all samples; λ and its likelihood are cross-validated.

    Parameters
    ----------
    network : NetworkModel
        Whose states and unit it is to have.
    model : Model
        The same over states as they are recorded.
    data : Data
        To learn from.
    least : float
        Variance of the noise that is known beforehand.

    Returns
    -------
    Linear
        As `ParametricPolicy` would learn it.
    """

    def blocks() -> Iterator[Samples]:
        for samples, _ in data.blocks():
            yield samples._replace(states=network.standardize(model.lay_out(samples.states)))

    def add(wanted: Accumulator) -> None:
        for samples in blocks():
            wanted.add(samples)

    features = fit_features(as_features(None), next(blocks()).states, network.n_actions)
    accumulator = Accumulator(
        GlobalModel(features, network.n_states, network.n_actions), "adaptive", noise=least
    )
    solution = infer_contact(accumulator, add).solve()
    slopes, intercept = features.linear(solution.w)  # type: ignore[attr-defined]
    belief = solution.belief
    assert belief is not None
    likelihood = next(iter(solution.record.log_likelihoods.values()))
    return Linear(slopes / network.unit, intercept / network.unit, belief, likelihood)
