"""Tables in Markdown, and how numbers are written in them."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Write a table, a line per row."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def mean_and_deviation(values: NDArray[np.float64], mean: str = ".2g", deviation: str | None = None) -> str:
    """Write the mean ± standard deviation of some values, each in the format given."""
    return f"{np.mean(values):{mean}} ± {np.std(values):{deviation or mean}}"
