"""Which files are meant, where they lie, and what to call them."""

import glob
import hashlib
import os
import re
import stat
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any, TypeVar

import pyarrow as pa
import pyarrow.fs

from unconstrain.errors import DataError

Paths = str | os.PathLike[str] | Iterable[str | os.PathLike[str]]

PARQUET = (".parquet", ".pq")
"""How the names of files in a folder end that are parts of one recording."""

PROBED = 65_536
"""Bytes at either end of a file by which it is told from another."""

ANSWER_SECONDS = 30.0
"""How long an object store may take to answer for the first time."""

Answer = TypeVar("Answer")


@dataclass(frozen=True)
class File:
    """A file on disk or in an object store.

    Parameters
    ----------
    shown : str
        The path as the user would write it.
    path : str
        The path in the file system.
    filesystem : pyarrow.fs.FileSystem
    """

    shown: str
    path: str
    filesystem: Any

    def __getstate__(self) -> dict[str, Any]:
        """Return what travels to another process, where the size and the like are asked for again."""
        return {"shown": self.shown, "path": self.path, "filesystem": self.filesystem}

    @property
    def name(self) -> str:
        """The last part of the path."""
        return PurePosixPath(self.path).name

    @property
    def suffix(self) -> str:
        """The suffix in small letters, with its dot."""
        return PurePosixPath(self.path).suffix.lower()

    @property
    def local(self) -> bool:
        """Whether the file lies on this machine."""
        return isinstance(self.filesystem, pyarrow.fs.LocalFileSystem)

    @cached_property
    def info(self) -> Any:
        """Size and time of the last change, as a `pyarrow.fs.FileInfo`."""
        with named_errors(self.shown):
            return self.filesystem.get_file_info(self.path)

    @cached_property
    def magic(self) -> bytes:
        """The first bytes, by which formats know their own."""
        return self.begin(16)

    def begin(self, size: int = PROBED) -> bytes:
        """Return the first `size` bytes, or all there are."""
        with named_errors(self.shown), self.open() as opened:
            return opened.read(min(self.info.size, size))

    def open(self) -> Any:
        """Open for reading at any place. A local file is not mapped, since it may be cut while it is read."""
        return self.filesystem.open_input_file(self.path)

    def read(self) -> bytes:
        """Return the whole content."""
        with named_errors(self.shown), self.open() as opened:
            return opened.read()

    def identity(self) -> tuple[str, int, str, str]:
        """Path, size, time of the last change, and a digest of both ends of the file."""
        size = self.info.size
        digest = hashlib.blake2b(self.begin(), digest_size=16)
        if size > PROBED:
            with named_errors(self.shown), self.open() as opened:
                opened.seek(max(size - PROBED, PROBED))
                digest.update(opened.read())
        path = os.path.realpath(self.path) if self.local else self.path
        return path, size, str(self.info.mtime_ns), digest.hexdigest()


@dataclass(frozen=True)
class Folder:
    """A folder of Parquet files, in which a format may find more than them."""

    shown: str
    path: str
    filesystem: Any

    def file(self, name: str) -> File:
        """Return the file of this name in the folder, which need not exist."""
        return File(f"{self.shown.rstrip('/')}/{name}", f"{self.path.rstrip('/')}/{name}", self.filesystem)

    def parquet_files(self, within: str = "") -> tuple[File, ...]:
        """List the Parquet files in the folder and the folders in it, in the order of their names."""
        return self.files(PARQUET, within)

    def files(self, suffixes: str | tuple[str, ...], within: str = "") -> tuple[File, ...]:
        """List the files with one of these suffixes in the folder and the folders in it, in the order of their names.

        Names that begin with a dot or an underscore are others' records. A file that is there twice, through a link, is
        listed once, and a folder that links to one above it is not entered again.
        """
        root = f"{self.path.rstrip('/')}/{within}" if within else self.path
        paths = _walk(root) if isinstance(self.filesystem, pyarrow.fs.LocalFileSystem) else self._list(root)
        files = sorted((path for path in paths if path.lower().endswith(suffixes)), key=natural)
        return tuple(File(self._shown(path), path, self.filesystem) for path in files)

    def _list(self, root: str) -> list[str]:
        selector = pyarrow.fs.FileSelector(root, recursive=True, allow_not_found=True)
        with named_errors(self.shown):
            infos = self.filesystem.get_file_info(selector)
        depth = len(PurePosixPath(root).parts)
        return [
            info.path
            for info in infos
            if info.type == pyarrow.fs.FileType.File and not _hidden(PurePosixPath(info.path).parts[depth:])
        ]

    def _shown(self, path: str) -> str:
        return (
            path
            if "://" not in self.shown
            else self.shown.rstrip("/") + path.removeprefix(self.path.rstrip("/"))
        )


