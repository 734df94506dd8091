"""The regressors that are compared, as their libraries have them.

Options were chosen on the data sets `CHOSEN_ON`, which are not among those reported, of the limit cycle (40 % free) and
the grasps, both with noise: by the error of the same regressor told all projections, never by what is inferred. Of
options that did about as well the faster were taken.
"""

from collections.abc import Callable
from typing import Any

from sklearn.compose import TransformedTargetRegressor
from sklearn.ensemble import ExtraTreesRegressor, HistGradientBoostingRegressor
from sklearn.kernel_ridge import KernelRidge
from sklearn.neighbors import KNeighborsRegressor
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVR

from unconstrain.errors import UnconstrainError

CHOSEN_ON = (1000, 1001)
"""Numbers of the data sets that options were chosen on."""


def make_extra_trees() -> Any:
    """Make 50 extremely randomised trees."""
    return ExtraTreesRegressor(50, min_samples_leaf=3, random_state=0)


def make_boosting() -> Any:
    """Make scikit-learn's boosting on histograms, which takes one target at a time."""
    return HistGradientBoostingRegressor(learning_rate=0.2, max_iter=50, max_leaf_nodes=15, random_state=0)


def make_lightgbm() -> Any:
    """Make LightGBM's boosting. Raises `UnconstrainError` where that package is not installed."""
    try:
        from lightgbm import LGBMRegressor
    except ImportError as error:
        raise UnconstrainError("LightGBM is not installed: pip install lightgbm") from error
    return LGBMRegressor(
        learning_rate=0.2, n_estimators=50, num_leaves=15, random_state=0, n_jobs=1, verbose=-1
    )


def make_neighbours() -> Any:
    """Make the mean of the nearest ten samples, weighted by distance."""
    return make_pipeline(StandardScaler(), KNeighborsRegressor(10, weights="distance"))


def make_kernel_ridge() -> Any:
    """Make kernel ridge regression with a Gaussian kernel."""
    return make_pipeline(StandardScaler(), KernelRidge(kernel="rbf", gamma=0.3, alpha=0.01))


def make_support_vectors() -> Any:
    """Make support vector regression, which takes one target at a time and wants it of unit size."""
    machine = make_pipeline(StandardScaler(), SVR(C=10.0, epsilon=0.05))
    return TransformedTargetRegressor(machine, transformer=StandardScaler())


def make_network() -> Any:
    """Make a network of one hidden layer, fitted by L-BFGS."""
    network = MLPRegressor(hidden_layer_sizes=(50,), solver="lbfgs", alpha=1.0, max_iter=200, random_state=0)
    return TransformedTargetRegressor(make_pipeline(StandardScaler(), network), transformer=StandardScaler())


KINDS: dict[str, Callable[[], Any]] = {
    "extra-trees": make_extra_trees,
    "boosting": make_boosting,
    "lightgbm": make_lightgbm,
    "neighbours": make_neighbours,
    "kernel-ridge": make_kernel_ridge,
    "support-vectors": make_support_vectors,
    "mlp": make_network,
}
"""In the order of the table."""
