"""Demonstrations: what a person did, sample by sample, and from which recording each sample comes."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain import demonstrations_file, demonstrations_words
from unconstrain.arrays import check_number, check_numbers, check_whole, quote
from unconstrain.errors import DataError, UnconstrainError, printable
from unconstrain.spaces import Numbers, Phased, Space

MOST_BLOCKS = 2**31
"""In an episode: labels of blocks are whole numbers of 64 bits."""

if TYPE_CHECKING:
    import pandas

Array = NDArray[np.float64]
Codes = NDArray[np.int64]


@dataclass(frozen=True, init=False, eq=False, repr=False)
class Demonstrations:
    """States and the actions taken in them, grouped into episodes.

    Parameters
    ----------
    states : array_like of shape (N, n)
        Where the system was.
    actions : array_like of shape (N, d)
        What was done, u = N(x) π(x): the constrained action, as recorded or differentiated.
    episodes : array_like of shape (N,), optional
        One value per sample. With `episode_labels`: integer codes into it. Without: any integers or
        strings, which are sorted, numbered and kept as labels. Default: a single episode.
    time : array_like of shape (N,), optional
        Seconds. `load` counts them from the first stamp of each episode as it was recorded; a fragment
        of an episode that was split keeps its place in it.
    policy : array_like of shape (N, d), optional
        The true unconstrained action π(x), known only in simulation.
    projections : array_like of shape (N, d, d), optional
        What is known of the nullspace projections N(x); in simulation, the true ones. All NaN where not known.
    state_names, action_names : sequence of str, optional
        Default x1, x2, ... and u1, u2, ...
    episode_labels : sequence of str, optional
        One per episode, each used.
    notes : sequence of str, optional
        What a user of the data should know of its reading, a sentence each.
    forces : array_like of shape (N, m), optional
        Measured contact forces; see `constraints.from_recording`.
    free : array_like of shape (N,), optional
        1 where the demonstrator says that nothing constrained the motion, else 0.
    space : Space, optional
        What states are: see `unconstrain.spaces`. By default numbers.
    noise : float, optional
        Standard deviation of the actions' noise, in their unit, where it is known. `load` finds it where states are
        differentiated.

    Attributes
    ----------
    states, actions, time, policy, projections, forces, free : ndarray
        As above, float64.
    episodes : ndarray of shape (N,), int64
        Codes 0 .. n_episodes - 1, fit to be passed as `groups=`.
    state_names, action_names, episode_labels, notes : tuple of str
        As above.
    noise : float or None
        As above.

    Raises
    ------
    DataError
        No samples, lengths or dimensions that disagree, labels that do not match, infinity, or NaN other than of
        projections not known.
    """

    states: Array
    actions: Array
    episodes: Codes
    time: Array | None
    policy: Array | None
    projections: Array | None
    forces: Array | None
    free: Array | None
    space: Space
    state_names: tuple[str, ...]
    action_names: tuple[str, ...]
    episode_labels: tuple[str, ...]
    notes: tuple[str, ...]
    noise: float | None

    def __init__(
        self,
        states: ArrayLike,
        actions: ArrayLike,
        episodes: ArrayLike | None = None,
        time: ArrayLike | None = None,
        policy: ArrayLike | None = None,
        projections: ArrayLike | None = None,
        state_names: Sequence[str] | None = None,
        action_names: Sequence[str] | None = None,
        episode_labels: Sequence[str] | None = None,
        notes: Sequence[str] = (),
        forces: ArrayLike | None = None,
        free: ArrayLike | None = None,
        space: Space | None = None,
        noise: float | None = None,
    ) -> None:
        X = _samples("states", states)
        U = _samples("actions", actions)
        N, n, d = len(X), X.shape[1], U.shape[1]
        codes, labels = _episodes(episodes, episode_labels, N)
        values: dict[str, Any] = {
            "states": X,
            "actions": _shaped("actions", U, (N, d)),
            "episodes": codes,
            "time": None if time is None else _shaped("time", _numbers("time", time), (N,)),
            "policy": None if policy is None else _shaped("policy", _numbers("policy", policy), (N, d)),
            "projections": None if projections is None else _projections(projections, N, d),
            "forces": None if forces is None else _forces(forces, N),
            "free": None if free is None else _flags(free, N),
            "space": _space(space, X),
            "state_names": _names("state_names", state_names, "x", n),
            "action_names": _names("action_names", action_names, "u", d),
            "episode_labels": labels,
            "notes": tuple(_listed("notes", notes)),
            "noise": None if noise is None else _noise(noise),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        """Return the number of samples N."""
        return len(self.states)

    @property
    def n_episodes(self) -> int:
        """How many episodes there are."""
        return len(self.episode_labels)

    def select(self, samples: ArrayLike | slice) -> "Demonstrations":
        """Return some of the samples.

        Everything is kept consistent: episodes left without samples disappear and the rest are renumbered.

        Parameters
        ----------
        samples : array_like of shape (N,), bool or int, or slice
            Which ones.

        Returns
        -------
        Demonstrations
            Those samples, in the order asked for.

        Raises
        ------
        DataError
            The mask or an index does not fit, or nothing is selected.
        """
        index = _index(samples, len(self))
        used, codes = np.unique(self.episodes[index], return_inverse=True)
        return replace(
            self,
            states=self.states[index],
            actions=self.actions[index],
            episodes=codes,
            time=None if self.time is None else self.time[index],
            policy=None if self.policy is None else self.policy[index],
            projections=None if self.projections is None else self.projections[index],
            forces=None if self.forces is None else self.forces[index],
            free=None if self.free is None else self.free[index],
            episode_labels=tuple(self.episode_labels[code] for code in used),
        )

    def episode(self, which: int | str) -> "Demonstrations":
        """Return one episode, by its code or its label.

        Parameters
        ----------
        which : int or str
            The code or the label.

        Returns
        -------
        Demonstrations
            The samples of that episode.

        Raises
        ------
        DataError
            There is no such episode, or several carry that label.
        """
        if isinstance(which, str):
            codes = [code for code, label in enumerate(self.episode_labels) if label == which]
            if len(codes) != 1:
                raise DataError(
                    f"{len(codes) or 'no'} episodes are labelled {quote(which)}; "
                    f"choose one by its number, 0 to {self.n_episodes - 1}"
                )
            which = codes[0]
        if not isinstance(which, int | np.integer) or not 0 <= which < self.n_episodes:
            raise DataError(
                f"there is no episode {quote(which)}; they are numbered 0 to {self.n_episodes - 1}"
            )
        return self.select(self.episodes == which)

    def blocks(self, k: int) -> Codes:
        """Cut every episode into `k` contiguous blocks.

        Neighbouring samples of a recording resemble each other, so folds of single samples flatter a
        policy. With many episodes, pass `episodes` as `groups=`. With one or a few long recordings, pass
        these labels instead, and cross-validation runs over blocks within each recording.

        An episode of m samples gives block ⌊k i / m⌋ to its i-th; with m < k some labels stay unused.

        Parameters
        ----------
        k : int
            How many blocks.

        Returns
        -------
        ndarray of shape (N,)
            Labels, ``k * episode + block``.

        Raises
        ------
        PolicyError
            `k` is not a positive integer, or one above 2³¹.
        """
        k = check_whole(k, "k", least=1, most=MOST_BLOCKS)
        order = np.argsort(self.episodes, kind="stable")
        sizes = np.bincount(self.episodes, minlength=self.n_episodes)
        starts = np.cumsum(sizes) - sizes
        place = np.empty(len(self), dtype=np.int64)  # i, counted within the sample's episode
        place[order] = np.arange(len(self)) - np.repeat(starts, sizes)
        return self.episodes * k + k * place // sizes[self.episodes]

    def folds(self, kind: str | None = None, n_blocks: int = 5) -> Codes:
        """Say what is held out together in cross-validation.

        Parameters
        ----------
        kind : {"episodes", "blocks"}, optional
            Whole episodes, or contiguous blocks of each. By default episodes, if there are several.
        n_blocks : int
            Blocks in each episode.

        Returns
        -------
        ndarray of shape (N,)
            Labels, to be passed as `groups=`.

        Raises
        ------
        DataError
            `kind` is unknown, or there is a single episode where episodes are to be held out.
        """
        kind = kind if kind is not None else ("episodes" if self.n_episodes > 1 else "blocks")
        if not isinstance(kind, str) or kind not in ("episodes", "blocks"):
            raise DataError(f"folds must be episodes or blocks, got {quote(kind)}")
        if kind == "blocks":
            return self.blocks(n_blocks)
        if self.n_episodes < 2:
            raise DataError(
                "there is one episode, and none is left when it is held out: use blocks instead of episodes for folds="
            )
        return self.episodes

    def moving(self, min_speed: float) -> "Demonstrations":
        """Leave out samples whose action is short, with a note of how many went.

        The policy is read off the direction of the action, û = u / ‖u‖, which is noise when the hand rests.

        Parameters
        ----------
        min_speed : float
            The least ‖u‖ that stays, in the units of the actions.

        Returns
        -------
        Demonstrations
            The other samples.

        Raises
        ------
        PolicyError, DataError
            `min_speed` is not a number ≥ 0, or no sample is that fast.
        """
        min_speed = check_number(min_speed, "min_speed", positive=False)
        speeds = np.linalg.norm(self.actions, axis=1)
        keep = speeds >= min_speed
        slow = int(np.sum(~keep))
        if slow == len(self):
            raise DataError(
                f"no sample is as fast as min_speed={min_speed:g}; "
                f"the fastest action has speed {speeds.max():.4g}, so choose less"
            )
        if not slow:
            return self
        note = f"left out {slow} of {len(self)} samples slower than {min_speed:g}"
        selected = self.select(keep)
        return replace(selected, notes=(*self.notes, note))

    @classmethod
    def concatenate(cls, several: Sequence["Demonstrations"]) -> "Demonstrations":
        """Join several, one after the other.

        The episodes stay distinct, and a label already taken gets a number. Time, true policy, projections, forces
        and free flags are kept where every one of them has them, otherwise left out with a note.

        Parameters
        ----------
        several : sequence of Demonstrations
            At least one.

        Returns
        -------
        Demonstrations
            With the names of the first. Where states have a phase, its duration is the mean over all episodes.

        Raises
        ------
        DataError
            Nothing is given, or their states, actions or forces differ in dimension, or states are of different kinds.
        """
        if not several:
            raise DataError("there are no demonstrations to concatenate")
        first = several[0]
        if len(several) == 1:
            return first
        for i, other in enumerate(several):
            for what in ("states", "actions", "forces"):
                if getattr(other, what) is None or getattr(first, what) is None:
                    continue
                have, want = getattr(other, what).shape[1], getattr(first, what).shape[1]
                if have != want:
                    raise DataError(
                        f"the {what} of demonstrations 0 and {i} have {want} and {have} dimensions"
                    )
        notes = [note for each in several for note in each.notes]

        def joined(what: str) -> Array | None:
            parts = [getattr(each, what) for each in several]
            if all(part is not None for part in parts):
                return np.concatenate(parts)
            missing = sum(part is None for part in parts)
            if missing < len(parts):
                notes.append(f"left out {what}, which {missing} of {len(parts)} demonstrations do not have")
            return None

        known = [(each.noise, len(each)) for each in several if each.noise is not None]
        if 0 < len(known) < len(several):
            notes.append(
                f"left out noise, which {len(several) - len(known)} of {len(several)} demonstrations do not have"
            )
        squares, counts = np.array(known).reshape(-1, 2).T ** [[2], [1]]

        labels: dict[str, None] = {}  # an ordered set
        for label in (label for each in several for label in each.episode_labels):
            distinct, number = label, 1
            while distinct in labels:
                number += 1
                distinct = f"{label} ({number})"
            labels[distinct] = None
        offsets = np.cumsum([0] + [each.n_episodes for each in several[:-1]])
        return cls(
            states=np.concatenate([each.states for each in several]),
            actions=np.concatenate([each.actions for each in several]),
            episodes=np.concatenate([each.episodes + o for each, o in zip(several, offsets, strict=True)]),
            time=joined("time"),
            policy=joined("policy"),
            projections=joined("projections"),
            forces=joined("forces"),
            free=joined("free"),
            space=_common_space(several),
            state_names=first.state_names,
            action_names=first.action_names,
            episode_labels=tuple(labels),
            notes=tuple(dict.fromkeys(notes)),
            noise=float(np.sqrt(np.average(squares, weights=counts))) if len(known) == len(several) else None,
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to an NPZ or Parquet file, by suffix; ``unconstrain.load(path)`` gives the same back.

        NPZ holds the arrays under the names of the attributes. Parquet holds one column per state, action and
        true-policy dimension, forces and free flags likewise, the projections as lists of d², row by row, and in its
        schema metadata, as JSON, which columns play which role.

        Parameters
        ----------
        path : path
            Ends in ``.npz``, ``.parquet`` or ``.pq``.

        Raises
        ------
        UnconstrainError
            Another suffix, or a place that cannot be written to.
        """
        demonstrations_file.write(self, path)

    def to_pandas(self) -> "pandas.DataFrame":
        """Return a data frame with a row for each sample.

        Returns
        -------
        pandas.DataFrame
            The columns are those of a Parquet file that `save` writes: ``episode``, here by its label, ``time``, the
            states, the actions, and what else there is; a projection is an array (d, d).

        Raises
        ------
        UnconstrainError
            pandas is not installed.
        """
        try:
            import pandas
        except ImportError as error:
            raise UnconstrainError(
                "to_pandas needs pandas, which is not installed: pip install pandas"
            ) from error
        columns, roles = demonstrations_file.columns_of(self)
        labels = np.array(self.episode_labels, dtype=object)[self.episodes]
        plain = {name: list(values) if values.ndim > 1 else values for name, values in columns.items()}
        return pandas.DataFrame(plain | {roles["episodes"]: labels})

    def _repr_html_(self) -> str:
        return demonstrations_words.to_html(self)

    def __repr__(self) -> str:
        optional = ("time", "policy", "projections", "forces", "free")
        extras = [what for what in optional if getattr(self, what) is not None]
        parts = [
            f"{_count(len(self), 'sample')} in {_count(self.n_episodes, 'episode')}",
            f"states {_shortened(self.state_names)}",
            f"actions {_shortened(self.action_names)}",
            *([f"with {', '.join(extras)}"] if extras else []),
            *([_count(len(self.notes), "note")] if self.notes else []),
        ]
        return printable(f"Demonstrations({'; '.join(parts)})")


