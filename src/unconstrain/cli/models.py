"""Which model a command fits: options that `fit` and `diagnose` share."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from unconstrain.cli.declared import Number, Numbers, gathered, option
from unconstrain.errors import PolicyError

if TYPE_CHECKING:
    from unconstrain.policies.base import Policy

MODELS = ("linear", "rbf", "locally-linear", "auto")
RISKS = ("adaptive", "corrected", "inconsistency", "direct")
PLACEMENTS = ("grid", "kmeans", "coverage")
PLACED = ("centers", "n_centers", "width")
"""Options of models that have centres."""


@dataclass(frozen=True)
class Model:
    """A model by its name, and its options; None stands for the model's own default.

    Raises
    ------
    PolicyError
        An option is given that the model does not have.
    """

    name: str = "locally-linear"
    risk: str = "adaptive"
    alpha: float | str = "cv"
    centers: str | None = None
    n_centers: int | None = None
    width: float | None = None
    scale: list[float] | str | None = None
    noise: float | None = None

    def __post_init__(self) -> None:
        placed = list(self._placed())
        if self.name == "linear" and placed:
            raise PolicyError(f"the linear model has no centres: leave out {placed[0]}=")
        chosen = placed or self.alpha != "cv" or self.risk != "adaptive"
        if self.is_chosen and (chosen or not (self.scale is self.noise is None)):
            raise PolicyError(
                "--model auto makes its own choices: leave out risk=, alpha=, scale=, noise=, centers=, n_centers= and "
                "width="
            )

    @property
    def is_chosen(self) -> bool:
        """Whether the model is chosen among several, which depend on the data."""
        return self.name == "auto"

    def build(self) -> "Policy":
        """Make the estimator; not for a model that is chosen."""
        from unconstrain.features import NormalizedRBF
        from unconstrain.policies import LocallyLinearPolicy, ParametricPolicy

        placed = self._placed()
        shared: dict[str, Any] = {
            "risk": self.risk, "alpha": self.alpha, "scale": self.scale, "noise": self.noise
        }  # fmt: skip
        if self.name == "linear":
            return ParametricPolicy(**shared)
        if self.name == "rbf":
            return ParametricPolicy(NormalizedRBF(**placed), **shared)
        return LocallyLinearPolicy(**placed, **shared)

    def _placed(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in PLACED if getattr(self, name) is not None}


model = gathered(
    "model",
    [
        option(
            "--model",
            "model",
            type=click.Choice(MODELS),
            default="locally-linear",
            show_default=True,
            help="What the policy is made of; auto compares several by what they predict of held-out episodes.",
            section="Model",
        ),
        option(
            "--risk",
            type=click.Choice(RISKS),
            default="adaptive",
            show_default=True,
            help="What is learnt from: adaptive infers which samples were free; inconsistency takes none for free; "
            "corrected does too, less what noise adds, in one pass; direct, ordinary regression, takes all.",
            section="Model",
        ),
        option(
            "--alpha",
            type=Number(zero=True, words=("cv",)),
            default="cv",
            show_default=True,
            help='Weight decay λ: a number, or "cv" to choose it by cross-validation.',
            section="Model",
        ),
        option(
            "--noise",
            type=Number(zero=True),
            help="Standard deviation of the actions' noise, in their unit. By default, of actions that are "
            "differentiated, what the states' noise leaves.",
            section="Model",
        ),
        option(
            "--centers",
            type=click.Choice(PLACEMENTS),
            help="How centres are placed, in models that have them.",
            section="Model",
        ),
        option(
            "--n-centers",
            type=click.IntRange(min=1),
            metavar="NUMBER",
            help="How many centres, in models that have them.",
            section="Model",
        ),
        option(
            "--width",
            type=Number(),
            help="Standard deviation σ of the receptive fields, in the states' unit.",
            section="Model",
        ),
        option(
            "--scale",
            type=Numbers(words=("auto",)),
            help='What a length of one is along each action, "0.1,0.1,1", where these have different units; "auto" '
            "takes how far the states spread. By default so too where radians stand beside other units.",
            section="Model",
        ),
    ],
    lambda model, **options: Model(model, **options),
)
"""Decorator of a command that fits a model, and is called with `model=Model(...)`."""
