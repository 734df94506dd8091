"""The inconsistency of Howard et al. (ICRA 2009, eq. 7) as a loss, and the same without what noise adds to it."""

from typing import TYPE_CHECKING, Any

from unconstrain.torch.backend import load_torch
from unconstrain.torch.batch import Batch, check_noise

if TYPE_CHECKING:
    from torch import Tensor


def inconsistency_loss(
    predicted: "Tensor",
    actions: Any,
    projections: Any = None,
    noise: Any = 0.0,
    free: Any = None,
    *,
    weights: Any = None,
    reduction: str = "mean",
) -> "Tensor":
    """Compare predictions with actions in the directions that were surely free.

    Parameters
    ----------
    predicted : Tensor of shape (..., d)
        What a network says the unconstrained policy does.
    actions : Tensor or array_like of shape (..., d)
        Recorded actions, in the same unit.
    projections : Tensor or array_like of shape (..., d, d), optional
        Nullspace projections that are known; all NaN where one is not.
    noise : float or Tensor
        Standard deviation of the noise of the actions, in their unit. By default there is none.
    free : Tensor or array_like of shape (...), optional
        Which samples were free: booleans, or probabilities. By default none was.
    weights : Tensor or array_like of shape (...), optional
        How much each sample counts, 1 by default.
    reduction : {"mean", "sum", "none"}
        The (weighted) mean over samples, their sum, or each.

    Returns
    -------
    Tensor
        In squared units of the action: a number, or of shape (...) for "none". Without noise it is
        `uc.metrics.inconsistency`, and where samples are free `uc.metrics.shown_error`.

    Raises
    ------
    DataError
        Shapes do not go together, or an option is impossible.
    UnconstrainError
        PyTorch is not installed.

    Notes
    -----
    A sample contributes `(r - ûᵀp)²` with `r = ‖u‖` and `û = u / r`, nothing if it does not move; `‖u - p‖²` if it was
    free; `‖N (u - p)‖²` if its projection N is known.

    With noise σ that is biased: `E[uᵀ(u - π)] = d σ²`. So with noise the first of these becomes

        [(y - uᵀp)² - σ²‖p‖² + 2 (d+2) σ² uᵀp - (2d+4) σ² y + d (d+2) σ⁴] / s,    y = uᵀu,

    whose expectation and whose expected gradient are zero at the true policy, wherever on its sphere `Nπ` lies
    (`fitting.corrected`). s is the mean of y over the *other* samples given, since it must not depend on this sample's
    noise; so long actions count more than short ones, unlike without noise. From the others `σ² rank N` is taken away.

    Corrected, the loss is not bounded below: where a network has learnt its samples by heart, longer predictions across
    the actions lower it without end. Stop on held-out data, or use `adaptive_loss`, which has no such valley.

    References
    ----------
    Howard et al., ICRA 2009, eq. (7). Kukush, Markovsky, Van Huffel, Computational Statistics and Data Analysis 47,
    2004.
    """
    batch = Batch.of(predicted, actions, projections, free, weights)
    sigma = check_noise(noise, batch.P, positive=False).detach()
    squares, ranks = batch.behind()
    variance = sigma**2
    along = _published(batch) if _is_none(noise) else _corrected(batch, variance)
    whole = squares - variance * ranks
    if batch.known is not None:
        along = whole.where(batch.known, along)
    if batch.free is not None:
        along = batch.free * whole + (1 - batch.free) * along
    return batch.reduce(along, reduction, predicted)


def _is_none(noise: Any) -> bool:
    return not isinstance(noise, load_torch().Tensor) and float(noise) == 0.0


def _published(batch: Batch) -> "Tensor":
    """Compute `(r - ûᵀp)²`, zero for an action that does not move; (N,)."""
    r = batch.U.norm(dim=1)
    moves = r > 0
    unit = batch.U / r.where(moves, 1.0)[:, None]
    return (r - (unit * batch.P).sum(dim=1)) ** 2


def _corrected(batch: Batch, variance: "Tensor") -> "Tensor":
    """Compute the same less what noise of this variance adds, each action weighted by its square; (N,)."""
    U, P, v, d = batch.U, batch.P, variance, batch.U.shape[1]
    y, along = (U**2).sum(dim=1), (U * P).sum(dim=1)
    error = (y - along) ** 2 - v * (P**2).sum(dim=1) + 2 * (d + 2) * v * along
    error = error - (2 * d + 4) * v * y + d * (d + 2) * v**2
    others = (y.sum() - y) / max(len(y) - 1, 1) if len(y) > 1 else y
    return error / others.where(others > 0, 1.0)
