"""The models the command line can fit, by name, and their options."""

from typing import Annotated, Any

import typer

from unconstrain.arrays import check_number
from unconstrain.errors import PolicyError
from unconstrain.features import NormalizedRBF
from unconstrain.policies import LocallyLinearPolicy, ParametricPolicy
from unconstrain.policies.base import Policy

MODELS = ("linear", "rbf", "locally-linear", "auto")

Alpha = Annotated[str, typer.Option("--alpha", help='Weight decay λ: a number, or "cv" to choose it.')]
Centers = Annotated[
    str | None, typer.Option("--centers", help="kmeans, grid or coverage, for models with centres.")
]
NCenters = Annotated[int | None, typer.Option("--n-centers", help="How many centres.")]
Width = Annotated[
    float | None, typer.Option("--width", help="σ of the receptive fields, in the states' unit.")
]


def build(
    name: str,
    *,
    risk: str = "inconsistency",
    alpha: str | float = "cv",
    centers: str | None = None,
    n_centers: int | None = None,
    width: float | None = None,
) -> Policy:
    """The estimator called `name`, one of `MODELS` but "auto". Options of None are left to the estimator.

    Raises `PolicyError` for an unknown name, and for options the model does not have.
    """
    placed: dict[str, Any] = {"centers": centers, "n_centers": n_centers, "width": width}
    placed = {option: value for option, value in placed.items() if value is not None}
    if name == "linear":
        if placed:
            raise PolicyError(
                f"the linear model has no centres: leave out --{next(iter(placed)).replace('_', '-')}"
            )
        return ParametricPolicy(risk=risk, alpha=alpha)
    if name == "rbf":
        return ParametricPolicy(NormalizedRBF(**placed), risk=risk, alpha=alpha)
    if name == "locally-linear":
        return LocallyLinearPolicy(**placed, risk=risk, alpha=alpha)
    raise PolicyError(f"there is no model {name!r}: choose one of {', '.join(MODELS)}")


def decay(text: str) -> str | float:
    """`--alpha`: "cv" or a number, not below zero. Raises `PolicyError` for anything else."""
    if text == "cv":
        return text
    try:
        number = float(text)
    except ValueError:
        raise PolicyError(f'--alpha must be a number or "cv", got {text!r}') from None
    return check_number(number, "--alpha", positive=False)
