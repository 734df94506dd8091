"""Fitted regressors of anyone's as bytes, by skops: no pickle, and nothing is put together that is not trusted by name.

Trees, neighbours and boosted models hold compiled parts, which cannot be taken apart attribute by attribute as our own
objects are (`encoding`). skops knows which of these parts are harmless, and names the others.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import UnconstrainError

Bytes = NDArray[np.uint8]


def is_foreign_regressor(value: Any) -> bool:
    """Tell whether an object is a regressor of scikit-learn's interface.

    Parameters
    ----------
    value : object
        Of a class that files of ours do not list.

    Returns
    -------
    bool
        Whether skops is to save it.
    """
    from sklearn.base import BaseEstimator, is_regressor

    return isinstance(value, BaseEstimator) and is_regressor(value)


def dump(regressor: Any) -> Bytes:
    """Turn a regressor into bytes.

    Parameters
    ----------
    regressor : estimator
        Fitted or not.

    Returns
    -------
    ndarray of shape (K,), uint8
        A skops file.

    Raises
    ------
    UnconstrainError
        It holds something that cannot be saved, such as a lambda.
    """
    import skops.io

    try:
        content = skops.io.dumps(regressor)
    except Exception as error:  # of many kinds
        sentence = " ".join(str(error).split())
        raise UnconstrainError(f"the {type(regressor).__name__} cannot be saved: {sentence:.200}") from error
    return np.frombuffer(content, dtype=np.uint8)


def list_untrusted(content: Bytes) -> list[str]:
    """List the types that a regressor's bytes ask for, beside those that are known to be harmless.

    Parameters
    ----------
    content : ndarray of shape (K,), uint8
        From `dump`.

    Returns
    -------
    list of str
        Names, "package.module.Class".
    """
    import skops.io

    return list(skops.io.get_untrusted_types(data=content.tobytes()))


def restore(content: Bytes, trusted: Iterable[str]) -> Any:
    """Put a regressor together again.

    Parameters
    ----------
    content : ndarray of shape (K,), uint8
        From `dump`.
    trusted : iterable of str
        Names of the types that it may hold beside those known to be harmless.

    Returns
    -------
    estimator
        As it was.
    """
    import skops.io

    return skops.io.loads(content.tobytes(), trusted=list(trusted))
