"""The exact marginal of a constrained action: a density, with the right gradients, and the limit it is known by."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import quad, simpson
from scipy.special import gammaln

from unconstrain.fitting.bessel import compute_scaled_bessel, scaled_bessel
from unconstrain.fitting.sphere import Sphere, blurred, limit

seeds = st.integers(0, 2**32 - 1)
dimensions = st.integers(1, 400)
logarithms = st.floats(-12, 12)


def mean_over_sphere(d, kappa):
    """`log E exp(κ m₁ - κ)` over the unit sphere, and `1 - E m₁` under that weight, by integration over the angle.

    Written for t = 1 - m₁, and in units of where the integrand lies, so that large κ lose no digits.
    """
    width = min(2.0, 40 * max(d, 2) / kappa)

    def integral(power):
        def of(x):  # t = x², which takes away the singularity at d = 2
            t = x * x
            return 2 * x**power * np.exp(-kappa * t) * (2 - t) ** ((d - 3) / 2) * x ** (d - 3) * x

        return quad(of, 0, np.sqrt(width), epsabs=0, epsrel=1e-11, limit=500)[0]

    area = gammaln(d / 2) - gammaln((d - 1) / 2) - 0.5 * np.log(np.pi)
    return area + np.log(integral(0)), integral(2) / integral(0)


@pytest.mark.parametrize("d", [2, 3, 4, 7, 20])
@pytest.mark.parametrize("kappa", [1e-3, 0.1, 1.0, 10.0, 300.0, 2e3, 1e5])
def test_bessel_functions_are_integrals_over_the_sphere(d, kappa):
    log_mean, short = scaled_bessel(d, np.array([kappa]))
    expected, expected_short = mean_over_sphere(d, kappa)
    np.testing.assert_allclose(log_mean[0], expected, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(short[0], expected_short, rtol=1e-7)


@given(dimensions, logarithms)
def test_neighbouring_orders_obey_the_recurrence(d, exponent):
    """`I_{ν}/I_{ν+1} - I_{ν+2}/I_{ν+1} = 2 (ν+1) / κ`, with quotients a = I_{ν+1}/I_ν: `1/a_ν - a_{ν+1} = d / κ`."""
    kappa = np.array([10.0**exponent])
    _, here = scaled_bessel(d, kappa)
    _, above = scaled_bessel(d + 2, kappa)
    if kappa[0] > 1:  # in the small differences from 1: (s_ν + s_{ν+1} - s_ν s_{ν+1}) / (1 - s_ν) = d / κ
        left = (here + above - here * above) / (1 - here)
        np.testing.assert_allclose(left, d / kappa, rtol=1e-6)
    else:  # a_ν = κ/d to first order, which 1 - s keeps to the rounding of 1
        np.testing.assert_allclose(
            (1 - here) * (d / kappa + (1 - above)), 1.0, atol=1e-10 + 1e-15 * d / kappa[0]
        )


@given(dimensions, logarithms)
def test_the_mean_and_its_slope_agree_and_are_bounded(d, exponent):
    kappa = 10.0**exponent
    step = 1e-4 * kappa
    log_mean, short = scaled_bessel(d, np.array([0.0, kappa - step, kappa, kappa + step]))
    assert log_mean[0] == pytest.approx(0.0, abs=1e-12)
    assert np.all(log_mean <= 1e-12)
    assert np.all(log_mean >= -2 * np.array([0.0, kappa - step, kappa, kappa + step]) - 1e-12)
    assert np.all((short > 0) & (short <= 1)) or d == 1
    rounding = 1e-13 * max(1.0, np.abs(log_mean).max()) * d / step
    np.testing.assert_allclose((log_mean[1] - log_mean[3]) / (2 * step), short[2], rtol=1e-5, atol=rounding)


@pytest.mark.parametrize("d", [1, 2, 3, 50, 400])
def test_the_ways_of_computing_it_join(d):
    nu = d / 2 - 1
    for at in (1e-4 * np.sqrt(d), 1e3 * max(nu, 1.0) ** 2):
        log_mean, short = scaled_bessel(d, at * np.array([1 - 1e-9, 1 + 1e-9]))
        np.testing.assert_allclose(log_mean[0], log_mean[1], rtol=1e-8, atol=1e-9)
        np.testing.assert_allclose(short[0], short[1], rtol=1e-7, atol=1e-15)
    log_mean, short = scaled_bessel(d, np.array([1e12, 0.0]))
    assert np.isfinite(log_mean).all()
    assert short[1] == 1.0 or d == 1
    if d > 1:
        assert short[0] == pytest.approx((d - 1) / 2e12, rel=1e-6)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("s", [0.05, 0.3, 2.0])
@pytest.mark.parametrize("length", [0.0, 1.0])
def test_the_marginal_is_a_density(d, s, length):
    """Integrated over balls about the centre: it depends on ρ alone."""
    p = np.zeros(d)
    p[0] = length
    rho = np.linspace(1e-9, length / 2 + 12 * s, 4001)
    U = np.zeros((len(rho), d))
    U[:, 1] = rho
    U += p / 2
    log = blurred(Sphere.of(U, np.tile(p, (len(rho), 1))), np.full(len(rho), s**2)).log
    shells = {2: 2 * np.pi * rho, 3: 4 * np.pi * rho**2}[d]
    assert simpson(np.exp(log) * shells, x=rho) == pytest.approx(1.0, abs=1e-5)


def test_the_marginal_is_what_simulated_actions_have():
    """In boxes, `d` = 2: points of the circle and noise, with an excentric policy."""
    rng = np.random.default_rng(0)
    p, s, N = np.array([1.0, 0.5]), 0.15, 400_000
    angle = rng.uniform(0, 2 * np.pi, N)
    R = np.linalg.norm(p) / 2
    U = p / 2 + R * np.column_stack([np.cos(angle), np.sin(angle)]) + s * rng.normal(size=(N, 2))
    side = 0.1
    for corner in np.array([[0.0, 0.0], [1.0, 0.5], [0.5, 0.25], [0.4, -0.4]]):
        share = np.mean(np.all(np.abs(U - corner) < side / 2, axis=1))
        grid = corner + side * (np.stack(np.meshgrid(*2 * [np.linspace(-0.45, 0.45, 10)]), -1).reshape(-1, 2))
        density = np.exp(blurred(Sphere.of(grid, np.tile(p, (100, 1))), np.full(100, s**2)).log).mean()
        expected = density * side**2
        assert abs(share - expected) < 5 * np.sqrt(expected / N) + 0.02 * expected


@given(seeds, st.sampled_from([1, 2, 3, 7, 60]), st.floats(-2, 1))
def test_gradients_are_those_of_the_logarithm(seed, d, exponent):
    rng = np.random.default_rng(seed)
    U, P = rng.normal(size=(6, d)), rng.normal(size=(6, d))
    variance = np.full(6, 10.0 ** (2 * exponent))

    def log(P, variance):
        return blurred(Sphere.of(U, P), variance).log

    density = blurred(Sphere.of(U, P), variance)
    h = 1e-6 * min(1.0, 10**exponent)
    numeric = np.stack(
        [(log(P + h * e, variance) - log(P - h * e, variance)) / (2 * h) for e in np.eye(d)], 1
    )
    scale = np.abs(density.log).max() + np.abs(numeric).max()
    np.testing.assert_allclose(density.by_policy, numeric, rtol=1e-4, atol=1e-5 * scale)
    h = 1e-5
    numeric = (log(P, variance * (1 + h)) - log(P, variance * (1 - h))) / (2 * h)
    np.testing.assert_allclose(density.by_variance * variance, numeric, rtol=1e-5, atol=1e-8 * scale)


@given(seeds, st.integers(1, 12), st.floats(-6, -3))
def test_with_little_noise_it_is_a_normal_distance_over_the_area(seed, d, exponent):
    rng = np.random.default_rng(seed)
    P, m = rng.normal(size=(8, d)), rng.normal(size=(8, d))
    m /= np.linalg.norm(m, axis=1, keepdims=True)
    length = np.linalg.norm(P, axis=1, keepdims=True)
    assume(length.min() > 0.05)
    s = 10.0**exponent * length[:, 0]
    U = P / 2 + m * (length / 2 + s[:, None] * rng.normal(size=(8, 1)))
    sphere = Sphere.of(U, P)
    # (ρ/R)^((d-1)/2), and (d-1)(d-3)/8κ: of the order of s/R.
    allowed = 40 * d**2 * 10.0**exponent + 1e-9
    np.testing.assert_allclose(blurred(sphere, s**2).log, limit(sphere, s**2), rtol=0, atol=allowed)


@given(seeds, st.integers(1, 9))
def test_actions_behind_projections_lie_on_the_sphere(seed, d):
    rng = np.random.default_rng(seed)
    P = rng.normal(size=(5, d))
    basis = np.linalg.qr(rng.normal(size=(5, d, d)))[0][:, :, : rng.integers(0, d + 1)]
    U = np.einsum("nik,njk,nj->ni", basis, basis, P)
    sphere = Sphere.of(U, P)
    np.testing.assert_allclose(sphere.distance, 0.0, atol=1e-12)
    np.testing.assert_allclose(sphere.from_center, sphere.radius, atol=1e-12)
    np.testing.assert_allclose(sphere.share, np.sum(U**2, 1) / np.sum(P**2, 1), rtol=1e-9)


@given(seeds, st.integers(1, 9))
def test_the_normal_is_the_slope_of_the_distance(seed, d):
    rng = np.random.default_rng(seed)
    U, P = rng.normal(size=(5, d)), rng.normal(size=(5, d))
    h = 1e-6
    numeric = np.stack(
        [(Sphere.of(U, P + h * e).distance - Sphere.of(U, P - h * e).distance) / (2 * h) for e in np.eye(d)],
        1,
    )
    np.testing.assert_allclose(Sphere.of(U, P).normal, numeric, atol=1e-4 if d == 1 else 1e-6, rtol=1e-4)


@pytest.mark.parametrize("d", [1, 2, 7])
@pytest.mark.parametrize("s2", [1e-20, 1.0, 1e20])
def test_where_nothing_moves_or_nothing_is_predicted_all_is_finite(d, s2):
    zero, some = np.zeros((1, d)), np.ones((1, d))
    for U, P in ((zero, zero), (zero, some), (some, zero), (some / 2, some)):
        density = blurred(Sphere.of(U, P), np.array([s2]))
        for part in (density.log, density.by_policy, density.by_variance):
            assert np.isfinite(part).all()


@pytest.mark.parametrize("d", [2, 3, 7, 27, 64])
def test_interpolated_bessel_functions_are_as_exact(d):
    kappa = np.geomspace(1e-6, 1e6, 40_000)
    log_mean, short = scaled_bessel(d, kappa)
    exact, exact_short = compute_scaled_bessel(d, kappa)
    np.testing.assert_allclose(
        log_mean, exact, rtol=1e-12, atol=1e-12
    )  # logarithms of Γ are a thousand there
    np.testing.assert_allclose(short, exact_short, rtol=3e-12)
