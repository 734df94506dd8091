"""Which recordings a command reads, and how: options that all commands share."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, TypeVar

import click

from unconstrain.cli import reporting
from unconstrain.cli.command import in_words_of_program
from unconstrain.cli.declared import declared_options, gathered, is_given, option
from unconstrain.errors import DataError
from unconstrain.recordings.columns import Columns
from unconstrain.recordings.notes import count
from unconstrain.recordings.preparation import Preparation
from unconstrain.recordings.reading import BEGINS

if TYPE_CHECKING:
    from unconstrain.demonstrations import Demonstrations
    from unconstrain.policies.base import Policy
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

    @property
    def options_used(self) -> frozenset[str]:
        """The options that make other states of those in the files."""
        columns, how = self.columns, self.preparation
        used = {
            "relative_to": columns.relative_to is not None,
            "moving_centre": how.moving_centre is not None,
            "order": how.order == 2,
            "phase": how.phase,
        }
        return frozenset(name for name, is_used in used.items() if is_used)

    def open(self) -> "Recordings":
        """Open all of it; projections are those that the columns tell of, not those that only simulation knows."""
        from unconstrain.recordings import open as open_recordings

        opened = open_recordings(self.files, columns=self.columns, preparation=self.preparation)
        return opened if self.tells_constraints else opened.without_projections()

    def load(self) -> "Demonstrations":
        """Read all of it into memory."""
        return self.open().load()

    def kept(self, opened: "Recordings") -> tuple[Columns, Preparation]:
        """Return how to read other recordings like these, to be saved with a policy."""
        return (
            replace(self.columns, force=None, free=None, projections=None),
            replace(opened.guessed, force_threshold=None),
        )

    def like(self, kept: tuple[Columns, Preparation] | None) -> "Recorded":
        """Return the same files, read as others were, except where the command line says otherwise.

        If the command line names the states, it speaks of another layout, and no column is taken over.
        """
        columns, preparation = kept or (Columns(), Preparation())
        # Each of these says how time is known, and takes the place of the others.
        how_timed = {"rate", "time_unit"}
        given = self.given | (how_timed if self.given & (how_timed | {"time"}) else set())
        given |= {"action_is"} if self.given & {"state", "action"} else set()
        return replace(
            self,
            columns=self.columns if "state" in self.given else _filled(self.columns, columns, given),
            preparation=_filled(self.preparation, preparation, given),
        )

    def check_names(self, learnt: "Policy", demos: "Demonstrations") -> None:
        """Refuse recordings whose states are others than those that a policy was learnt from, or in another order.

        Raises
        ------
        DataError
            Names differ that both have. If the command line names the states, only their order may not.
        """
        from unconstrain.recordings.roles import is_named

        known, found = tuple(getattr(learnt, "state_names_", ())), demos.state_names
        if len(known) != len(found) or known == found or not (is_named(known) and is_named(found)):
            return
        if "state" in self.given and sorted(known) != sorted(found):
            return
        raise DataError(
            f"the policy was learnt from the states {', '.join(known)}, and these recordings have "
            f"{', '.join(found)} in their place: name the columns in that order with state="
        )


def _filled(own: Carrier, other: Carrier, given: frozenset[str]) -> Carrier:
    """Return options with those of another where the command line does not give them."""
    return replace(own, **{name: getattr(other, name) for name in _names(type(own)) - given})


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
    """Say what was read: samples, episodes, their rate and duration, and what was done to them."""
    of_demos = f"{BEGINS}{count(len(demos), 'sample')}"
    if not any(
        note.startswith(f"{of_demos},") for note in demos.notes
    ):  # they were saved by Python, for example
        reporting.say(f"{of_demos}, {count(demos.n_episodes, 'episode')}")
    describe_notes(demos.notes, demos.state_names, demos.action_names)


def describe_notes(notes: Iterable[object], states: Sequence[str], actions: Sequence[str]) -> None:
    """Say what was read, and what was found then."""
    sentences = [in_words_of_program(str(note)) for note in notes]
    for sentence in sentences:
        if sentence.startswith(BEGINS):
            reporting.say(sentence)
    reporting.say(f"states {', '.join(states)}, actions {', '.join(actions)}")
    for sentence in sentences:
        if not sentence.startswith(BEGINS):
            reporting.say(f"note: {sentence}")
