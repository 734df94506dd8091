"""How well velocities are found whose truth is known.

`python -m benchmarks.velocities` prints the table of docs/velocities.md.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from unconstrain.recordings import differentiate
from unconstrain.recordings.smoothing import find_smoothing

SECONDS = 8.0
RATES = (30, 100, 1000)
NOISE = (0.0, 0.001, 0.01, 0.05)
TICKS = (0.001, 0.01)
USUAL = 0.2


class Row(NamedTuple):
    """A signal, the windows (s) found and best in hindsight, and the root mean square errors they leave, as a share."""

    signal: str
    rate: int
    noise: str
    found: float
    best: float
    error_usual: float
    error_found: float
    error_best: float


def circle(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A circle of radius 1, once in 2 s."""
    w = np.pi
    return np.stack([np.cos(w * t), np.sin(w * t)], 1), w * np.stack([-np.sin(w * t), np.cos(w * t)], 1)


def reaches(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Reaches of 1 s there and back by minimum jerk, with rests of 0.5 s."""
    s = np.mod(t, 3.0)
    there, back = np.clip(s, 0.0, 1.0), np.clip(s - 1.5, 0.0, 1.0)

    def place(u):
        return 10 * u**3 - 15 * u**4 + 6 * u**5

    def speed(u):
        return 30 * u**2 - 60 * u**3 + 30 * u**4

    along = np.array([0.8, 0.6, 0.3])
    return (place(there) - place(back))[:, None] * along, (speed(there) - speed(back))[:, None] * along


def limit_cycle(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The oscillator of van der Pol, which is slow and fast by turns."""

    def flow(_, x):
        return 2.0 * np.array([x[1], 2.0 * (1 - x[0] ** 2) * x[1] - x[0]])

    X = solve_ivp(flow, (0.0, t[-1]), [1.0, 0.0], t_eval=t, rtol=1e-9, atol=1e-11).y.T
    return X / 2, np.array([flow(0.0, x) for x in X]) / 2


SIGNALS: dict[str, Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]] = {
    "circle": circle,
    "reaches": reaches,
    "limit cycle": limit_cycle,
}


def rows(rates: tuple[int, ...] = RATES) -> Iterator[Row]:
    """Measure signal by signal."""
    rng = np.random.default_rng(0)
    for signal, make in SIGNALS.items():
        for rate in rates:
            t = np.arange(int(SECONDS * rate)) / rate
            X, V = make(t)
            for noise in NOISE:
                yield _row(signal, rate, f"{noise:.1%}", X + noise * rng.standard_normal(X.shape), V, t)
            for tick in TICKS:
                yield _row(signal, rate, f"ticks of {tick:.1%}", np.round(X / tick) * tick, V, t)


def _row(signal: str, rate: int, noise: str, X: np.ndarray, V: np.ndarray, t: np.ndarray) -> Row:
    def error(window):
        return float(np.sqrt(np.mean((differentiate(X, t, window=window) - V) ** 2) / np.mean(V**2)))

    halves = np.unique(np.round(2.0 ** np.arange(0, np.log2(len(t) / 3), 0.25)))
    windows = [2 * half / rate for half in halves]
    errors = [error(window) for window in windows]
    best = int(np.argmin(errors))
    found = find_smoothing(X, t)
    assert found is not None
    return Row(
        signal, rate, noise, found.window, windows[best], error(USUAL), error(found.window), errors[best]
    )


def main() -> None:
    print(
        "| signal | Hz | noise | window found | best | error over 0.2 s | as found | best | as found / best |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    ratios = []
    for row in rows():
        ratios.append(row.error_found / row.error_best)
        print(
            f"| {row.signal} | {row.rate} | {row.noise} | {row.found:.3g} s | {row.best:.3g} s | {row.error_usual:.2%} "
            f"| {row.error_found:.2%} | {row.error_best:.2%} | {ratios[-1]:.2f} |"
        )
    within = np.mean(np.array(ratios) <= 1.3)
    print(
        f"\nwithin 1.3 times the best: {within:.0%} of {len(ratios)} rows; the worst {max(ratios):.2f} times"
    )


if __name__ == "__main__":
    main()
