"""Compiled policies read back from files."""

from os import PathLike

from unconstrain.deploy.compiled.additive import Additive
from unconstrain.deploy.compiled.base import CompiledPolicy
from unconstrain.deploy.compiled.centered import LocallyLinear, Potential, RadialBasis
from unconstrain.deploy.compiled.cyclic import CYCLE_ARRAYS, Cyclic
from unconstrain.deploy.compiled.in_space import InSpace
from unconstrain.deploy.compiled.linear import Linear
from unconstrain.deploy.compiled.perceptron import Perceptron
from unconstrain.deploy.compiled.stabilized import STABLE_ARRAYS, Stabilized
from unconstrain.errors import UnconstrainError
from unconstrain.storage import Kind, damaged, read

KINDS: dict[str, type[CompiledPolicy]] = {
    cls.kind: cls for cls in (Linear, RadialBasis, LocallyLinear, Potential, Additive, Perceptron)
}

SPACE_ARRAYS = ("space_base", "space_scale")


def load_compiled(path: str | PathLike[str]) -> CompiledPolicy:
    """Read a compiled policy that `step.save(path)` wrote. The file holds arrays, and nothing in it is run.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    CompiledPolicy
        As it was saved.

    Raises
    ------
    ArchiveError
        The file is missing, damaged, not a compiled policy, or from a newer release.
    """
    tree, arrays = read(path, Kind.COMPILED_POLICY)
    try:
        about, stable, cycle = (tree.get(name) for name in ("space", "stable", "cycle"))
        others = (SPACE_ARRAYS if about is not None else ()) + (STABLE_ARRAYS if stable is not None else ())
        others += CYCLE_ARRAYS if cycle is not None else ()
        step = KINDS[tree["kind"]](**{name: array for name, array in arrays.items() if name not in others})
        if about is not None:
            step = InSpace.restore(step, about, arrays)
        if cycle is not None:
            step = Cyclic.restore(step, cycle, arrays)
        return step if stable is None else Stabilized.restore(step, stable, arrays)
    except (UnconstrainError, ValueError, TypeError, KeyError, AttributeError) as error:
        reason = str(error) if isinstance(error, UnconstrainError) else "its arrays are not those of a policy"
        raise damaged(path, Kind.COMPILED_POLICY, reason) from None
