"""Random data, models and constraints for the property tests."""

import numpy as np
from hypothesis import strategies as st

import unconstrain as uc


@st.composite
def problems(draw, min_samples=2, max_samples=60, max_dim=4):
    """States X (N, n), true policy Pi (N, d), projections N (N, d, d), actions U = N Pi, and a generator."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    samples = draw(st.integers(min_samples, max_samples))
    n, d = draw(st.integers(1, max_dim)), draw(st.integers(1, max_dim))
    X = rng.normal(size=(samples, n)) * 10.0 ** draw(st.integers(-2, 2))
    Pi = np.sin(X @ rng.normal(size=(n, d))) * 10.0 ** draw(st.integers(-3, 3)) + rng.normal(size=d)
    # Ranks differ from sample to sample; some constraints block everything.
    rows = rng.normal(size=(samples, d, d)) * (
        rng.random((samples, d, 1)) < draw(st.sampled_from([0.0, 0.3, 0.7]))
    )
    N = uc.constraints.projection(rows)
    return X, Pi, N, np.einsum("nij,nj->ni", N, Pi), rng


def rotation(d, rng):
    """A random orthogonal matrix (d, d)."""
    return np.linalg.qr(rng.normal(size=(d, d)))[0]
