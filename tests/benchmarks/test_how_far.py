"""The simulated cluster of docs/how_far.md."""

import logging

import pytest

pytest.importorskip("distributed")

from benchmarks.far.costs import Costs
from benchmarks.far.simulation import simulate
from unconstrain.scaling.tree import plant

ROWS = 10


@pytest.fixture(autouse=True)
def quiet():
    logger = logging.getLogger("distributed")
    level = logger.level
    logger.setLevel(logging.ERROR)
    yield
    logger.setLevel(level)


def passed(n_parts, n_workers, costs, **options):
    tree = plant((print,), range(n_parts), print, print)
    return simulate(
        tree, {key: ROWS + i for i, key in enumerate(tree.parts)}, n_workers, costs, **options
    ), sum(ROWS + i for i in range(n_parts))


def test_one_worker_takes_the_sum_of_what_there_is_to_do():
    done, rows = passed(37, 1, Costs(row=0.5, row_bytes=2.0, storage=8.0, adding=0.125), timed=False)
    assert done.rows == rows
    assert done.seconds == pytest.approx(0.75 * rows + 0.125 * 36)
    assert (done.computing, done.reading) == (pytest.approx(0.5 * rows), pytest.approx(0.25 * rows))
    assert done.moved == done.scheduler == 0.0


@pytest.mark.parametrize("one_by_one", [False, True])
def test_all_rows_are_counted_once_whatever_the_network_and_the_scheduler_take(one_by_one):
    costs = Costs(
        0.01, packed=1e4, result=1e4, network=1e6, delay=1e-3, packing=1e-3, adding=1e-3, spread=0.5
    )
    for n_parts, n_workers in ((1, 3), (2, 1), (41, 7)):
        done, rows = passed(n_parts, n_workers, costs, one_by_one=one_by_one)
        assert done.rows == rows
        assert done.moved <= costs.packed * (n_parts - 1)
        assert done.scheduler > 0


def test_twice_the_workers_are_no_slower():
    times = [passed(64, n, Costs(row=1.0), timed=False)[0].seconds for n in (1, 2, 4, 8, 16)]
    assert times == sorted(times, reverse=True)
    assert times[-1] < 1.5 * times[0] / 16