@contextmanager
def named_errors(shown: str) -> Iterator[None]:
    """Turn what the system says of a file or folder into one sentence that names it."""
    try:
        yield
    except DataError:
        raise
    except (OSError, pa.ArrowException) as error:
        reason = getattr(error, "strerror", None) or (str(error).splitlines() or [type(error).__name__])[0]
        raise DataError(f"{shown} cannot be read: {reason}") from error


def locate(paths: Paths) -> list[File | Folder]:
    """Find the files and folders meant.

    Parameters
    ----------
    paths : path, pattern, URI, or several of them
        A pattern such as ``runs/*.csv`` stands for the files it matches. A URI is one that
        `pyarrow.fs.FileSystem.from_uri` opens, such as ``s3://bucket/folder``.

    Returns
    -------
    list of File and Folder

    Raises
    ------
    DataError
        There is no such file, it is given twice, or it is no file but a pipe or a device.
    """
    given = [paths] if isinstance(paths, str | os.PathLike) else list(paths)
    if not given:
        raise DataError("no files were given to load")
    found: list[File | Folder] = []
    chosen: dict[Any, str] = {}  # what was given by name, by its identity on this machine
    for each in given:
        if not isinstance(each, str | os.PathLike):
            raise DataError(f"paths must be a path or several of them, got {each!r} among them")
        text = os.fspath(each)
        if isinstance(each, str) and "://" in text:
            found.append(_remote(text))
            continue
        name = os.path.expanduser(text)
        pattern = isinstance(each, str) and glob.has_magic(name) and not os.path.lexists(name)
        names = sorted(_matching(name), key=natural) if pattern else [name]
        if not names:
            raise DataError(f"no file matches {each}; check the pattern and the folder it starts from")
        for one in names:
            place = _local(one)
            identity = _inode(one)
            if identity in chosen:
                if pattern:  # through a link
                    continue
                raise DataError(f"{Path(one).name} is given twice, which would count its samples twice")
            chosen[identity] = one
            found.append(place)
    _check_apart(found)
    return found


def _matching(pattern: str) -> list[str]:
    if "**" not in pattern:
        return glob.glob(pattern)
    # Unlike glob, pathlib does not follow links to folders here, which may lead round in circles.
    start = Path(pattern).anchor
    return [str(path) for path in Path(start).glob(pattern.removeprefix(start))]


def _local(shown: str) -> File | Folder:
    filesystem = pyarrow.fs.LocalFileSystem()
    try:
        mode = os.stat(shown).st_mode
    except FileNotFoundError:
        raise DataError(
            f"there is no file or folder {shown}; check the path, which starts from the current folder"
        ) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise DataError(f"{shown} cannot be opened: {reason}") from error
    if stat.S_ISDIR(mode):
        return Folder(shown, shown, filesystem)
    if not stat.S_ISREG(mode):
        raise DataError(f"{shown} is a pipe or a device and not a file: write its content to a file first")
    return File(shown, shown, filesystem)


