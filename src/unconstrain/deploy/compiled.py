"""Policies for a control loop: arrays and a handful of NumPy calls on one state.

`policy.compile()` makes one of five kinds, named by what they evaluate; b is normalised Gaussian activations,
`b_i = K_i / Σ_j K_j`, `K_i = exp(-‖x - c_i‖² / 2σ²)`:

| kind      | pi(x)                             | arrays                                                              |
| --------- | --------------------------------- | ------------------------------------------------------------------- |
| linear    | W x + t                           | coef (d, n), intercept (d,)                                         |
| rbf       | W b(x)                            | centers (M, n), width, weights (d, M)                               |
| local     | Σ_m b_m(x) (B_m x + t_m)          | centers (M, n), width, coef (M, d, n), intercept (M, d)             |
| potential | -∇ wᵀb(x)                         | centers (M, n), width, weights (M,)                                 |
| additive  | Σ_j f_j(x_j), f_j of polynomials  | breaks (n, K), origins (n, K+1), polynomials (n, K+1, degree+1, d)  |

Nothing here is scikit-learn's to evaluate. On one state the cost is that of entering NumPy: arrays are laid out so
that each step is one call, intermediate results go to buffers that each thread has for itself, and the largest
activation is taken out of the others only far away from all centres, where they would underflow otherwise.
"""

import threading
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy import add, divide, exp, multiply, ndarray, subtract

from unconstrain.errors import PolicyError
from unconstrain.receptive import normalized_activations
from unconstrain.storage import Kind, archive

BLOCK_ROWS = 4096

# Where the activations' sum is less than this, their own precision (they are subnormal, or zero) is in doubt.
UNDERFLOW = 1e-200


class CompiledPolicy:
    """A fitted policy as a small immutable callable: `step(x)`.

    x: one state (n,), giving an action (d,), or a batch (N, n), giving (N, d).
    out: where to write the action of one state: a float64 array (d,), contiguous. Then nothing is allocated.

    Safe to call from several threads at once (each has its own buffers), to pickle and to copy. States are not
    checked for NaN: it comes out as it went in. Finite for any finite state within 1e150 of the centres.
    Raises `PolicyError` for states of another dimension, and for an `out` that cannot take the action.

    Attributes: `kind`, `n_states`, `n_actions`, and `arrays`, read-only, by name.
    """

    __slots__ = ("_parts", "_scratch", "_shape", "arrays", "n_actions", "n_states")
    kind: ClassVar[str]
    layout: ClassVar[dict[str, int]]
    """Names of the arrays, and how many dimensions each has."""

    arrays: dict[str, ndarray]
    n_states: int
    n_actions: int
    _shape: tuple[int]
    _parts: tuple
    _scratch: Any

    def __init__(self, **arrays):
        if set(arrays) != set(self.layout):
            raise PolicyError(
                f"a compiled {self.kind} policy holds {', '.join(self.layout)}, got {sorted(arrays)}"
            )
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

    def __setattr__(self, name, value):
        raise AttributeError("a compiled policy does not change: compile the policy again")

    def __delattr__(self, name):
        raise AttributeError("a compiled policy does not change: compile the policy again")

    def __reduce__(self):
        return _restore, (self.kind, dict(self.arrays))

    def __repr__(self) -> str:
        return f"<compiled {self.kind} policy: {self.n_states} states, {self.n_actions} actions>"

    def __call__(self, x, out: ndarray | None = None) -> ndarray:
        raise NotImplementedError

    def save(self, path: str | Path) -> None:
        """Write the arrays to `path` as NPZ, in the layout of docs/compiled.md, to be read by `load_compiled`."""
        archive.write(path, Kind.COMPILED_POLICY, {"kind": self.kind}, self.arrays)

    def magnitude(self, X: ndarray) -> float:
        """The largest term that is added up on the way to the actions at X (N, n): what rounding is relative to."""
        raise NotImplementedError

    def _dimensions(self, arrays: dict[str, ndarray]) -> tuple[int, int]:
        """n and d, after a check that the arrays' shapes go together."""
        raise NotImplementedError

    def _prepare(self, arrays: dict[str, ndarray]) -> tuple:
        """What one call needs, laid out for it."""
        return ()

    def _buffers(self) -> tuple[ndarray, ...]:
        """A thread's own intermediate results."""
        return ()

    def _many(self, X: ndarray) -> ndarray:
        """Actions (N, d) for a checked block of states (N, n)."""
        raise NotImplementedError

    def _otherwise(self, x, out) -> ndarray:
        """Whatever is not one state as an array: a batch, a list, a mistake."""
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

    def _bad_out(self, out) -> PolicyError:
        return PolicyError(
            f"out must be a contiguous float64 array ({self.n_actions},) for one state, (N, {self.n_actions}) for a "
            f"batch, got {getattr(out, 'dtype', type(out).__name__)} {getattr(out, 'shape', '')}"
        )


