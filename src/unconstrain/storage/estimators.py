"""Fitted regressors of anyone's as bytes, by skops: no pickle, and nothing is put together that is not trusted by name.

Trees, neighbours and boosted models hold compiled parts, which cannot be taken apart attribute by attribute as our own
objects are (`encoding`).
"""

import io
import json
import zipfile
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import UnconstrainError

Bytes = NDArray[np.uint8]

LARGEST_EXPANSION, SMALLEST_LIMIT = 20, 10**7
"""How many times larger than its bytes a regressor may be, and how many bytes it may have in any case."""


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
        lambdas = [name for name in skops.io.get_untrusted_types(data=content) if "<" in name]
        if lambdas:
            raise ValueError(f"{lambdas[0]} has no name by which it could be found again; define it with def")
    except Exception as error:  # of many kinds
        sentence = " ".join(str(error).split())
        raise UnconstrainError(f"the {type(regressor).__name__} cannot be saved: {sentence:.200}") from error
    return np.frombuffer(content, dtype=np.uint8)


def list_types(content: Bytes) -> list[str]:
    """List the types that have to be trusted: the regressor's own, and those of its parts that skops does not know.

    What skops knows to be harmless when it is put together need not be harmless when it predicts: compiled code reads
    where its arrays tell it to. So none is read without its name having been given.

    Parameters
    ----------
    content : ndarray of shape (K,), uint8
        From `dump`.

    Returns
    -------
    list of str
        Names, "package.module.Class".

    Raises
    ------
    ValueError
        It is no regressor that `dump` wrote.
    """
    import skops.io

    data = content.tobytes()
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        sizes = [entry.file_size for entry in archive.infolist()]
        if sum(sizes) > max(LARGEST_EXPANSION * len(data), SMALLEST_LIMIT):
            raise ValueError("it grows beyond measure when it is unpacked")
        top = json.loads(archive.read("schema.json"))
    own = f"{top['__module__']}.{top['__class__']}"
    return list(dict.fromkeys([own, *skops.io.get_untrusted_types(data=data)]))


def restore(content: Bytes, trusted: Iterable[str]) -> Any:
    """Put a regressor together again.

    Parameters
    ----------
    content : ndarray of shape (K,), uint8
        From `dump`.
    trusted : iterable of str
        Names of the types that it may hold, as `list_types` lists them.

    Returns
    -------
    estimator
        As it was.
    """
    import skops.io

    return skops.io.loads(content.tobytes(), trusted=list(trusted))