def _noise(value: float) -> float:
    (number,) = _numbers("noise", value).flat if np.ndim(value) == 0 else (-1.0,)
    if number < 0:
        raise DataError(f"noise must be a number of at least zero, got {quote(value)}")
    return float(number)


def _numbers(what: str, values: ArrayLike) -> Array:
    array = _array(what, values)
    _check_finite(what, array, np.isfinite(array))
    return array


def _projections(values: ArrayLike, count: int, d: int) -> Array:
    array = _shaped("projections", _array("projections", values), (count, d, d))
    unknown = np.isnan(array).all(axis=(1, 2), keepdims=True)
    _check_finite("projections", array, np.isfinite(array) | unknown)
    return array


def _array(what: str, values: ArrayLike) -> Array:
    return np.ascontiguousarray(check_numbers(values, what))


def _check_finite(what: str, array: Array, good: NDArray[np.bool_]) -> None:
    if not good.all():
        bad = np.argwhere(~good)
        row, *rest = bad[0].tolist()
        column = f", column {rest[0]}" if rest else ""
        raise DataError(
            f"{what} hold {array[tuple(bad[0])]} at row {row}{column} (counted from 0); "
            "leave such samples out or fill them in"
        )


def _samples(what: str, values: ArrayLike) -> Array:
    array = _numbers(what, values)
    if np.ndim(values) != 2:
        raise DataError(
            f"{what} must have shape (samples, dimensions), got {np.shape(values)}; "
            "reshape(-1, 1) makes one dimension of a flat array"
        )
    if 0 in array.shape:
        raise DataError(f"{what} are empty: their shape is {array.shape}")
    return array


