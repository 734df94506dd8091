"""Nothing is written half: a file is written beside its target, and moved into place once it is on the disk."""

import errno
import glob
import os
import shutil
import stat
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from unconstrain.errors import UnconstrainError

try:
    import fcntl
except ImportError:  # not on Windows
    fcntl = None  # type: ignore[assignment]

DIGITS = 12
"""How many hexadecimal digits the name of a temporary file has."""

FilePath = str | os.PathLike[str]

# What the disk may say while we write; any other OSError from inside the block is not about our target.
_DISK_TROUBLE = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG, errno.EIO}


@contextmanager
def replacing(path: FilePath) -> Iterator[Path]:
    """Give a temporary path to write to, and move it over `path` when the block ends without an exception.

    The temporary file lies in the target's own folder (a move between disks is not atomic) and keeps its suffix (some
    writers append one that is missing). It is removed on any exception, Ctrl-C included, and the file that was there
    before then stays as it was. What a killed process left behind is removed when the same target is next written. A
    symbolic link is followed, not replaced.

    Parameters
    ----------
    path : path
        The target. An existing file is replaced, and keeps its permissions.

    Yields
    ------
    Path
        An empty file.

    Raises
    ------
    UnconstrainError
        The folder does not exist or cannot be written to, the target is not a file, or the disk is full.
    """
    target = _target(path)
    try:
        _remove_leftovers(target)
        temporary, lock = _new_beside(target)
    except OSError as error:
        raise _refused(path, error) from error
    try:
        yield temporary
        if target.exists():
            shutil.copymode(target, temporary)
        _flush(temporary)
        os.replace(temporary, target)
        with suppress(OSError):  # not every file system lets a folder be flushed
            _flush(target.parent)
    except BaseException as error:
        with suppress(OSError):
            temporary.unlink()
        if isinstance(error, OSError) and error.errno in _DISK_TROUBLE:
            raise _refused(path, error) from error
        raise
    finally:
        if lock is not None:
            os.close(lock)


def check_writable(path: FilePath) -> None:
    """Raise what `replacing` would raise, before the work whose result is to be written there.

    Parameters
    ----------
    path : path
        The file.

    Raises
    ------
    UnconstrainError
        As for `replacing`.
    """
    with suppress(_OnlyAsked), replacing(path):
        raise _OnlyAsked


def as_path(path: FilePath) -> Path:
    """Take what a user gives as a path, with ``~`` for the home folder.

    Parameters
    ----------
    path : path

    Returns
    -------
    Path

    Raises
    ------
    UnconstrainError
        It is neither text nor a path, or names the home of a user whom there is not.
    """
    try:
        return Path(path).expanduser()
    except (TypeError, RuntimeError) as error:
        raise UnconstrainError(f"{' '.join(repr(path).split()):.60} is no path of a file: {error}") from None


class _OnlyAsked(Exception):
    """Leaves what is there as it was."""


def _target(path: FilePath) -> Path:
    try:
        given = as_path(path)
    except UnconstrainError as error:
        raise UnconstrainError(f"cannot write: {error}") from None
    try:
        target = Path(os.path.realpath(given))
        if not target.parent.is_dir():
            raise UnconstrainError(
                f"cannot write {path}: there is no folder {target.parent}, so make it first"
            )
        mode = target.stat().st_mode
    except FileNotFoundError:
        return target
    except OSError as error:
        raise _refused(path, error) from error
    except UnconstrainError:
        raise
    except (ValueError, RuntimeError) as error:  # a null byte; the home of a user there is not
        raise UnconstrainError(f"cannot write {path!r}: {error}") from None
    if not stat.S_ISREG(mode):
        raise UnconstrainError(f"cannot write {path}: it exists and is not a file, so choose another name")
    return target


def _prefix(target: Path) -> str:
    """Return how the names of temporary files for a target begin; hexadecimal digits and its suffix follow."""
    stem = target.stem.encode("utf-8", "surrogateescape")[:100].decode(
        "utf-8", "ignore"
    )  # names are bounded in bytes
    return f".{stem}.unconstrain-"


def _new_beside(target: Path) -> tuple[Path, int | None]:
    """Make an empty file in the target's folder, and lock it: who finds it unlocked knows that its writer is gone."""
    while True:
        temporary = target.with_name(f"{_prefix(target)}{uuid.uuid4().hex[:DIGITS]}{target.suffix}")
        # Not tempfile: it makes files only their owner can read, whatever the umask says.
        lock = os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666)
        if fcntl is None:  # what is open cannot be moved there
            os.close(lock)
            return temporary, None
        _try_lock(lock)
        if temporary.exists():  # nobody took it for a leftover before it was locked
            return temporary, lock
        os.close(lock)


def _remove_leftovers(target: Path) -> None:
    """Remove what processes that were killed left beside the target."""
    if fcntl is None:
        return
    pattern = glob.escape(_prefix(target)) + DIGITS * "[0-9a-f]" + glob.escape(target.suffix)
    for leftover in glob.glob(pattern, root_dir=target.parent):
        with suppress(OSError):
            file = os.open(target.parent / leftover, os.O_WRONLY)
            try:
                if _try_lock(file):
                    os.unlink(target.parent / leftover)
            finally:
                os.close(file)


def _try_lock(file: int) -> bool:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:  # locked by another, or a file system without locks
        return False
    return True


def _flush(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    file = os.open(path, os.O_RDONLY)
    try:
        os.fsync(file)
    finally:
        os.close(file)


def _refused(path: FilePath, error: OSError) -> UnconstrainError:
    reason = os.strerror(error.errno).lower() if error.errno else str(error)
    return UnconstrainError(f"cannot write {path}: {reason}")
