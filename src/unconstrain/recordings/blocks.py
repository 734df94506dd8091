"""What a stream is read as: blocks of samples, one after the other."""

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from unconstrain.samples import Samples

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Block:
    """Rows `start` to `stop` of a source, which `load` turns into samples; threads may load several at a time."""

    start: int
    stop: int
    load: Callable[[], Samples]


class Source(Protocol):
    """Where a stream comes from."""

    @property
    def n_rows(self) -> int | None:
        """How many rows there are, where that is known."""
        ...

    @property
    def repeatable(self) -> bool:
        """Whether it can be read more than once."""
        ...

    @property
    def scalar_actions(self) -> bool:
        """Whether the actions are of shape (N,)."""
        ...

    @property
    def tells_constraints(self) -> bool:
        """Whether samples come with projections."""
        ...

    def head(self) -> tuple[Array, Array | None]:
        """A few states (N, n) and actions (N, d) (None where they are yet to be differentiated)."""
        ...

    def sample(self, n_rows: int, random_state: int | None) -> tuple[Array, Array | None]:
        """States and actions of at most `n_rows` rows, or None for the actions; all of them where there are no more."""
        ...

    def blocks(self, start: int = 0, stop: int | None = None) -> Generator[Block, None, None]:
        """Blocks that begin at row `start`, where an earlier block ended, and end with row `stop`."""
        ...

    def identity(self) -> str:
        """What tells this source from another, for whoever comes back to it."""
        ...
