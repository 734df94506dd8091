"""Compiled policies that end at a goal."""

from math import sqrt
from typing import Any, ClassVar, Self

import numpy as np
from numpy import maximum, ndarray
from numpy.typing import ArrayLike

from unconstrain.deploy.compiled.base import CompiledPolicy
from unconstrain.errors import PolicyError
from unconstrain.spaces import from_description
from unconstrain.stability import Lyapunov, Stability

NUMBERS = ("pace", "radius", "pull", "extent", "hold")
STABLE_ARRAYS = tuple(f"stable_{name}" for name in ("goal", "scale", "matrices", "offsets"))

# Squared distances from the goal beyond which powers of them could overflow.
FAR = 1e30


class Stabilized(CompiledPolicy):
    """Another compiled policy, whose actions are changed as little as it takes to make a Lyapunov function fall.

    Parameters
    ----------
    step : CompiledPolicy
        The policy itself.
    stability : Stability
        What changes its actions.

    Raises
    ------
    PolicyError
        They do not go together.
    """

    __slots__ = ("stability", "step")
    kind = "stabilised"
    layout: ClassVar = {"goal": 1, "scale": 1, "matrices": 3, "offsets": 2}

    step: CompiledPolicy
    stability: Stability

    def __init__(self, step: CompiledPolicy, stability: Stability) -> None:
        set_once = object.__setattr__
        set_once(self, "step", step)
        set_once(self, "stability", stability)
        lyapunov = stability.lyapunov
        super().__init__(
            goal=stability.goal,
            scale=stability.scale,
            matrices=lyapunov.matrices,
            offsets=lyapunov.offsets,
        )

    @classmethod
    def restore(cls, step: CompiledPolicy, about: dict[str, Any], arrays: dict[str, ndarray]) -> Self:
        """Make it again of what `contents` returned.

        Parameters
        ----------
        step : CompiledPolicy
            The inner one.
        about : dict
            Its space and its numbers.
        arrays : dict of str to ndarray
            Goal, scale, matrices and offsets.

        Returns
        -------
        Stabilized
            As it was saved.
        """
        goal, scale, matrices, offsets = (arrays[name] for name in STABLE_ARRAYS)
        numbers = {name: float(about[name]) for name in NUMBERS}
        if not all(np.isfinite(value) and value > 0 for value in numbers.values()):
            raise PolicyError("the numbers of a stabilised policy must be positive and finite")
        space = from_description(about["space"])
        pace, radius, pull, extent, hold = numbers.values()
        lyapunov = Lyapunov(matrices, offsets)
        return cls(step, Stability(space, goal, scale, lyapunov, pace, radius, pull, extent, hold))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.step, self.stability)

    def __call__(self, x: ArrayLike, out: ndarray | None = None) -> ndarray:
        """Act; see `CompiledPolicy`."""
        if type(x) is not ndarray or x.shape != self._shape:
            return self._otherwise(x, out)
        own = self.step(x, out)
        actions = self._single(x, own) if self._parts else self._generally(x, own)
        if out is None:
            return actions
        out[:] = actions
        return out

    def contents(self) -> tuple[dict[str, Any], dict[str, ndarray]]:
        """Return what a file holds; see `CompiledPolicy.contents`."""
        tree, arrays = self.step.contents()
        about = {name: getattr(self.stability, name) for name in NUMBERS}
        own = {f"stable_{name}": array for name, array in self.arrays.items()}
        return {**tree, "stable": {**about, "space": self.stability.space.describe()}}, {**arrays, **own}

    def magnitude(self, X: ndarray) -> float:
        """Return the largest term that is added up; see `CompiledPolicy`."""
        stability = self.stability
        straight = stability.pace + stability.pull * stability.radius
        return max(self.step.magnitude(X), straight * float(stability.scale.max()))

    def _dimensions(self, arrays: dict[str, ndarray]) -> tuple[int, int]:
        n, d = self.stability.space.n_states, self.step.n_actions
        count = len(arrays["matrices"])
        fits = (
            self.step.n_states == n == len(arrays["goal"])
            and self.stability.space.n_actions == d
            and arrays["scale"].shape == (d,)
            and (arrays["scale"] > 0).all()
            and arrays["matrices"].shape == (count, d, d)
            and arrays["offsets"].shape == (count - 1, d)
        )
        if not fits:
            raise PolicyError(
                "the Lyapunov function of a stabilised policy does not go with its states and actions"
            )
        return n, d

    def _prepare(self, arrays: dict[str, ndarray]) -> tuple[Any, ...]:
        """Lay out what one state needs, where states are plain numbers."""
        if not self.stability.space.is_flat:
            return ()
        P, d = arrays["matrices"], self.n_actions
        linear = np.einsum("lij,lj->li", P[1:], arrays["offsets"])
        scale = None if (arrays["scale"] == 1.0).all() else arrays["scale"].copy()
        stability = self.stability
        numbers = (stability.radius, stability.pull, stability.pace, stability.slowing, stability.hold)
        return arrays["goal"].copy(), scale, P.reshape(-1, d).copy(), P.shape[:2], linear, numbers

    def _single(self, x: ndarray, own: ndarray) -> ndarray:
        """Change one action (d,), as `Stability.stabilize` does many; so few terms are faster added in Python."""
        goal, scale, stacked, shape, linear, numbers = self._parts
        radius, pull, pace, slowing, hold = numbers
        e, u = x - goal, own
        if scale is not None:
            e, u = e / scale, own / scale
        squared = float(e.dot(e))
        if not squared < FAR:
            return self._generally(x, own)
        away = sqrt(squared)
        if away < radius:
            inside = away / radius
            share = inside * inside * (3.0 - 2.0 * inside)
            u = share * u - ((1.0 - share) * pull) * e
        products = stacked.dot(e).reshape(shape)
        slopes = products[1:] - linear
        parts = slopes.dot(e)
        maximum(parts, 0.0, out=parts)
        slopes += products[1:]
        gradient = parts.dot(slopes)
        gradient += products[0]
        needed = float(gradient.dot(u)) + pace / max(away, slowing) * float(gradient.dot(e))
        steepness = float(gradient.dot(gradient))
        if needed > 0.0 and steepness > 0.0:
            u = u - (needed / steepness) * gradient
        step = hold * u
        falls = -2.0 * float(gradient.dot(step))
        quadratic, *curved = stacked.dot(step).reshape(shape).dot(step).tolist()
        bound = 2.0 * quadratic
        for part, first, bend in zip(parts.tolist(), slopes.dot(step).tolist(), curved, strict=True):
            last = part + first + bend
            if part > 0.0 or last > 0.0:
                steep = max(abs(first), abs(first + 2.0 * bend))
                bound += 2.0 * steep * steep + 4.0 * max(part, last) * bend
        if bound > 0.0 and falls < bound:
            u = u * max(falls / bound, 0.0)
        return u if scale is None else u * scale

    def _generally(self, x: ndarray, own: ndarray) -> ndarray:
        return self.stability.stabilize(x[None], own[None])[0]

    def _many(self, X: ndarray) -> ndarray:
        return self.stability.stabilize(X, self.step(X))

    def _typical_states(self, rng: np.random.Generator, count: int) -> ndarray:
        """Draw states (N, n) from close to the goal to beyond the recorded region."""
        stability = self.stability
        far = stability.radius * 10.0 ** rng.uniform(-1.0, 2.0, size=(count, 1))
        away = far * rng.standard_normal((count, self.n_actions)) * stability.scale
        return stability.space.step(np.tile(stability.goal, (count, 1)), away, 1.0)
