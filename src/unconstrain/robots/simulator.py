"""MuJoCo, imported when it is first needed."""

import os
from types import ModuleType

from unconstrain.errors import UnconstrainError


def import_mujoco() -> ModuleType:
    """Import the package `mujoco`, its batches included.

    Returns
    -------
    module
        The package.

    Raises
    ------
    UnconstrainError
        If it is not installed, or does not start because the OpenGL asked for is missing.
    """
    try:
        import mujoco
        import mujoco.batch
    except ImportError as error:
        raise UnconstrainError(
            f"robots are simulated by MuJoCo, which cannot be imported here ({error}): "
            "pip install 'unconstrain[sim]'"
        ) from error
    except Exception as error:  # MuJoCo looks for OpenGL while it is imported, and how that fails differs
        raise UnconstrainError(
            f"MuJoCo cannot be imported with MUJOCO_GL={os.environ.get('MUJOCO_GL')} ({error}): unset it, or "
            "install the OpenGL that it names"
        ) from error
    return mujoco


def one_line(error: Exception) -> str:
    """Put the text of MuJoCo's error, which may have several lines, into one.

    Parameters
    ----------
    error : Exception
        Raised by MuJoCo, or in reading a file.

    Returns
    -------
    str
        The text, its white space single blanks.
    """
    return " ".join(str(error).split())
