"""How files are to be read as a stream, as the user says it: which columns are what."""

from dataclasses import dataclass

from unconstrain.errors import DataError
from unconstrain.recordings.roles import Keys
from unconstrain.recordings.table import Key

COLUMNS = ("state", "action", "episode", "time", "projections", "force", "free")


@dataclass(frozen=True)
class Reading:
    """The arguments of `fit_stream` and of `distributed.fit` that are about files; see there.

    Raises `DataError` for what cannot go together.
    """

    state: Keys | None = None
    action: Keys | None = None
    episode: Key | None = None
    time: Key | None = None
    projections: Keys | None = None
    force: Keys | None = None
    force_threshold: float | None = None
    free: Key | None = None
    time_unit: str | None = None
    window: float = 0.2
    gap: float | None = None
    max_speed: float | None = None
    min_duration: float | None = None

    def __post_init__(self) -> None:
        if self.projections is not None and not (self.force is self.free is None):
            other = "force" if self.force is not None else "free"
            raise DataError(
                f"projections= and {other}= both say what the constraints are: leave out one of them"
            )
        if self.force is not None and self.force_threshold is None:
            raise DataError(
                "give force_threshold, above which a force is a contact, in the unit of the forces"
            )
        if self.force is None and self.force_threshold is not None:
            raise DataError("force_threshold is for forces: name their columns with force=")

    @property
    def columns(self) -> list[str]:
        """For which roles columns are given."""
        return [role for role in COLUMNS if getattr(self, role) is not None]