class Linear(CompiledPolicy):
    """`W x + t`."""

    __slots__ = ()
    kind = "linear"
    layout: ClassVar = {"coef": 2, "intercept": 1}

    def __call__(self, x, out=None):
        if type(x) is not ndarray or x.shape != self._shape:
            return self._otherwise(x, out)
        coef, intercept = self._parts
        try:
            out = coef.dot(x, out)
            return add(out, intercept, out)
        except (ValueError, TypeError) as error:
            raise self._bad_out(out) from error

    def magnitude(self, X):
        return float((np.abs(X) @ np.abs(self.arrays["coef"]).T + np.abs(self.arrays["intercept"])).max())

    def _dimensions(self, arrays):
        d, n = arrays["coef"].shape
        _check(arrays, intercept=(d,))
        return n, d

    def _prepare(self, arrays):
        return arrays["coef"], arrays["intercept"]

    def _many(self, X):
        return X @ self.arrays["coef"].T + self.arrays["intercept"]


class _Centered(CompiledPolicy):
    """What blends over centres: one row of numbers per centre, added up with the activations as weights.

    A subclass lays out those rows, the last of each a one, so that a single product gives all sums and their norm.
    """

    __slots__ = ()

    def _sums(self, x: ndarray) -> tuple:
        """The buffers, with `Σ_i K_i rows_i` in the second; activations times a common factor are as good."""
        columns, scale, rows = self._parts[:3]
        buffers = self._scratch.buffers
        differences, sums, activations = buffers[:3]
        subtract(columns, x[:, None], differences)
        multiply(differences, differences, differences)
        scale.dot(differences, activations)
        exp(activations, activations)
        activations.dot(rows, sums)
        if not sums[-1] > UNDERFLOW:
            self._far(x, activations)
            activations.dot(rows, sums)
        return buffers

    def _far(self, x: ndarray, activations: ndarray) -> None:
        """`K_i / max K`, by what is left of `‖x - c_i‖²` once `‖x - m‖²`, the same for all, is taken out.

        m is the centres' mean. Nothing is squared but the centres, so nothing overflows.
        """
        centers, width = self.arrays["centers"], float(self.arrays["width"])
        mean = centers.mean(axis=0)
        away = (centers - mean) / width
        activations[:] = away @ ((x - mean) / width) - 0.5 * np.sum(away**2, axis=1)
        activations -= activations.max()
        exp(activations, activations)

    def _dimensions(self, arrays):
        M, n = arrays["centers"].shape
        if not M or not arrays["width"] > 0:
            raise PolicyError("a compiled policy needs at least one centre, and a width above zero")
        return n, self._outputs(arrays, M, n)

    def _outputs(self, arrays, M: int, n: int) -> int:
        """d, after a check of the arrays that are not the centres."""
        raise NotImplementedError

    def _prepare(self, arrays):
        rows = self._rows(arrays)
        rows = np.column_stack([rows, np.ones(len(rows))])
        n = arrays["centers"].shape[1]
        scale = np.full(n, -0.5 / arrays["width"] ** 2)
        return np.ascontiguousarray(arrays["centers"].T), scale, np.ascontiguousarray(rows)

    def _rows(self, arrays) -> ndarray:
        """The numbers (M, k) that are blended."""
        raise NotImplementedError

    def _buffers(self):
        columns, _, rows = self._parts[:3]
        return np.empty_like(columns), np.empty(rows.shape[1]), np.empty(len(rows))

    def _blend(self, X: ndarray) -> ndarray:
        return normalized_activations(X, self.arrays["centers"], float(self.arrays["width"]))