def _remote(uri: str) -> File | Folder:
    def ask() -> tuple[Any, str, Any]:
        filesystem, path = pyarrow.fs.FileSystem.from_uri(uri)
        return filesystem, path, filesystem.get_file_info(path)

    try:
        filesystem, path, info = _wait_for(uri, ask)
    except (OSError, pa.ArrowException) as error:
        raise DataError(f"{uri} cannot be opened ({(str(error).splitlines() or ['?'])[0]})") from error
    if info.type == pyarrow.fs.FileType.NotFound:
        raise DataError(f"there is no file or folder {uri}; check the path")
    if info.type == pyarrow.fs.FileType.Directory:
        return Folder(uri, path, filesystem)
    if info.type != pyarrow.fs.FileType.File:
        raise DataError(f"{uri} is a pipe or a device and not a file: write its content to a file first")
    return File(uri, path, filesystem)


def _wait_for(uri: str, ask: Callable[[], Answer]) -> Answer:
    """Ask an object store something, which may try for ever to reach it."""
    answers: SimpleQueue[Future[Answer]] = SimpleQueue()

    def work() -> None:
        answer: Future[Answer] = Future()
        try:
            answer.set_result(ask())
        except Exception as error:
            answer.set_exception(error)
        answers.put(answer)

    # Not a pool: at the end of the program one would wait for its threads.
    Thread(target=work, daemon=True).start()
    try:
        return answers.get(timeout=ANSWER_SECONDS).result()
    except Empty:
        raise DataError(
            f"{uri} did not answer within {ANSWER_SECONDS:g} s: check the address, and whether this machine "
            "can reach it"
        ) from None


def _check_apart(found: list[File | Folder]) -> None:
    """Refuse a file that also lies in a folder that is given, and a URI that is given twice."""
    twice = [name for name, number in Counter(place.shown for place in found).items() if number > 1]
    folders = [os.path.realpath(place.path) for place in found if isinstance(place, Folder)]
    for place in found:
        real = os.path.realpath(place.path)
        if any(real != folder and real.startswith(folder.rstrip(os.sep) + os.sep) for folder in folders):
            twice.append(place.shown)
    if twice:
        raise DataError(f"{Path(twice[0]).name} is given twice, which would count its samples twice")


def _walk(root: str) -> list[str]:
    """List the regular files of a local folder, entering links to folders once."""
    found: list[str] = []
    seen: set[tuple[int, int]] = {_inode(root)}
    for folder, names, files in os.walk(root, followlinks=True):
        inner = []
        for name in sorted(names):
            path = os.path.join(folder, name)
            if _hidden([name]):
                continue
            try:
                identity = _inode(path)
            except OSError:  # a link to nowhere
                continue
            if identity not in seen:
                seen.add(identity)
                inner.append(name)
        names[:] = inner
        for name in sorted(files):
            path = os.path.join(folder, name)
            if _hidden([name]) or not os.path.isfile(path) or (identity := _inode(path)) in seen:
                continue
            seen.add(identity)
            found.append(path)
    return found


def _inode(path: str) -> tuple[int, int]:
    about = os.stat(path)
    return about.st_dev, about.st_ino


def _hidden(parts: Iterable[str]) -> bool:
    # Spark, Dask and the like keep their own records in names that begin with _ or a dot.
    return any(part[0] in "_." for part in parts)


def natural(path: str) -> list[tuple[int, str]]:
    """Sort key by which `part-10` comes after `part-9`."""
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", path)]


def label(shown: list[str]) -> list[str]:
    """Label files by their names without suffix, or by their paths where that would not tell two apart."""
    stems = Counter(Path(name).stem for name in shown)
    return [Path(name).stem if stems[Path(name).stem] == 1 else str(Path(name)) for name in shown]


def short_names(shown: list[str]) -> list[str]:
    """Name files as notes do: by the last part of the path, or by the path where that would not tell two apart."""
    names = Counter(Path(name).name for name in shown)
    return [Path(name).name if names[Path(name).name] == 1 else str(Path(name)) for name in shown]
