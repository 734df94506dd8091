"""Compiled policies read back from files."""

from os import PathLike

from unconstrain.deploy.compiled.additive import Additive
from unconstrain.deploy.compiled.base import CompiledPolicy
from unconstrain.deploy.compiled.centered import LocallyLinear, Potential, RadialBasis
from unconstrain.deploy.compiled.linear import Linear
from unconstrain.errors import PolicyError
from unconstrain.storage import Kind, damaged, read

KINDS: dict[str, type[CompiledPolicy]] = {
    cls.kind: cls for cls in (Linear, RadialBasis, LocallyLinear, Potential, Additive)
}


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
        return KINDS[tree["kind"]](**arrays)
    except (PolicyError, ValueError, TypeError, KeyError) as error:
        reason = str(error) if isinstance(error, PolicyError) else "its arrays are not those of a policy"
        raise damaged(path, Kind.COMPILED_POLICY, reason) from None
