"""PyTorch itself, which is imported when it is first needed."""

from typing import Any

from unconstrain.errors import UnconstrainError


def load_torch() -> Any:
    """Import PyTorch.

    Returns
    -------
    module
        `torch`.

    Raises
    ------
    UnconstrainError
        The extra `torch` is not installed.
    """
    try:
        import torch
    except ImportError:
        raise UnconstrainError(
            "networks need PyTorch, which is not installed: pip install 'unconstrain[torch]'"
        ) from None
    return torch
