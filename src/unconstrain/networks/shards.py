"""Samples as networks take them in: those in memory as one shard, those in files one after the other."""

from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from unconstrain.samples import Samples
from unconstrain.torch.backend import load_torch

PRECISION = "float32"


class Shard(NamedTuple):
    """Samples, and the same as tensors in the unit of the network.

    Parameters
    ----------
    samples : Samples
        In units of the scale, with N samples in the order of time.
    Z : Tensor of shape (N, n)
        Standardised states.
    U : Tensor of shape (N, d)
        Actions.
    N : Tensor of shape (N, d, d) or None
        Projections, NaN where not known.
    weights : Tensor of shape (N,) or None
        How much samples count.
    """

    samples: Samples
    Z: Any
    U: Any
    N: Any
    weights: Any

    @classmethod
    def of(cls, samples: Samples, Z: NDArray[np.float64], unit: float, device: Any) -> "Shard":
        """Move samples to a device.

        Parameters
        ----------
        samples : Samples
            In units of the scale.
        Z : ndarray of shape (N, n)
            Their states, standardised.
        unit : float
            What actions are divided by.
        device : torch.device
            Where to.

        Returns
        -------
        Shard
            Of all of them.
        """
        torch = load_torch()

        def moved(array: Any) -> Any:
            if array is None:
                return None
            return torch.as_tensor(np.ascontiguousarray(array, dtype=PRECISION), device=device)

        parts = Z, samples.actions / unit, samples.projections, samples.weights
        return cls(samples, *(moved(part) for part in parts))

    def __len__(self) -> int:
        return len(self.samples.states)


class Shards:
    """Shards to learn from, read anew in every pass, and one that is held out.

    Parameters
    ----------
    read : callable
        Returns the samples to learn from, in blocks.
    held_out : Samples
        Others.
    prepare : callable
        Makes a shard of samples.
    keep : bool
        Whether shards stay in memory between passes.
    """

    def __init__(
        self,
        read: Callable[[], Iterable[Samples]],
        held_out: Samples,
        prepare: Callable[[Samples], Shard],
        keep: bool,
    ) -> None:
        self._read, self._prepare, self._keep = read, prepare, keep
        self._kept: list[Shard] | None = None
        self.in_memory = keep
        self.held_out = prepare(held_out)

    def __iter__(self) -> Iterator[Shard]:
        if self._kept is not None:
            yield from self._kept
            return
        kept = []
        for samples in self._read():
            if len(samples.states):
                shard = self._prepare(samples)
                kept.append(shard)
                yield shard
                if not self._keep:
                    kept.clear()
        if self._keep:
            self._kept = kept
