"""Which recordings a command reads, and how: options that all commands share."""

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, TypeVar

import click

from unconstrain.cli import reporting
from unconstrain.cli.command import in_words_of_program
from unconstrain.cli.declared import declared_options, gathered, is_given, option
from unconstrain.errors import DataError
from unconstrain.recordings.columns import Columns
from unconstrain.recordings.preparation import Preparation

if TYPE_CHECKING:
    from unconstrain.demonstrations import Demonstrations
    from unconstrain.recordings import Recordings

Carrier = TypeVar("Carrier", Columns, Preparation)

FOLDS = ("episodes", "blocks")


@dataclass(frozen=True)
class Recorded:
    """The files of a command, and how to read them.

    Parameters
    ----------
    files : tuple of str
        Files, folders, patterns or URIs.
    columns : Columns
    preparation : Preparation
    given : frozenset of str
        The fields of `columns` and `preparation` that were given on the command line.
    """

    files: tuple[str, ...]
    columns: Columns
    preparation: Preparation
    given: frozenset[str]

    @property
    def tells_constraints(self) -> bool:
        """Whether any column tells of constraints."""
        columns = self.columns
        return any(told is not None for told in (columns.force, columns.free, columns.projections))

    def open(self) -> "Recordings":
        """Open all of it; projections are those that the columns tell of, not those that only simulation knows."""
        from unconstrain.recordings import open as open_recordings

        opened = open_recordings(self.files, columns=self.columns, preparation=self.preparation)
        return opened if self.tells_constraints else opened.without_projections()

    def load(self) -> "Demonstrations":
        """Read all of it into memory."""
        return self.open().load()

    def kept(self) -> tuple[Columns, Preparation]:
        """Return how to read other recordings like these, to be saved with a policy."""
        return (
            replace(self.columns, force=None, free=None, projections=None),
            replace(self.preparation, force_threshold=None),
        )

    def like(self, kept: tuple[Columns, Preparation] | None) -> "Recorded":
        """Return the same files, read as others were, except where the command line says otherwise.

        If the command line names the states, it speaks of another layout, and no column is taken over.
        """
        columns, preparation = kept or (Columns(), Preparation())
        return replace(
            self,
            columns=self.columns if "state" in self.given else self._filled(self.columns, columns),
            preparation=self._filled(self.preparation, preparation),
        )

    def _filled(self, own: Carrier, other: Carrier) -> Carrier:
        """Return options with those of another where the command line does not give them."""
        taken = {name: getattr(other, name) for name in _names(type(own)) - self.given}
        return replace(own, **taken)


def _recorded(files: tuple[str, ...], **values: Any) -> Recorded:
    names = _names(Columns)
    columns = Columns(**{name: value for name, value in values.items() if name in names})
    preparation = Preparation(**{name: value for name, value in values.items() if name not in names})
    if columns.force is not None and preparation.force_threshold is None:
        raise DataError(
            "force= needs force_threshold=, above which a force is a contact, in the forces' unit"
        )
    if columns.force is None and preparation.force_threshold is not None:
        raise DataError("force_threshold= is for forces: name their columns with force=")
    return Recorded(files, columns, preparation, frozenset(name for name in values if is_given(name)))


def _names(declaration: type) -> frozenset[str]:
    return frozenset(field.name for field in fields(declaration))


recorded = gathered(
    "recorded",
    [
        click.argument("files", nargs=-1, required=True, metavar="FILES..."),
        *declared_options(Columns, Preparation, section="Recordings"),
    ],
    _recorded,
)
"""Decorator of a command that reads recordings, and is called with `recorded=Recorded(...)`."""

folds = option(
    "--folds",
    type=click.Choice(FOLDS),
    help="What is held out: whole episodes, or blocks of each. By default episodes, if there are several.",
    section="Model",
)


def describe(demos: "Demonstrations") -> None:
    """Say what was read: samples, episodes, and what was done to them."""
    reporting.say(
        f"read: {len(demos)} samples, {demos.n_episodes} episode{'s' if demos.n_episodes != 1 else ''}, "
        f"states {', '.join(demos.state_names)}, actions {', '.join(demos.action_names)}"
    )
    describe_notes(demos.notes)


def describe_notes(notes: Iterable[object]) -> None:
    """Say what was found while reading."""
    for note in notes:
        reporting.say(f"note: {in_words_of_program(str(note))}")
