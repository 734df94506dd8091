"""Compiled policies over states that are no plain numbers, or with a scale of their actions."""

from typing import Any, ClassVar, Self

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from unconstrain.deploy.compiled.base import CompiledPolicy
from unconstrain.errors import PolicyError
from unconstrain.spaces import Space, from_description


class InSpace(CompiledPolicy):
    """`s π(e(x))`: what a space makes of the state, another compiled policy, and a scale.

    Parameters
    ----------
    step : CompiledPolicy
        Over states as the space lays them out.
    space : Space
        That states belong to.
    base : ndarray of shape (n,) or None
        About which it lays them out.
    scale : ndarray of shape (d,) or None
        What its actions are multiplied by.

    Raises
    ------
    PolicyError
        They do not go together.
    """

    __slots__ = ("base", "scale", "space", "step")
    kind = "in a space"
    layout: ClassVar = {"base": 1, "scale": 1}

    step: CompiledPolicy
    space: Space
    base: ndarray | None
    scale: ndarray

    def __init__(
        self, step: CompiledPolicy, space: Space, base: ndarray | None, scale: ndarray | None
    ) -> None:
        set_once = object.__setattr__
        set_once(self, "step", step)
        set_once(self, "space", space)
        set_once(self, "base", None if base is None else np.array(base, dtype=np.float64))
        factor = np.ones(step.n_actions) if scale is None else np.array(scale, dtype=np.float64)
        set_once(self, "scale", factor)
        laid_out = space.embed(space.origin[None], self.base)
        if laid_out.shape[1] != step.n_states or factor.shape != (step.n_actions,):
            raise PolicyError("the state space and the scale of a compiled policy do not go with its arrays")
        # What any state is, NaN included, is known to the space alone, so every call goes the general way.
        super().__init__(base=np.zeros(space.n_states), scale=factor)

    @classmethod
    def restore(cls, step: CompiledPolicy, about: dict[str, Any], arrays: dict[str, ndarray]) -> Self:
        """Make it again of what `save` wrote.

        Parameters
        ----------
        step : CompiledPolicy
            The inner one.
        about : dict
            Of the space.
        arrays : dict of str to ndarray
            Base, where there is one, and scale.

        Returns
        -------
        InSpace
            As it was saved.
        """
        return cls(step, from_description(about), arrays.get("space_base"), arrays["space_scale"])

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.step, self.space, self.base, self.scale)

    def __call__(self, x: ArrayLike, out: ndarray | None = None) -> ndarray:
        """Act; see `CompiledPolicy`."""
        if type(x) is not ndarray or x.shape != self._shape:
            return self._otherwise(x, out)
        actions = self._many(x[None])[0]
        if out is None:
            return actions
        try:
            out[:] = actions
        except (ValueError, TypeError) as error:
            raise self._bad_out(out) from error
        return out

    def contents(self) -> tuple[dict[str, Any], dict[str, ndarray]]:
        """Return what a file holds; see `CompiledPolicy.contents`."""
        tree, arrays = self.step.contents()
        own = (
            {"space_scale": self.scale}
            if self.base is None
            else {"space_scale": self.scale, "space_base": self.base}
        )
        return {**tree, "space": self.space.describe()}, {**arrays, **own}

    def magnitude(self, X: ndarray) -> float:
        """Return the largest term that is added up; see `CompiledPolicy`."""
        return float(self.step.magnitude(self.space.embed(X, self.base)) * self.scale.max())

    def _dimensions(self, arrays: dict[str, ndarray]) -> tuple[int, int]:
        return self.space.n_states, self.step.n_actions

    def _many(self, X: ndarray) -> ndarray:
        try:
            return self.step(self.space.embed(X, self.base)) * self.scale
        except ValueError as error:
            raise PolicyError(f"some states are none of these: {self.space.words}") from error

    def _typical_states(self, rng: np.random.Generator, count: int) -> ndarray:
        start = np.tile(self.space.origin, (count, 1))
        return self.space.step(start, rng.standard_normal((count, self.space.n_actions)), 1.0)
