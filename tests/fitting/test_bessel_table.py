import numpy as np
import pytest
from scipy.special import gammaln, ive

from unconstrain.fitting.sphere import scaled_bessel


@pytest.mark.parametrize("d", [2, 3, 6, 7, 14, 32, 33])
def test_what_is_interpolated_is_what_bessel_functions_say(d):
    nu = d / 2 - 1
    kappa = np.concatenate([np.arange(0.25, 45.0, 0.25), np.random.default_rng(0).uniform(0.2, 45.0, 5000)])
    log_mean, short = scaled_bessel(d, kappa)
    bessel = ive(nu, kappa)
    np.testing.assert_allclose(
        log_mean, gammaln(d / 2) + nu * np.log(2 / kappa) + np.log(bessel), atol=1e-13, rtol=0
    )
    np.testing.assert_allclose(short, 1 - ive(nu + 1, kappa) / bessel, rtol=2e-13)
