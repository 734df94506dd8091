"""What both losses are given, checked and laid out alike."""

from typing import TYPE_CHECKING, Any, NamedTuple

from unconstrain.errors import DataError
from unconstrain.torch.backend import load_torch

if TYPE_CHECKING:
    from torch import Tensor

REDUCTIONS = ("mean", "sum", "none")


class Batch(NamedTuple):
    """Samples as tensors of N rows, in the precision that losses are computed in.

    Parameters
    ----------
    P, U : Tensor of shape (N, d)
        Predictions and actions.
    known : Tensor of shape (N,), bool, or None
        Where the projection is known; None where none is.
    N : Tensor of shape (N, d, d) or None
        The projections, zero where one is not known.
    free : Tensor of shape (N,) or None
        Probability that a sample was free.
    weights : Tensor of shape (N,) or None
        How much each counts.
    """

    P: "Tensor"
    U: "Tensor"
    known: "Tensor | None"
    N: "Tensor | None"
    free: "Tensor | None"
    weights: "Tensor | None"

    @classmethod
    def of(
        cls, predicted: "Tensor", actions: Any, projections: Any = None, free: Any = None, weights: Any = None
    ) -> "Batch":
        """Check what a loss was given.

        Nothing here looks at values, for which a GPU would have to be waited for.

        Parameters
        ----------
        predicted : Tensor of shape (..., d)
            Predictions. All else is moved to their device.
        actions : Tensor or array_like of shape (..., d)
            Actions.
        projections : Tensor or array_like of shape (..., d, d), optional
            NaN where not known.
        free, weights : Tensor or array_like of shape (...), optional
            Of each sample.

        Returns
        -------
        Batch
            In double precision where the device has it: sums over a few numbers of a sample cost next to nothing.

        Raises
        ------
        DataError
            Shapes do not go together.
        UnconstrainError
            PyTorch is not installed.
        """
        torch = load_torch()
        if not isinstance(predicted, torch.Tensor):
            raise DataError(
                f"predictions must be a tensor, got {type(predicted).__name__}: of arrays, "
                "uc.metrics.inconsistency computes the same"
            )
        if predicted.ndim < 1 or not predicted.is_floating_point():
            raise DataError(
                f"predictions must be real numbers (..., d), got {predicted.dtype} of shape {tuple(predicted.shape)}"
            )
        precision = torch.float32 if predicted.device.type == "mps" else torch.float64
        *samples, d = predicted.shape

        def laid_out(value: Any, name: str, *last: int) -> Any:
            if value is None:
                return None
            tensor = torch.as_tensor(value, device=predicted.device, dtype=precision)
            if tuple(tensor.shape) != (*samples, *last):
                raise DataError(
                    f"{name} {tuple(tensor.shape)} must have the shape {(*samples, *last)} beside predictions "
                    f"{tuple(predicted.shape)}"
                )
            return tensor.reshape(-1, *last)

        N = laid_out(projections, "projections", d, d)
        known = None
        if N is not None:
            known = ~torch.isnan(N).flatten(1).any(dim=1)
            N = torch.where(known[:, None, None], N, 0.0)
        return cls(
            predicted.to(precision).reshape(-1, d),
            laid_out(actions, "actions", d),
            known,
            N,
            laid_out(free, "free"),
            laid_out(weights, "weights"),
        )

    def behind(self) -> "tuple[Tensor, Tensor]":
        """Compute what is left of errors behind the known projections.

        Returns
        -------
        squares : Tensor of shape (N,)
            `‖u - p‖²`, or `‖N (u - p)‖²` where N is known.
        ranks : Tensor of shape (N,)
            How many numbers that are: d, or the rank of N.
        """
        error = self.U - self.P
        squares = (error**2).sum(dim=1)
        ranks = error.new_full((len(error),), error.shape[1])
        if self.known is None or self.N is None:
            return squares, ranks
        left = ((self.N @ error[:, :, None])[:, :, 0] ** 2).sum(dim=1)
        of_rank = self.N.diagonal(dim1=1, dim2=2).sum(dim=1)
        known = self.known
        return left.where(known, squares), of_rank.where(known, ranks)

    def reduce(self, each: "Tensor", reduction: str, like: "Tensor") -> "Tensor":
        """Add the losses of samples up.

        Parameters
        ----------
        each : Tensor of shape (N,)
            Of each sample.
        reduction : {"mean", "sum", "none"}
            How. The mean is that of the weights.
        like : Tensor of shape (..., d)
            The predictions as they were given.

        Returns
        -------
        Tensor
            A number, or of shape (...), in the precision of the predictions.

        Raises
        ------
        DataError
            There is no such reduction.
        """
        if reduction not in REDUCTIONS:
            raise DataError(f"reduction must be one of {', '.join(REDUCTIONS)}, got {reduction!r:.40}")
        if self.weights is not None:
            each = each * self.weights
        if reduction == "none":
            return each.reshape(like.shape[:-1]).to(like.dtype)
        total = each.sum()
        if reduction == "mean":
            total = total / (len(each) if self.weights is None else self.weights.sum())
        return total.to(like.dtype)


def check_noise(noise: Any, like: "Tensor", *, positive: bool) -> "Tensor":
    """Check the standard deviation of the actions' noise.

    Parameters
    ----------
    noise : float or Tensor
        One for all, or of shape (N,).
    like : Tensor
        Whose device and precision it gets.
    positive : bool
        Whether it must be above zero. That of a tensor is not looked at, for which a GPU would have to be waited for.

    Returns
    -------
    Tensor
        The same.

    Raises
    ------
    DataError
        It is negative, no number, or zero where it must not be.
    """
    torch = load_torch()
    if not isinstance(noise, torch.Tensor):
        try:
            value = float(noise)
        except (TypeError, ValueError):
            value = float("nan")
        if not (0 < value < float("inf") or (value == 0 and not positive)):
            raise DataError(
                f"noise must be a {'positive' if positive else 'non-negative'} number, in units of the action, got "
                f"{noise!r:.40}"
            )
    return torch.as_tensor(noise, device=like.device, dtype=like.dtype)