class RadialBasis(_Centered):
    """`W b(x)`."""

    __slots__ = ()
    kind = "rbf"
    layout: ClassVar = {"centers": 2, "width": 0, "weights": 2}

    def __call__(self, x, out=None):
        if type(x) is not ndarray or x.shape != self._shape:
            return self._otherwise(x, out)
        _, sums, _, actions = self._sums(x)
        try:
            return divide(actions, sums[-1], out)
        except (ValueError, TypeError) as error:
            raise self._bad_out(out) from error

    def magnitude(self, X):
        return float(np.abs(self.arrays["weights"]).max())

    def _outputs(self, arrays, M, n):
        d = len(arrays["weights"])
        _check(arrays, weights=(d, M))
        return d

    def _rows(self, arrays):
        return arrays["weights"].T

    def _buffers(self):
        differences, sums, activations = super()._buffers()
        return differences, sums, activations, sums[:-1]

    def _many(self, X):
        return self._blend(X) @ self.arrays["weights"].T


class LocallyLinear(_Centered):
    """`Σ_m b_m(x) (B_m x + t_m)`: the models are blended first, then applied once."""

    __slots__ = ()
    kind = "local"
    layout: ClassVar = {"centers": 2, "width": 0, "coef": 3, "intercept": 2}

    def __call__(self, x, out=None):
        if type(x) is not ndarray or x.shape != self._shape:
            return self._otherwise(x, out)
        _, sums, _, coef, intercept = self._sums(x)
        try:
            out = coef.dot(x, out)
            add(out, intercept, out)
            return divide(out, sums[-1], out)
        except (ValueError, TypeError) as error:
            raise self._bad_out(out) from error

    def magnitude(self, X):
        coef, intercept = self.arrays["coef"], self.arrays["intercept"]
        return float((np.abs(X) @ np.abs(coef).max(axis=0).T + np.abs(intercept).max(axis=0)).max())

    def _outputs(self, arrays, M, n):
        d = arrays["intercept"].shape[1]
        _check(arrays, coef=(M, d, n), intercept=(M, d))
        return d

    def _rows(self, arrays):
        return np.column_stack([arrays["coef"].reshape(len(arrays["coef"]), -1), arrays["intercept"]])

    def _buffers(self):
        differences, sums, activations = super()._buffers()
        d, n = self.n_actions, self.n_states
        return differences, sums, activations, sums[: d * n].reshape(d, n), sums[d * n : -1]

    def _many(self, X):
        coef, intercept = self.arrays["coef"], self.arrays["intercept"]
        local = (X @ coef.reshape(-1, self.n_states).T).reshape(len(X), *intercept.shape) + intercept
        return np.einsum("nm,nmd->nd", self._blend(X), local)


class Potential(_Centered):
    """`-∇ wᵀb(x) = (Σ w_i b_i · Σ b_i c_i - Σ w_i b_i c_i) / σ²`, with centres counted from their mean."""

    __slots__ = ()
    kind = "potential"
    layout: ClassVar = {"centers": 2, "width": 0, "weights": 1}

    def __call__(self, x, out=None):
        if type(x) is not ndarray or x.shape != self._shape:
            return self._otherwise(x, out)
        _, sums, _, pulls, centre = self._sums(x)
        total, rate = sums[-1], self._parts[3]
        try:
            out = multiply(centre, sums[-2] / total, out)
            subtract(out, pulls, out)
            return multiply(out, rate / total, out)
        except (ValueError, TypeError) as error:
            raise self._bad_out(out) from error

    def magnitude(self, X):
        away = self.arrays["centers"] - self.arrays["centers"].mean(axis=0)
        return float(np.abs(self.arrays["weights"]).max() * np.abs(away).max() / self.arrays["width"] ** 2)

    def _outputs(self, arrays, M, n):
        _check(arrays, weights=(M,))
        return n

    def _prepare(self, arrays):
        return (*super()._prepare(arrays), 1.0 / float(arrays["width"]) ** 2)

    def _rows(self, arrays):
        away, weights = arrays["centers"] - arrays["centers"].mean(axis=0), arrays["weights"][:, None]
        return np.column_stack([weights * away, away, weights])

    def _buffers(self):
        differences, sums, activations = super()._buffers()
        n = self.n_states
        return differences, sums, activations, sums[:n], sums[n : 2 * n]

    def _many(self, X):
        sums = self._blend(X) @ self._parts[2]
        n = self.n_states
        return (sums[:, -2, None] * sums[:, n : 2 * n] - sums[:, :n]) * self._parts[3]


