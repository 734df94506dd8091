"""What a fit begins with: which samples count, what their states are, and what a length of one is."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from unconstrain.errors import DataError, PolicyError
from unconstrain.fitting.accumulator import NO_DIRECTION, find_informative_samples
from unconstrain.fitting.in_space import InSpace, find_scale
from unconstrain.motion import moving
from unconstrain.samples import Samples
from unconstrain.spaces import Numbers, Space

if TYPE_CHECKING:
    from unconstrain.policies.base import Policy


@dataclass(frozen=True)
class Setting:
    """The space and the scale in which a policy is learnt.

    Parameters
    ----------
    space : Space
        That states belong to.
    base : ndarray of shape (n,) or None
        About which it lays them out.
    scale : ndarray of shape (d,) or None
        What actions are divided by.
    noise : float
        Standard deviation of the actions' noise that is known, in units of the scale; 0 where none is.
    counted : ndarray of shape (N,), bool
        Which samples say something of the policy.
    states : ndarray
        Those of these samples, as features see them.
    """

    space: Space
    base: np.ndarray | None
    scale: np.ndarray | None
    noise: float
    counted: np.ndarray
    states: np.ndarray

    def wrap(self, model: Any, kind: type[InSpace] = InSpace) -> Any:
        """Put a model over laid-out states and scaled actions into this setting.

        Parameters
        ----------
        model : Model
            Over what `states` are.
        kind : type
            `LinearInSpace` for models that are linear in their parameters.

        Returns
        -------
        Model
            Over states as they are recorded; the model itself where that is the same.
        """
        if self.space.is_flat and self.scale is None:
            return model
        return kind(model, self.space, self.base, self.scale)


def settle(policy: "Policy", samples: Samples, space: Space | None, noise: float | None) -> Setting:
    """Find the setting of a policy's options and samples.

    Parameters
    ----------
    policy : Policy
        Its options `risk`, `space`, `scale` and `noise` come first.
    samples : Samples
        Checked.
    space : Space, optional
        That the samples' states belong to; numbers by default.
    noise : float, optional
        Standard deviation of the actions' noise, where it is known of these recordings.

    Returns
    -------
    Setting
        Of this fit.

    Raises
    ------
    PolicyError
        An option is impossible.
    DataError
        None of the samples says anything.
    """
    X, U = samples.states, samples.actions
    moves = moving(U)
    counted = find_informative_samples(policy.risk, samples, moves)
    shows = counted if policy.risk == "direct" else find_informative_samples("inconsistency", samples, moves)
    if not shows.any():
        raise DataError(NO_DIRECTION)
    space = policy.space or space or Numbers(X.shape[1])
    _check_in_space(space, X)
    scale = find_scale(policy.scale, space, X, U.shape[1])
    # Of actions in several units the noise in units of the scale is at least that of the largest.
    sure = noise if noise is None or scale is None else noise / float(scale.max())
    known = float((sure if policy.noise is None else policy.noise) or 0.0)
    base = None if space.is_flat else space.find_base(X[counted])
    Z = X[counted] if space.is_flat else space.embed(X[counted], base)
    return Setting(space, base, scale, known, counted, Z)


def _check_in_space(space: Any, X: np.ndarray) -> None:
    """Raise an error where states (N, n) are not of the space."""
    if not isinstance(space, Space):
        raise PolicyError(f"space must be a kind of state of unconstrain.spaces, got {space!r:.60}")
    if space.n_states != X.shape[1]:
        raise PolicyError(
            f"states have {X.shape[1]} numbers, and those of the space {space.n_states}: {space.words}"
        )
    faults = space.faults(X)
    if faults.any():
        raise DataError(f"the states of sample {int(np.argmax(faults))} are none of these: {space.words}")