def _shaped(what: str, array: Array, shape: tuple[int, ...]) -> Array:
    if array.shape != shape:
        raise DataError(
            f"{what} have shape {array.shape} where {shape} is needed: one row for each of {shape[0]} states"
            + (f" and {shape[1]} actions" if len(shape) > 1 else "")
        )
    return array


def _forces(values: ArrayLike, count: int) -> Array:
    array = _samples("forces", values)
    if len(array) != count:
        raise DataError(f"there are {len(array)} forces and {count} states: give one force for each state")
    return array


def _flags(values: ArrayLike, count: int) -> Array:
    flags = _shaped("free", _numbers("free", values), (count,))
    odd = np.flatnonzero((flags != 0) & (flags != 1))
    if len(odd):
        raise DataError(
            f"free must be 1 (nothing constrains the motion) or 0, got {flags[odd[0]]:g} in row {odd[0]}"
        )
    return flags


def _names(what: str, names: Sequence[str] | None, letter: str, count: int) -> tuple[str, ...]:
    if names is None:
        return tuple(f"{letter}{i + 1}" for i in range(count))
    if isinstance(names, str) or len(_listed(what, names)) != count:
        raise DataError(f"{what} must be {count} names, one per dimension, got {quote(names)}")
    return tuple(str(name) for name in names)


