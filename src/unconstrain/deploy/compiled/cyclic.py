"""Compiled policies that go round and round."""

from math import atan2, cos, exp, hypot, pi, remainder, sin, sqrt
from typing import Any, ClassVar, Self

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from unconstrain.deploy.compiled.base import CompiledPolicy
from unconstrain.errors import PolicyError
from unconstrain.spaces import from_description
from unconstrain.stability import Cycle
from unconstrain.stability.cycle import APPROACH, LEAST, TEMPO

CYCLE_NAMES = ("center", "scale", "axes", "curve", "slowness")
CYCLE_ARRAYS = tuple(f"cycle_{name}" for name in CYCLE_NAMES)


class Cyclic(CompiledPolicy):
    """Another compiled policy, whose actions are changed as little as it takes to keep to a cycle.

    Parameters
    ----------
    step : CompiledPolicy
        The policy itself.
    cycle : Cycle
        What changes its actions.

    Raises
    ------
    PolicyError
        They do not go together.
    """

    __slots__ = ("cycle", "step")
    kind = "on a cycle"
    layout: ClassVar = {"center": 1, "scale": 1, "axes": 2, "curve": 2, "slowness": 1}

    step: CompiledPolicy
    cycle: Cycle

    def __init__(self, step: CompiledPolicy, cycle: Cycle) -> None:
        set_once = object.__setattr__
        set_once(self, "step", step)
        set_once(self, "cycle", cycle)
        super().__init__(**{name: getattr(cycle, name) for name in CYCLE_NAMES})

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
            Those of the cycle.

        Returns
        -------
        Cyclic
            As it was saved.
        """
        hold, extent = float(about["hold"]), float(about["extent"])
        if not (0 < hold < np.inf and 0 < extent < np.inf):
            raise PolicyError("the numbers of a policy on a cycle must be positive and finite")
        center, scale, axes, curve, slowness = (arrays[name] for name in CYCLE_ARRAYS)
        space = from_description(about["space"])
        return cls(step, Cycle(space, center, scale, axes, curve, slowness, extent, hold))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.step, self.cycle)

    def __call__(self, x: ArrayLike, out: ndarray | None = None) -> ndarray:
        """Act; see `CompiledPolicy`."""
        if type(x) is not ndarray or x.shape != self._shape:
            return self._otherwise(x, out)
        own = self.step(x, out)
        actions = self._single(x, own) if self._parts else self.cycle.stabilize(x[None], own[None])[0]
        if out is None:
            return actions
        out[:] = actions
        return out

    def contents(self) -> tuple[dict[str, Any], dict[str, ndarray]]:
        """Return what a file holds; see `CompiledPolicy.contents`."""
        tree, arrays = self.step.contents()
        cycle = self.cycle
        about = {"hold": cycle.hold, "extent": cycle.extent, "space": cycle.space.describe()}
        return {**tree, "cycle": about}, {**arrays, **{f"cycle_{name}": a for name, a in self.arrays.items()}}

    def magnitude(self, X: ndarray) -> float:
        """Return the largest term that is added up; see `CompiledPolicy`."""
        lengths = (
            np.abs(self.cycle.curve).sum()
            + np.abs(self.cycle.space.difference(np.tile(self.cycle.center, (len(X), 1)), X)).max()
        )
        return max(self.step.magnitude(X), float(lengths * self.cycle.scale.max() / self.cycle.hold))

    def _dimensions(self, arrays: dict[str, ndarray]) -> tuple[int, int]:
        n, d = self.cycle.space.n_states, self.step.n_actions
        terms = len(arrays["slowness"])
        fits = (
            self.step.n_states == n == len(arrays["center"])
            and self.cycle.space.n_actions == d >= 2
            and arrays["scale"].shape == (d,)
            and (arrays["scale"] > 0).all()
            and arrays["axes"].shape == (d, d)
            and arrays["curve"].shape == (terms, d - 1)
            and terms % 2 == 1
            and arrays["slowness"][0] > 0
            and arrays["curve"][0, 0] > 0
        )
        if not fits:
            raise PolicyError("the cycle of a policy does not go with its states and actions")
        return n, d

    def _prepare(self, arrays: dict[str, ndarray]) -> tuple[Any, ...]:
        """Lay out what one state needs, where states are plain numbers."""
        cycle = self.cycle
        if not cycle.space.is_flat:
            return ()
        both = np.column_stack([arrays["curve"], arrays["slowness"]])
        decay = exp(-APPROACH * cycle.hold / cycle.period)
        return arrays["center"].copy(), arrays["scale"].copy(), arrays["axes"].copy(), both, cycle.hold, decay

    def _single(self, x: ndarray, own: ndarray) -> ndarray:
        """Change one action (d,), as `Cycle.stabilize` does many."""
        center, scale, axes, both, hold, decay = self._parts
        mean, slowest = both[0, 0], LEAST * both[0, -1]

        def look_up(theta: float) -> ndarray:
            """Return the radius, what lies across the plane, and the slowness, at a phase."""
            terms = [1.0]
            for k in range(1, len(both) // 2 + 1):
                terms += (cos(k * theta), sin(k * theta))
            found: ndarray = np.array(terms).dot(both)
            found[0] = max(found[0], LEAST * mean)
            found[-1] = max(found[-1], slowest)
            return found

        at = axes.dot((x - center) / scale)
        ahead = at + axes.dot(own / scale) * hold
        theta, then = atan2(at[1], at[0]), atan2(ahead[1], ahead[0])
        here, there = look_up(theta), look_up(then)
        usual = hold / look_up(theta + 0.5 * hold / here[-1])[-1]
        wanted = remainder(then - theta, 2 * pi)
        step = min(max(wanted, (1 - TEMPO) * usual), (1 + TEMPO) * usual)
        now, after = at[1:] - here[:-1], ahead[1:] - there[:-1]
        now[0] = mean * (hypot(at[0], at[1]) / here[0] - 1.0)
        after[0] = mean * (hypot(ahead[0], ahead[1]) / there[0] - 1.0)
        allowed, length = decay * sqrt(now.dot(now)), sqrt(after.dot(after))
        if step == wanted and length <= allowed:
            return own
        if length > allowed:
            after *= allowed / length
        target = look_up(theta + step)
        rho = target[0] * max(1.0 + after[0] / mean, 0.0)
        end = np.concatenate([[rho * cos(theta + step), rho * sin(theta + step)], target[1:-1] + after[1:]])
        changed: ndarray = (end - at).dot(axes) * scale / hold
        return changed

    def _many(self, X: ndarray) -> ndarray:
        return self.cycle.stabilize(X, self.step(X))

    def _typical_states(self, rng: np.random.Generator, count: int) -> ndarray:
        """Draw states (N, n) about the cycle."""
        cycle = self.cycle
        on = cycle.points(rng.uniform(-np.pi, np.pi, size=count))
        away = 0.3 * cycle.curve[0, 0] * rng.standard_normal((count, self.n_actions)) * cycle.scale
        return cycle.space.step(on, away, 1.0)
