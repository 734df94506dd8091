"""What a kernel is made of."""

from sklearn.gaussian_process.kernels import Kernel

from unconstrain.gaussian_process.kernels import CurlFree, CurlFreeQuadratic


def parts_of(kernel: Kernel) -> list[Kernel]:
    """List a kernel and all that it is made of.

    Parameters
    ----------
    kernel : Kernel
        Any.

    Returns
    -------
    list of Kernel
        The kernel itself first.
    """
    inner = [value for value in kernel.get_params(deep=True).values() if isinstance(value, Kernel)]
    return [kernel, *inner]


def is_separable(kernel: Kernel) -> bool:
    """Whether all actions vary alike, and apart from each other.

    Parameters
    ----------
    kernel : Kernel
        On pairs of states and directions.

    Returns
    -------
    bool
        False where some part of it is curl-free.
    """
    return not any(isinstance(part, CurlFree | CurlFreeQuadratic) for part in parts_of(kernel))