def _listed(what: str, texts: Sequence[str]) -> Sequence[str]:
    """Refuse a text, or what is no sequence, in place of several texts."""
    if isinstance(texts, str | bytes) or not (hasattr(texts, "__len__") and hasattr(texts, "__getitem__")):
        raise DataError(f"{what} must be a list of texts, got {quote(texts)}")
    try:
        return [str(text) for text in texts]
    except TypeError:  # an array without dimensions
        raise DataError(f"{what} must be a list of texts, got {quote(texts)}") from None


def _space(space: Space | None, X: Array) -> Space:
    if space is None:
        return Numbers(X.shape[1])
    if not isinstance(space, Space) or space.n_states != X.shape[1]:
        words = space.words if isinstance(space, Space) else repr(space)
        raise DataError(f"states have {X.shape[1]} numbers, which do not stand for {words:.80}")
    faults = space.faults(X)
    if faults.any():
        raise DataError(f"the states of sample {int(np.argmax(faults))} are none of these: {space.words}")
    return space


def _common_space(several: Sequence[Demonstrations]) -> Space:
    """Return what all states are."""
    first = several[0].space
    kinds = [each.space.of if isinstance(each.space, Phased) else each.space for each in several]
    for i, each in enumerate(several):
        if kinds[i] != kinds[0] or isinstance(each.space, Phased) != isinstance(first, Phased):
            raise DataError(
                f"the states of demonstrations 0 and {i} are of different kinds: {first.words}; and {each.space.words}"
            )
    durations = [each.space.duration for each in several if isinstance(each.space, Phased)]
    if len(set(durations)) < 2:
        return first
    return Phased(kinds[0], float(np.average(durations, weights=[each.n_episodes for each in several])))


