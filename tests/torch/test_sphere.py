"""The Bessel functions that PyTorch does not have."""

import numpy as np
import pytest

from unconstrain.fitting.bessel import scaled_bessel

torch = pytest.importorskip("torch")


@pytest.mark.parametrize("d", [1, 2, 3, 4, 7, 12, 27, 32, 33, 60, 101])
def test_they_are_those_of_scipy(d):
    from unconstrain.torch.sphere import evaluate, log_mean

    kappa = np.concatenate([[0.0], np.logspace(-8, 20, 500)])
    log, short = scaled_bessel(d, kappa)
    k = torch.tensor(kappa, requires_grad=True)
    value = log_mean(d, k)
    value.sum().backward()
    # SciPy's own quotients lose digits in many dimensions.
    np.testing.assert_allclose(value.detach().numpy(), log, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(-k.grad.numpy(), short, rtol=1e-6, atol=1e-14)
    single, slope = evaluate(d, torch.tensor(kappa, dtype=torch.float32))
    np.testing.assert_allclose(single.numpy(), log, rtol=1e-4, atol=1e-4)
    assert torch.isfinite(slope).all()


def test_the_derivative_is_that_of_the_value():
    from unconstrain.torch.sphere import log_mean

    for d in (1, 2, 5, 40):
        assert torch.autograd.gradcheck(
            lambda k, d=d: log_mean(d, k),
            torch.tensor([0.1, 3.0, 50.0, 4000.0], dtype=torch.float64).requires_grad_(),
        )
