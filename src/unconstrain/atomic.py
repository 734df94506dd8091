"""Nothing is written half: write beside the target, then move into place."""

import errno
import os
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from unconstrain.errors import UnconstrainError

# What the disk may say while we write; any other OSError from inside the block is not about our target.
_DISK_TROUBLE = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG, errno.EIO}


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary path to write to; move it over `path` when the block ends without an exception.

    The temporary file lies in the target's own folder (a move between disks is not atomic) and keeps its
    suffix (some writers append one that is missing). It is removed on any exception, Ctrl-C included, and
    the file that was there before then stays as it was. A symbolic link is followed, not replaced.

    Raises
    ------
    UnconstrainError
        The folder does not exist or cannot be written to, the target is not a file, or the disk is full.
    """
    target = Path(os.path.realpath(Path(path).expanduser()))
    if not target.parent.is_dir():
        raise UnconstrainError(f"cannot write {path}: there is no folder {target.parent}, so make it first")
    if target.exists() and not target.is_file():
        raise UnconstrainError(f"cannot write {path}: it exists and is not a file, so choose another name")
    temporary = target.with_name(f".{target.stem[:100]}-{uuid.uuid4().hex[:12]}{target.suffix}")
    try:
        # Not tempfile: it makes files only their owner can read, whatever the umask says.
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
    except OSError as error:
        raise UnconstrainError(f"cannot write {path}: {_reason(error)}") from error
    try:
        yield temporary
        if target.exists():
            shutil.copymode(target, temporary)
        os.replace(temporary, target)
    except BaseException as error:
        with suppress(OSError):
            temporary.unlink()
        if isinstance(error, OSError) and error.errno in _DISK_TROUBLE:
            raise UnconstrainError(f"cannot write {path}: {_reason(error)}") from error
        raise


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise what `replacing` would raise of this path, before the work whose result is to be written there."""
    with suppress(_OnlyAsked), replacing(path):
        raise _OnlyAsked


class _OnlyAsked(Exception):
    """Leaves what is there as it was."""


def _reason(error: OSError) -> str:
    return os.strerror(error.errno).lower() if error.errno else str(error)