def _episodes(
    episodes: ArrayLike | None, labels: Sequence[str] | None, count: int
) -> tuple[Codes, tuple[str, ...]]:
    try:
        values = np.zeros(count, dtype=np.int64) if episodes is None else np.asarray(episodes)
    except ValueError:  # rows of different lengths
        raise DataError("episodes must be integers or strings, one per state") from None
    if values.shape != (count,):
        raise DataError(f"episodes have shape {values.shape} where ({count},) is needed: one per state")
    if values.dtype.kind not in "iuU":
        raise DataError(f"episodes must be integers or strings, got {values.dtype}")
    if labels is None:
        distinct, codes = np.unique(values, return_inverse=True)
        return codes.astype(np.int64), tuple(str(value) for value in distinct)
    labels = _listed("episode_labels", labels)
    if values.dtype.kind == "U" or not _number(values, len(labels)):
        raise DataError(
            f"episodes must be the numbers 0 to {len(labels) - 1}, each used, "
            f"to go with {len(labels)} episode_labels"
        )
    return values.astype(np.int64), tuple(str(label) for label in labels)


def _number(values: NDArray[Any], count: int) -> bool:
    """Whether values (N,) are the numbers from 0 to `count` - 1, each used."""
    if values.min(initial=0) < 0 or values.max(initial=0) >= count:
        return False
    return bool(np.bincount(values.astype(np.int64), minlength=count).all())


def _index(samples: ArrayLike | slice, count: int) -> Codes:
    if isinstance(samples, slice):
        index = np.arange(count)[samples]
    else:
        try:
            given = np.asarray(samples)
        except ValueError:  # rows of different lengths
            given = np.empty((0, 0))
        if given.dtype == bool:
            if given.shape != (count,):
                raise DataError(f"the mask has shape {given.shape}, but there are {count} samples")
            index = np.flatnonzero(given)
        elif given.ndim == 1 and (given.dtype.kind in "iu" or given.size == 0):
            index = given.astype(np.int64)
            outside = index[(index < -count) | (index >= count)]
            if len(outside):
                raise DataError(f"there is no sample {outside[0]}: they are numbered 0 to {count - 1}")
        else:
            raise DataError("select takes a boolean mask, a flat array of indices, or a slice")
    if not len(index):
        raise DataError(f"none of the {count} samples is selected")
    return index


def _count(number: int, thing: str) -> str:
    return f"{number} {thing}{'' if number == 1 else 's'}"


def _shortened(names: tuple[str, ...]) -> str:
    if len(names) <= 7:
        return ", ".join(names)
    return f"{', '.join(names[:3])}, ..., {names[-1]} ({len(names)})"