class Additive(CompiledPolicy):
    """`Σ_j f_j(x_j)`, each f_j from R to R^d by polynomials between breaks.

    Between breaks k-1 and k of dimension j (before the first and after the last where k is 0 or K) it is
    `Σ_p polynomials[j, k, p] (x_j - origins[j, k])^p`. A state on a break belongs to what comes after it.
    """

    __slots__ = ()
    kind = "additive"
    layout: ClassVar = {"breaks": 2, "origins": 2, "polynomials": 4}

    def __call__(self, x, out=None):
        if type(x) is not ndarray or x.shape != self._shape:
            return self._otherwise(x, out)
        breaks, origins, polynomials, first, ones = self._parts
        above, powers, piece = self._scratch.buffers
        np.greater_equal(x[:, None], breaks, above)
        above.dot(ones, piece)  # how many breaks lie below, which is the piece
        index = piece.astype(np.intp)
        index += first
        offset = subtract(x, origins[index])
        for p in range(1, powers.shape[1]):
            multiply(powers[:, p - 1], offset, powers[:, p])
        try:
            return powers.reshape(-1).dot(polynomials[index].reshape(-1, self.n_actions), out)
        except (ValueError, TypeError) as error:
            raise self._bad_out(out) from error

    def magnitude(self, X):
        offsets, polynomials = self._pieces(X)
        powers = np.abs(offsets)[..., None] ** np.arange(polynomials.shape[2])
        return float(np.einsum("njp,njpd->nd", powers, np.abs(polynomials)).max())

    def _dimensions(self, arrays):
        n, pieces, _, d = arrays["polynomials"].shape
        _check(arrays, breaks=(n, pieces - 1), origins=(n, pieces))
        if not (np.diff(arrays["breaks"], axis=1) >= 0).all():
            raise PolicyError("the breaks of a compiled policy must be in order")
        return n, d

    def _prepare(self, arrays):
        n, pieces, order, d = arrays["polynomials"].shape
        return (
            arrays["breaks"],
            arrays["origins"].reshape(-1),
            arrays["polynomials"].reshape(-1, order, d),
            np.arange(n) * pieces,
            np.ones(pieces - 1),
        )

    def _buffers(self):
        n, pieces, order, _ = self.arrays["polynomials"].shape
        return np.empty((n, pieces - 1)), np.ones((n, order)), np.empty(n)

    def _pieces(self, X):
        """For each state and dimension the offset from the piece's origin (N, n), and its polynomial (N, n, p, d)."""
        breaks, origins, polynomials, first, _ = self._parts
        piece = np.column_stack(
            [np.searchsorted(b, x, side="right") for b, x in zip(breaks, X.T, strict=True)]
        )
        return X - origins[piece + first], polynomials[piece + first]

    def _many(self, X):
        offsets, polynomials = self._pieces(X)
        result = polynomials[:, :, -1]
        for p in range(polynomials.shape[2] - 2, -1, -1):
            result = result * offsets[..., None] + polynomials[:, :, p]
        return result.sum(axis=1)


KINDS: dict[str, type[CompiledPolicy]] = {
    cls.kind: cls for cls in (Linear, RadialBasis, LocallyLinear, Potential, Additive)
}


def load_compiled(path: str | Path) -> CompiledPolicy:
    """The compiled policy that `step.save(path)` wrote. Holds arrays only; nothing in the file is executed.

    Raises `ArchiveError` for a file that is missing, not a compiled policy, damaged, or from a newer release.
    """
    tree, arrays = archive.read(path, Kind.COMPILED_POLICY)
    try:
        return KINDS[tree["kind"]](**arrays)
    except (PolicyError, ValueError, TypeError, KeyError) as error:
        raise archive.damaged(path, Kind.COMPILED_POLICY, str(error)) from None


class _Scratch(threading.local):
    """Buffers of each thread's own, made the first time it asks."""

    def __init__(self, make):
        self.buffers = make()


def _restore(kind: str, arrays: dict[str, ndarray]) -> CompiledPolicy:
    return KINDS[kind](**arrays)


def _frozen(array: ndarray) -> ndarray:
    array.setflags(write=False)
    return array


def _check(arrays: dict[str, ndarray], **shapes: tuple[int, ...]) -> None:
    for name, shape in shapes.items():
        if arrays[name].shape != shape:
            raise PolicyError(
                f"{name} of a compiled policy must have shape {shape}, got {arrays[name].shape}"
            )
