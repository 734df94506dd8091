"""What all compiled policies share: they are immutable, check shapes, and keep buffers for each thread."""

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from os import PathLike
from typing import Any, ClassVar, NoReturn

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from unconstrain.errors import PolicyError
from unconstrain.storage import Kind, write

BLOCK_ROWS = 4096
AGREEMENT = 1e-12
"""How far a compiled policy may be from the policy it was made of, as a share of the largest term either adds up."""
N_COMPARED = 64


class CompiledPolicy(ABC):
    """A fitted policy as a small immutable callable, `step(x)`.

    It may be called from several threads at once, pickled and copied. States are not checked for NaN, which comes out
    as it went in.

    Parameters
    ----------
    **arrays : ndarray
        Those of the kind, finite.

    Attributes
    ----------
    kind : str
        What it evaluates; see `unconstrain.deploy.compiled`.
    layout : dict
        The names of the kind's arrays, and how many dimensions each has.
    n_states, n_actions : int
        n and d.
    arrays : dict of str to ndarray
        Read-only.

    Raises
    ------
    PolicyError
        The arrays are not finite, or do not go together.
    """

    __slots__ = ("_parts", "_scratch", "_shape", "arrays", "n_actions", "n_states")
    kind: ClassVar[str]
    layout: ClassVar[dict[str, int]]

    arrays: dict[str, ndarray]
    n_states: int
    n_actions: int
    _shape: tuple[int]
    _parts: tuple[Any, ...]
    _scratch: "_Scratch"

    def __init__(self, **arrays: ArrayLike) -> None:
        kept = {}
        for name, ndim in self.layout.items():
            array = np.array(arrays[name], dtype=np.float64, order="C")
            if array.ndim != ndim or not np.isfinite(array).all():
                raise PolicyError(f"{name} of a compiled policy must be finite, of {ndim} dimensions")
            kept[name] = _frozen(array)
        n_states, n_actions = self._dimensions(kept)
        set_once = super().__setattr__
        set_once("arrays", kept)
        set_once("n_states", n_states)
        set_once("n_actions", n_actions)
        set_once("_shape", (n_states,))
        set_once("_parts", tuple(_frozen(a) if isinstance(a, ndarray) else a for a in self._prepare(kept)))
        set_once("_scratch", _Scratch(self._buffers))

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError("a compiled policy does not change: compile the policy again")

    def __delattr__(self, name: str) -> NoReturn:
        raise AttributeError("a compiled policy does not change: compile the policy again")

    def __reduce__(self) -> tuple[Any, ...]:
        return _restore, (type(self), dict(self.arrays))

    def __repr__(self) -> str:
        return f"<compiled {self.kind} policy: {self.n_states} states, {self.n_actions} actions>"

    @abstractmethod
    def __call__(self, x: ArrayLike, out: ndarray | None = None) -> ndarray:
        """Act.

        Parameters
        ----------
        x : array_like of shape (n,) or (N, n)
            One state, or a batch.
        out : ndarray of shape (d,) or (N, d), optional
            Where to write the actions: contiguous and float64. For one state nothing is allocated then.

        Returns
        -------
        ndarray of shape (d,) or (N, d)
            Finite for any finite state within 1e150 of the centres.

        Raises
        ------
        PolicyError
            The states are of another dimension, or `out` cannot take the actions.
        """

    def save(self, path: str | PathLike[str]) -> None:
        """Write the arrays to a file that `load_compiled` reads, and NumPy too.

        Parameters
        ----------
        path : path
            An existing file is replaced.

        Raises
        ------
        UnconstrainError
            The place cannot be written to.
        """
        write(path, Kind.COMPILED_POLICY, *self.contents())

    def contents(self) -> tuple[dict[str, Any], dict[str, ndarray]]:
        """Return what a file holds: a tree that says what the policy is, and arrays by name."""
        return {"kind": self.kind}, self.arrays

    def check_agreement(self, predict: Callable[[ndarray], ndarray]) -> None:
        """Compare with the policy this was made of, at random states near those learnt from, singly and as a batch.

        Parameters
        ----------
        predict : callable
            Returns actions (N, d) or (N,) at states (N, n).

        Raises
        ------
        PolicyError
            The two differ by more than rounding.
        """
        X = self._typical_states(np.random.default_rng(0), N_COMPARED)
        expected = predict(X).reshape(N_COMPARED, -1)
        tolerance = AGREEMENT * max(self.magnitude(X), np.abs(expected).max())
        single = np.array([self(x) for x in X])
        off = max(np.abs(self(X) - expected).max(), np.abs(single - expected).max())
        if not off <= tolerance:
            raise PolicyError(
                f"the compiled policy is {off:.2g} from predict, where {tolerance:.2g} is what rounding explains: "
                "fit with a larger alpha, or report this"
            )

    @abstractmethod
    def magnitude(self, X: ndarray) -> float:
        """Return the largest term that is added up on the way to the actions: what rounding is relative to.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.

        Returns
        -------
        float
        """

    @abstractmethod
    def _dimensions(self, arrays: dict[str, ndarray]) -> tuple[int, int]:
        """Check that the arrays' shapes go together, and return n and d."""

    def _prepare(self, arrays: dict[str, ndarray]) -> tuple[Any, ...]:
        """Lay out what one call needs."""
        return ()

    def _buffers(self) -> tuple[ndarray, ...]:
        """Make a thread's own intermediate results."""
        return ()

    @abstractmethod
    def _many(self, X: ndarray) -> ndarray:
        """Act (N, d) in a checked block of states (N, n)."""

    def _typical_states(self, rng: np.random.Generator, count: int) -> ndarray:
        """Draw states (N, n) about where the policy was learnt."""
        return rng.standard_normal((count, self.n_states))

    def _otherwise(self, x: ArrayLike, out: ndarray | None) -> ndarray:
        """Act in whatever is not one state as an array: a batch, a list, a mistake."""
        X = np.asarray(x, dtype=np.float64)
        if X.ndim not in (1, 2) or X.shape[-1] != self.n_states:
            raise PolicyError(
                f"this compiled policy takes states of {self.n_states} dimensions, (n,) or (N, n), got shape {X.shape}"
            )
        if X.ndim == 1:
            return self(X, out)
        if out is None:
            out = np.empty((len(X), self.n_actions))
        elif out.shape != (len(X), self.n_actions):
            raise self._bad_out(out)
        for start in range(0, len(X), BLOCK_ROWS):
            out[start : start + BLOCK_ROWS] = self._many(X[start : start + BLOCK_ROWS])
        return out

    def _bad_out(self, out: object) -> PolicyError:
        return PolicyError(
            f"out must be a contiguous float64 array ({self.n_actions},) for one state, (N, {self.n_actions}) for a "
            f"batch, got {getattr(out, 'dtype', type(out).__name__)} {getattr(out, 'shape', '')}"
        )


def check_shapes(arrays: dict[str, ndarray], **shapes: tuple[int, ...]) -> None:
    """Check that arrays of a compiled policy have the shapes that others ask for.

    Parameters
    ----------
    arrays : dict of str to ndarray
    **shapes : tuple of int
        By the arrays' names.

    Raises
    ------
    PolicyError
        One has another shape.
    """
    for name, shape in shapes.items():
        if arrays[name].shape != shape:
            raise PolicyError(
                f"{name} of a compiled policy must have shape {shape}, got {arrays[name].shape}"
            )


class _Scratch(threading.local):
    """Buffers of each thread's own, made the first time it asks."""

    def __init__(self, make: Callable[[], tuple[ndarray, ...]]) -> None:
        self.buffers = make()


def _restore(cls: type[CompiledPolicy], arrays: dict[str, ndarray]) -> CompiledPolicy:
    return cls(**arrays)


def _frozen(array: ndarray) -> ndarray:
    array.setflags(write=False)
    return array
