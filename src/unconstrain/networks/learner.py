"""Descent on a loss until held-out samples say stop."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.networks.model import NetworkModel, check_output
from unconstrain.networks.shards import Shard, Shards
from unconstrain.torch import inconsistency_loss
from unconstrain.torch.backend import load_torch

Weights = dict[str, NDArray[Any]]

CUT, MOST_CUTS = 0.3, 3
"""By what the rate is lowered where held-out samples are not explained any better, and how often before the end."""

STEPS, LEAST_BATCH = 25, 32
"""In an epoch so many steps are taken at least, unless that leaves fewer samples for each."""

NOTICEABLE = 1e-3
"""Share of the loss by which an epoch has to be better to count as progress."""


@dataclass(frozen=True)
class Options:
    """How networks descend.

    Parameters
    ----------
    learning_rate, weight_decay : float
        Of Adam.
    batch_size : int
        Samples in a step.
    max_epochs, patience : int
        Epochs at most, and epochs without progress before the rate is lowered.
    device : torch.device
        Where.
    """

    learning_rate: float
    weight_decay: float
    batch_size: int
    max_epochs: int
    patience: int
    device: Any


LossOf = Callable[[Any, Shard, Any], Any]
"""From predictions of some rows of a shard in the unit, the shard, and the rows, to the loss."""


class Learner:
    """A network that descends.

    Parameters
    ----------
    model : NetworkModel
        Which network.
    shards : Shards
        What it learns from.
    options : Options
        How.
    seed : int
        Of its weights and of the order of samples.
    tick : callable
        Called after each epoch.
    """

    def __init__(
        self, model: NetworkModel, shards: Shards, options: Options, seed: int, tick: Callable[[], None]
    ) -> None:
        self.model, self.shards, self.options, self.tick = model, shards, options, tick
        torch = load_torch()
        # The user's own random numbers go on as if nothing had been drawn.
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self.network = model.make().to(options.device)
        self.rng = np.random.default_rng(seed)
        self.restart(options.learning_rate)

    @property
    def weights(self) -> Weights:
        """The parameters as they are now, by name."""
        state = self.network.state_dict()
        return {name: value.detach().cpu().numpy().copy() for name, value in state.items()}

    def load(self, weights: Weights) -> None:
        """Go on from other parameters.

        Parameters
        ----------
        weights : dict of str to ndarray
            As `weights` returns them.
        """
        torch = load_torch()
        self.network.load_state_dict({name: torch.as_tensor(value) for name, value in weights.items()})

    def restart(self, rate: float) -> None:
        """Forget how earlier steps went.

        Parameters
        ----------
        rate : float
            The learning rate from now on.
        """
        torch = load_torch()
        parameters = [each for each in self.network.parameters() if each.requires_grad]
        self.rate, fused = rate, self.options.device.type in ("cpu", "cuda")
        self.optimizer = torch.optim.AdamW(
            parameters, lr=rate, weight_decay=self.options.weight_decay, fused=fused
        )

    def cut(self) -> None:
        """Lower the learning rate."""
        self.rate *= CUT
        for group in self.optimizer.param_groups:
            group["lr"] = self.rate

    def epoch(self, shard: Shard, loss_of: LossOf) -> None:
        """Take a step for each minibatch of a shard, in random order.

        Parameters
        ----------
        shard : Shard
            To learn from.
        loss_of : callable
            The loss of some of its rows.
        """
        torch = load_torch()
        self.network.train()
        order = torch.as_tensor(self.rng.permutation(len(shard)), device=self.options.device)
        # Little data get more steps; and a last minibatch of a few samples would count as much as a full one.
        size = min(self.options.batch_size, max(LEAST_BATCH, len(shard) // STEPS))
        n_batches = max(1, round(len(shard) / size))
        for rows in torch.tensor_split(order, n_batches):
            self.optimizer.zero_grad(set_to_none=True)
            loss_of(self.forward(shard, rows), shard, rows).backward()
            torch.nn.utils.clip_grad_norm_(self.network.parameters(), 10.0)
            self.optimizer.step()

    def forward(self, shard: Shard, rows: Any) -> Any:
        """Predict some rows of a shard.

        Parameters
        ----------
        shard : Shard
            Samples.
        rows : Tensor of int, or slice
            Which.

        Returns
        -------
        Tensor of shape (n, d)
            In the unit.
        """
        Z = shard.Z[rows]
        return check_output(self.network(Z), len(Z), self.model.n_actions)

    def held_out_loss(self, loss_of: LossOf) -> float:
        """Compute the loss of the samples that are held out.

        Parameters
        ----------
        loss_of : callable
            As for `epoch`.

        Returns
        -------
        float
            Their mean.
        """
        torch = load_torch()
        self.network.eval()
        rows = slice(None)
        with torch.no_grad():
            shard = self.shards.held_out
            return float(loss_of(self.forward(shard, rows), shard, rows))

    def fit(self, loss_of: LossOf) -> Weights:
        """Descend until held-out samples are not explained any better.

        Parameters
        ----------
        loss_of : callable
            As for `epoch`.

        Returns
        -------
        dict of str to ndarray
            The parameters that explained them best, which the network has now.
        """
        stop = Stopping(self, self.options.patience)
        for _ in range(self.options.max_epochs):
            for shard in self.shards:
                self.epoch(shard, loss_of)
            self.tick()
            stop.look(self.held_out_loss(loss_of))
            if stop.is_done:
                break
        self.load(stop.best)
        return stop.best


class Stopping:
    """Keeps the best parameters, lowers the rate where there is no progress, and says when to end.

    Parameters
    ----------
    learner : Learner
        Whose.
    patience, most_cuts : int
        Looks without progress after which the rate is lowered, and how often it is before the end.
    """

    def __init__(self, learner: Learner, patience: int, most_cuts: int = MOST_CUTS) -> None:
        self.learner, self.best = learner, learner.weights
        self.patience, self.most_cuts = patience, most_cuts
        self.least, self.mark = np.inf, np.inf
        self.without_progress, self.cuts = 0, 0
        self.kept: Any = None

    def look(self, loss: float, also: Any = None) -> None:
        """Look at the held-out loss of an epoch.

        Parameters
        ----------
        loss : float
            The smaller the better.
        also : object
            Kept beside the best parameters.
        """
        if loss < self.least:
            self.least, self.best, self.kept = loss, self.learner.weights, also
        if loss < self.mark - NOTICEABLE * min(abs(loss), 1.0):
            self.mark, self.without_progress = loss, 0
            return
        self.without_progress += 1
        if self.without_progress >= self.patience:
            self.cuts, self.without_progress = self.cuts + 1, 0
            self.learner.load(self.best)
            self.learner.cut()

    @property
    def is_done(self) -> bool:
        """Whether the rate was lowered often enough."""
        return self.cuts > self.most_cuts


def whole_loss(P: Any, shard: Shard, rows: Any) -> Any:
    """Compare predictions with whole actions, or with what is behind a known projection.

    Parameters
    ----------
    P : Tensor of shape (n, d)
        Predictions.
    shard : Shard
        Samples.
    rows : Tensor of int, or slice
        Which of them.

    Returns
    -------
    Tensor
        The mean.
    """
    return inconsistency_loss(
        P, shard.U[rows], _some(shard.N, rows), free=P.new_ones(len(P)), weights=_some(shard.weights, rows)
    )


def published_loss(P: Any, shard: Shard, rows: Any) -> Any:
    """Compute the inconsistency.

    Parameters
    ----------
    P : Tensor of shape (n, d)
        Predictions.
    shard : Shard
        Samples.
    rows : Tensor of int, or slice
        Which of them.

    Returns
    -------
    Tensor
        The mean.
    """
    return inconsistency_loss(P, shard.U[rows], _some(shard.N, rows), weights=_some(shard.weights, rows))


def direct_loss(P: Any, shard: Shard, rows: Any) -> Any:
    """Compare predictions with whole actions, whatever is known of projections.

    Parameters
    ----------
    P : Tensor of shape (n, d)
        Predictions.
    shard : Shard
        Samples.
    rows : Tensor of int, or slice
        Which of them.

    Returns
    -------
    Tensor
        The mean.
    """
    return inconsistency_loss(P, shard.U[rows], free=P.new_ones(len(P)), weights=_some(shard.weights, rows))


def _some(tensor: Any, rows: Any) -> Any:
    return None if tensor is None else tensor[rows]
