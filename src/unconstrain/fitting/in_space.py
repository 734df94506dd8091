"""Models over states that are no plain numbers, and over actions of several units.

Features see states as `Space.embed` lays them out, and so need not know what a quaternion is. Actions are divided by a
scale, so that metres and radians can be told from each other: the projections of the risk, and the noise, are taken in
the metric `Σ (u_i / s_i)²`.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from unconstrain.constraints.nullspace import in_metric
from unconstrain.errors import DataError, PolicyError
from unconstrain.features.base import Features
from unconstrain.fitting.decay import Decay
from unconstrain.fitting.model import LinearModel, Model
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import Observation
from unconstrain.fitting.posterior import Posterior
from unconstrain.samples import Samples
from unconstrain.spaces import Space


@dataclass(frozen=True)
class InSpace:
    """A model whose states belong to a space, and whose actions have a scale.

    Parameters
    ----------
    model : Model
        Over states as the space lays them out.
    space : Space
        That states belong to.
    base : ndarray of shape (n,) or None
        About which it lays them out.
    scale : ndarray of shape (d,) or None
        What actions are divided by.
    """

    model: Model
    space: Space
    base: np.ndarray | None
    scale: np.ndarray | None = None

    @property
    def n_states(self) -> int:
        """Number of states n, as they are recorded."""
        return self.space.n_states

    @property
    def n_actions(self) -> int:
        """Number of actions d."""
        return self.model.n_actions

    @property
    def width(self) -> float | np.ndarray | None:
        """Width of receptive fields; see `Model.width`."""
        return self.model.width

    def evaluate(self, X: np.ndarray, w: Any) -> np.ndarray:
        """Evaluate the policy, in units of the scale; see `Model.evaluate`."""
        return self.model.evaluate(self.lay_out(X), w)

    def lay_out(self, X: np.ndarray) -> np.ndarray:
        """Lay states out as features see them; see `Model.lay_out`."""
        if self.space.is_flat:
            return X
        try:
            return self.space.embed(np.asarray(X, dtype=np.float64), self.base)
        except ValueError:  # what scipy says of a quaternion of length zero, and of a matrix that mirrors
            raise DataError(
                f"some states are no rotation: those that this policy was learnt from are {self.space.words}"
            ) from None

    def compile(self, w: Any) -> Any:
        """Compile the policy for a control loop; see `Model.compile`."""
        from unconstrain.deploy import compiled

        return compiled.InSpace(self.model.compile(w), self.space, self.base, self.scale)


@dataclass(frozen=True)
class LinearInSpace(InSpace):
    """A model that is linear in its parameters, over such states."""

    model: LinearModel

    @property
    def features(self) -> Features:
        """The fitted feature map; see `Model.features`."""
        return self.model.features

    @property
    def n_models(self) -> int:
        """Number of sets of parameters."""
        return self.model.n_models

    @property
    def shares_basis(self) -> bool:
        """Whether all actions share one basis."""
        return self.model.shares_basis

    def moments(self, X: np.ndarray, observation: Observation, weights: np.ndarray | None = None) -> Moments:
        """Sum samples up; see `Model.moments`."""
        return self.model.moments(self.lay_out(X), observation, weights)

    def decay(self, moments: Moments) -> Decay:
        """Say what the weight decay acts on; see `Model.decay`."""
        return self.model.decay(moments)

    def parameters(self, w: np.ndarray) -> np.ndarray:
        """Turn a solution of the moments into parameters; see `Model.parameters`."""
        return self.model.parameters(w)

    def solution(self, parameters: np.ndarray, n_targets: int) -> np.ndarray:
        """Turn parameters into a solution of the moments; see `Model.solution`."""
        return self.model.solution(parameters, n_targets)

    def covariance(self, X: np.ndarray, P: np.ndarray, posterior: Posterior) -> np.ndarray:
        """Compute second moments about predictions, in units of the scale; see `Model.covariance`."""
        return self.model.covariance(self.lay_out(X), P, posterior)

    def along(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Compute the features along directions; see `Model.along`."""
        return self.model.along(self.lay_out(X), directions)

    def reach(self, X: np.ndarray) -> np.ndarray:
        """Compute how much of a sample reaches each model; see `Model.reach`."""
        return self.model.reach(self.lay_out(X))


def in_units(scale: np.ndarray | None, samples: Samples) -> Samples:
    """Divide actions by the scale of a model, and take projections in its metric.

    Parameters
    ----------
    scale : ndarray of shape (d,) or None
        Of the model.
    samples : Samples
        As recorded.

    Returns
    -------
    Samples
        In units of the scale.
    """
    if scale is None:
        return samples
    projections = samples.projections
    if projections is not None:
        projections = in_metric(projections, scale)
    return samples._replace(actions=samples.actions / scale, projections=projections)


def find_scale(wanted: Any, space: Space, X: np.ndarray, d: int) -> np.ndarray | None:
    """Find what a length of one is along each action.

    Parameters
    ----------
    wanted : None, "auto" or ndarray of shape (d,)
        As the user gives it. None stands for one, or for "auto" where actions have several units.
    space : Space
        Whose velocities the actions are.
    X : ndarray of shape (N, n)
        States. Those of a unit lie about their mean as far as those of another do, in units of the scale.
    d : int
        How many actions there are.

    Returns
    -------
    ndarray of shape (d,) or None
        The first is one where it is found. None for one throughout.

    Raises
    ------
    PolicyError
        It is neither, or does not have d numbers.
    """
    are_velocities = space.n_actions == d
    is_mixed = are_velocities and len(set(space.units)) > 1
    if wanted is None and not is_mixed:
        return None
    if wanted is None or (isinstance(wanted, str) and wanted == "auto"):
        if not are_velocities:
            raise PolicyError(
                f'scale="auto" is for actions that are velocities of the states, {space.n_actions} numbers, and there '
                f"are {d}: give one number for each"
            )
        return _find_spread(space, X, is_mixed)
    try:
        scale = np.asarray(wanted, dtype=np.float64)
    except (TypeError, ValueError):
        scale = np.empty(0)
    if scale.shape != (d,) or not np.all(np.isfinite(scale) & (scale > 0)):
        raise PolicyError(
            f'scale must be "auto" or {d} positive numbers, one for each action, got {wanted!r:.60}'
        )
    return scale


def _find_spread(space: Space, X: np.ndarray, by_unit: bool) -> np.ndarray | None:
    """Compute how far states lie about their mean, relative to the first; all of a unit together, or each by itself."""
    spread = np.sqrt(np.mean(space.offsets(X) ** 2, axis=0))
    if by_unit:
        units = np.array(space.units)
        for unit in set(space.units):
            spread[units == unit] = np.sqrt(np.mean(spread[units == unit] ** 2))
    varies = spread > 1e-9 * spread.max(initial=0.0)
    if not varies.any():
        return None
    spread = np.where(varies, spread, spread[varies].min())
    return spread / spread[0]
