"""How large actions and policies may be."""

import numpy as np

from unconstrain.errors import DataError

SMALLEST_SCALE, LARGEST_SCALE = 1e-120, 1e120
"""Mean squares of the actions between which variances can be squared, and their inverses."""

LARGEST_POLICY = 2.0
"""How many times √d larger than what is recorded a policy may be. Of a large enough one anything is left: near the
origin its sphere passes by every action. Were but one direction left to move in, √d would be about right."""


def check_scale(scale: float, risk: str) -> None:
    """Refuse actions whose powers are no numbers any more.

    Parameters
    ----------
    scale : float
        Mean squared length of the actions, in squared units of the action.
    risk : str
        Which needs these powers.

    Raises
    ------
    DataError
        The scale is outside the range in which variances can be squared.
    """
    if not SMALLEST_SCALE < scale < LARGEST_SCALE:
        raise DataError(
            f"the actions' root mean square is {np.sqrt(scale):.3g}, and powers of that which the {risk} risk needs "
            "are no numbers any more: give the actions in another unit"
        )


def is_plausible(size: float, n_actions: int) -> bool:
    """Tell whether a policy may be as large as it is.

    Parameters
    ----------
    size : float
        How many times larger the policy is than what is recorded, root mean square.
    n_actions : int
        Dimension of the actions, d.

    Returns
    -------
    bool
        Whether it is.
    """
    return bool(size <= LARGEST_POLICY * np.sqrt(n_actions))
