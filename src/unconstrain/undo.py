"""A fit that fails leaves its estimator as it was."""

import functools
from collections.abc import Callable
from typing import Concatenate, ParamSpec, TypeVar

Estimator = TypeVar("Estimator")
Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


def undone_on_failure(
    method: Callable[Concatenate[Estimator, Arguments], Result],
) -> Callable[Concatenate[Estimator, Arguments], Result]:
    """Decorate a method so that, if it raises, the attributes of its object are again what they were.

    Parameters
    ----------
    method : callable
        Of an object whose attributes it sets; it changes none of their values in place.

    Returns
    -------
    callable
        The method.
    """

    @functools.wraps(method)
    def call(self: Estimator, /, *args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
        before = dict(vars(self))
        try:
            return method(self, *args, **kwargs)
        except BaseException:
            for name in vars(self).keys() - before.keys():
                delattr(self, name)
            for name, value in before.items():
                setattr(self, name, value)
            raise

    return call
