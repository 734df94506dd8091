"""The methods that are compared, with the options that are tried."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple, TypeVar

import numpy as np

from benchmarks.rivals import cloning, lpv_ds, mixture, ours, primitives, straight
from benchmarks.rivals.learnt import Learnt, Recorded
from reproduction.adaptive.ways import ADAPTIVE, DIRECT, TOLD

Option = Any

Data = TypeVar("Data", bound=tuple[Any, ...])

LEAVES = (1, 3, 10)
NETWORKS = tuple((sizes, alpha) for sizes in ((50,), (64, 64)) for alpha in (1e-3, 1.0))
MIXTURES = (2, 5, 10, 20, 40)
SYSTEMS = (1, 2, 4, 8, 16)
PRIMITIVES = tuple((weights, smooth) for weights in (10, 25, 50) for smooth in (False, True))


class Method(NamedTuple):
    """A way to learn.

    Attributes
    ----------
    learn : callable
        From what was recorded and an option to what was learnt; None where the method does not apply.
    options : tuple
        That are tried on data sets which are not reported; of one, there is nothing to choose.
    """

    learn: Callable[[Recorded, Option], Learnt | None]
    options: tuple[Option, ...] = (None,)


def _our_own(way: str) -> Method:
    return Method(lambda recorded, _: ours.learn(recorded, way))


RIVALS: Mapping[str, Method] = {
    "GMR": Method(mixture.learn, MIXTURES),
    "LPV-DS": Method(lpv_ds.learn, SYSTEMS),
    "cloning: network": Method(cloning.learn_network, NETWORKS),
    "cloning: trees": Method(cloning.learn_trees, LEAVES),
    "trees of free samples, told which": Method(cloning.learn_free, LEAVES),
    "DMP": Method(primitives.learn, PRIMITIVES),
    "straight line": Method(straight.learn),
}

METHODS: Mapping[str, Method] = {
    "ours: direct": _our_own(DIRECT),
    "ours: adaptive": _our_own(ADAPTIVE),
    "ours: told": _our_own(TOLD),
    "ours: trees, adaptive": Method(ours.wrap_trees, LEAVES[1:2]),
    **RIVALS,
}


def choose(method: Method, cost: Callable[[Learnt, Data], float], sets: Iterable[Data]) -> Option:
    """Choose the option of least mean cost over data sets, of those that are not reported.

    Parameters
    ----------
    method : Method
        One of `METHODS`.
    cost : callable
        From what was learnt and its data set to an error, NaN where it does not apply.
    sets : iterable of tuple
        Data sets; the first entry of each is what is learnt from.

    Returns
    -------
    object
        One of its options; the first where the method does not apply.
    """
    if len(method.options) == 1:
        return method.options[0]
    sets = list(sets)
    costs = []
    for option in method.options:
        learnt = [(method.learn(each[0], option), each) for each in sets]
        costs.append(np.mean([np.inf if found is None else cost(found, each) for found, each in learnt]))
    return method.options[int(np.argmin(costs))]
