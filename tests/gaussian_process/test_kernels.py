import numpy as np
import pytest
from sklearn.base import clone
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct

import unconstrain as uc
from unconstrain.gaussian_process.pairs import every_direction

RNG = np.random.default_rng(0)
SEPARABLE = ConstantKernel(0.5) * uc.kernels.Separable(RBF([1.0, 2.0]) + DotProduct(0.7), 3)
POTENTIAL = ConstantKernel(2.0) * uc.kernels.CurlFree(0.8) + uc.kernels.CurlFreeQuadratic()
KERNELS = {"separable": (SEPARABLE, 5), "potential": (POTENTIAL, 4)}


@pytest.mark.parametrize("name", KERNELS)
def test_a_kernel_is_a_covariance_with_the_gradient_it_says(name):
    kernel, columns = KERNELS[name]
    rows, step = RNG.normal(size=(7, columns)), 1e-6
    K, gradient = clone(kernel)(rows, eval_gradient=True)
    assert np.linalg.eigvalsh(K)[0] > -1e-10
    np.testing.assert_allclose(np.diagonal(K), kernel.diag(rows))
    np.testing.assert_allclose(kernel(rows, rows[:2]), K[:, :2])
    for i, theta in enumerate(kernel.theta + step * np.eye(len(kernel.theta))):
        slope = (kernel.clone_with_theta(theta)(rows) - K) / step
        np.testing.assert_allclose(gradient[:, :, i], slope, atol=1e-4)


def hessian(k, x, y, step=1e-4):
    """Compute `∂²k / ∂x ∂y` by central differences."""
    axes = step * np.eye(len(x))
    return np.array(
        [
            [
                (k(x + a, y + b) - k(x - a, y + b) - k(x + a, y - b) + k(x - a, y - b)) / (4 * step**2)
                for b in axes
            ]
            for a in axes
        ]
    )


def test_curl_free_kernels_are_second_derivatives_of_those_of_potentials():
    x, y, scale = RNG.normal(size=2), RNG.normal(size=2), 0.8
    for kernel, k in (
        (uc.kernels.CurlFree(scale), lambda a, b: scale**2 * np.exp(-np.sum((a - b) ** 2) / (2 * scale**2))),
        (uc.kernels.CurlFreeQuadratic(), lambda a, b: (a @ b) ** 2 / 2),
    ):
        K = kernel(every_direction(x[None], 2), every_direction(y[None], 2))
        np.testing.assert_allclose(K, hessian(k, x, y), atol=1e-6)
