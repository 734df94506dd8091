"""Fit a Lyapunov function to actions, so that they make it fall as far as that can be."""

from collections.abc import Sequence

import numpy as np

from unconstrain.stability.lyapunov import Array, Lyapunov
from unconstrain.waiting import each

N_TERMS = 3
"""Asymmetric quadratics beside the quadratic."""

N_STATES = 2000
"""How many states are looked at, at most."""

RESTARTS, ITERATIONS = 4, 300
"""Of the search, which begins with the squared distance and asymmetric quadratics at random."""

LEAST = 0.05
"""What P₀ is at least, where states are a length of one from the goal and P₀ begins as the identity."""

MARGIN = 0.05
"""Share of an action's length by which V is to fall at least, so that it does so beside the samples too."""

DECAY = 5e-4
"""Of the parameters. It keeps V from valleys so narrow that an action held for a moment would cross them."""


def learn_lyapunov(
    E: Array,
    U: Array,
    wanted: Array,
    blocks: Sequence[tuple[int, bool]],
    *,
    n_terms: int = N_TERMS,
    random_state: int = 0,
) -> Lyapunov:
    """Find V for which actions have to be changed as little as possible.

    It minimises the mean of `max(0, ∇Vᵀ(u - v) / ‖∇V‖ + 0.05 ‖u‖)²`: by how much each action u would have to be changed
    for V to fall as fast as it does on the straight way to the goal, with velocity v.

    Parameters
    ----------
    E : ndarray of shape (N, d)
        From the goal to the states, not all zero.
    U : ndarray of shape (N, d)
        Actions there.
    wanted : ndarray of shape (N, d)
        Velocities v towards the goal.
    blocks : sequence of (int, bool)
        How the numbers of e fall into parts: how many there are, and whether they are plain numbers. V is round in a
        part that is not, and has asymmetric terms only over those that are.
    n_terms : int
        L.
    random_state : int
        Where the search begins.

    Returns
    -------
    Lyapunov
        In units of E.
    """
    from scipy.optimize import minimize

    chosen = np.linspace(0, len(E) - 1, min(len(E), N_STATES)).round().astype(int)
    E, U, wanted = E[chosen], U[chosen], wanted[chosen]
    length, speed = (float(np.sqrt(np.mean(np.sum(A**2, axis=1)))) for A in (E, U))
    d = E.shape[1]
    flat = np.repeat([is_flat for _, is_flat in blocks], [count for count, _ in blocks])
    n_terms = n_terms if flat.any() else 0
    loss = _Loss(E / length, U / (speed or 1.0), wanted / (speed or 1.0), n_terms, blocks, flat)
    rng = np.random.default_rng(random_state)
    best = None
    for _ in each(range(RESTARTS if n_terms else 1), "making it stable", unit="starts"):
        roots = np.concatenate([np.eye(d)[None], 0.5 * rng.normal(size=(n_terms, d, d))])
        begin = np.concatenate([loss.shape(roots).ravel(), rng.normal(size=n_terms * d)])
        found = minimize(loss, begin, jac=True, method="L-BFGS-B", options={"maxiter": ITERATIONS})
        best = found if best is None or found.fun < best.fun else best
    assert best is not None
    matrices, offsets = loss.parameters(best.x)[1:]
    return Lyapunov(matrices / length**2, offsets * length)


class _Loss:
    """The mean squared change of the actions, and its derivative by the roots of the matrices and the offsets."""

    def __init__(
        self,
        E: Array,
        U: Array,
        wanted: Array,
        n_terms: int,
        blocks: Sequence[tuple[int, bool]],
        flat: Array,
    ) -> None:
        self.E, self.n_terms, self.blocks, self.flat = E, n_terms, blocks, flat
        self.beyond = U - wanted
        self.margin = MARGIN * np.linalg.norm(U, axis=1)

    def shape(self, roots: Array) -> Array:
        """Take out what the parts of a state rule out, (L + 1, d, d)."""
        shaped = np.zeros_like(roots)
        begin = 0
        for count, is_flat in self.blocks:
            at = slice(begin, begin + count)
            if not is_flat:
                shaped[0, at, at] = np.eye(count) * np.trace(roots[0, at, at]) / count
            begin += count
        plain = np.outer(self.flat, self.flat)
        shaped[0] += roots[0] * plain
        shaped[1:] = roots[1:] * plain
        return shaped

    def parameters(self, x: Array) -> tuple[Array, Array, Array]:
        """Return the roots, the matrices and the offsets."""
        L, d = self.n_terms, self.E.shape[1]
        roots = x[: (L + 1) * d * d].reshape(L + 1, d, d)
        matrices = roots @ roots.transpose(0, 2, 1)
        matrices[0] += LEAST * np.eye(d)
        return roots, matrices, x[(L + 1) * d * d :].reshape(L, d)

    def __call__(self, x: Array) -> tuple[float, Array]:
        roots, P, offsets = self.parameters(x)
        E, count = self.E, len(self.E)
        products = np.einsum("lij,nj->nli", P, E)
        linear = np.einsum("lij,lj->li", P[1:], offsets)
        parts = np.maximum(0.0, np.einsum("nli,ni->nl", products[:, 1:] - linear, E))
        slopes = 2.0 * products[:, 1:] - linear
        gradient = 2.0 * products[:, 0] + 2.0 * np.einsum("nl,nli->ni", parts, slopes)
        length = np.sqrt(np.sum(gradient**2, axis=1) + 1e-12)
        rises = np.sum(gradient * self.beyond, axis=1)
        change = np.maximum(0.0, rises / length + self.margin)
        # By the gradient of V, and from there by what it is made of.
        outer = (2.0 / count) * change[:, None]
        by_gradient = outer * (self.beyond / length[:, None] - (rises / length**3)[:, None] * gradient)
        by_parts = 2.0 * (parts > 0) * np.einsum("ni,nli->nl", by_gradient, slopes)
        by_matrices = np.empty_like(P)
        by_matrices[0] = 2.0 * by_gradient.T @ E
        by_offsets = np.empty_like(offsets)
        for term, offset in enumerate(offsets):
            weighted, part = by_parts[:, term], parts[:, term]
            pulled = 2.0 * part[:, None] * by_gradient
            by_matrices[term + 1] = (weighted[:, None] * E).T @ (E - offset) + pulled.T @ (2.0 * E - offset)
            by_offsets[term] = -(weighted @ products[:, term + 1]) - P[term + 1] @ pulled.sum(axis=0)
        by_roots = self.shape((by_matrices + by_matrices.transpose(0, 2, 1)) @ roots)
        slope = np.concatenate([by_roots.ravel(), by_offsets.ravel()]) + 2.0 * DECAY * x
        return float(np.mean(change**2) + DECAY * np.sum(x**2)), slope
