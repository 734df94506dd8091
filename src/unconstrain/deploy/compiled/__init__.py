"""Policies for a control loop: arrays, and a handful of NumPy calls on one state.

A compiled policy is of one of six kinds, named by what it evaluates. b are normalised Gaussian activations,
`b_i = K_i / Σ_j K_j` with `K_i = exp(-‖x - c_i‖² / 2σ²)`:

| kind      | π(x)                              | arrays                                                              |
| --------- | --------------------------------- | ------------------------------------------------------------------- |
| linear    | W x + t                           | coef (d, n), intercept (d,)                                         |
| rbf       | W b(x)                            | centers (M, n), width, weights (d, M)                               |
| local     | Σ_m b_m(x) (B_m x + t_m)          | centers (M, n), width, coef (M, d, n), intercept (M, d)             |
| potential | -∇ wᵀb(x)                         | centers (M, n), width, weights (M,)                                 |
| additive  | Σ_j f_j(x_j), f_j of polynomials  | breaks (n, K), origins (n, K+1), polynomials (n, K+1, degree+1, d)  |
| network   | mean_e [L z + W h(z) + b]         | weights (E, P), sizes (K+1,), center, spread (n,)                   |

`InSpace` is one of these behind what a space makes of the state, and before a scale. `Stabilized` is any of them, and
the smallest change of its actions that leads to a goal; `Cyclic` that which keeps to a cycle.

On one state the cost is that of entering NumPy. So arrays are laid out for each step to be one call, intermediate
results go to buffers that each thread has for itself, and the largest activation is taken out of the others only far
away from all centres, where they would underflow otherwise.
"""

from unconstrain.deploy.compiled.additive import Additive
from unconstrain.deploy.compiled.base import CompiledPolicy
from unconstrain.deploy.compiled.centered import LocallyLinear, Potential, RadialBasis
from unconstrain.deploy.compiled.cyclic import Cyclic
from unconstrain.deploy.compiled.in_space import InSpace
from unconstrain.deploy.compiled.linear import Linear
from unconstrain.deploy.compiled.loading import load_compiled
from unconstrain.deploy.compiled.perceptron import Perceptron
from unconstrain.deploy.compiled.stabilized import Stabilized

__all__ = [
    "Additive",
    "CompiledPolicy",
    "Cyclic",
    "InSpace",
    "Linear",
    "LocallyLinear",
    "Perceptron",
    "Potential",
    "RadialBasis",
    "Stabilized",
    "load_compiled",
]
