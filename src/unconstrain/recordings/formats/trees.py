"""Files that hold a tree of arrays, such as MATLAB and HDF5 files, and where in the tree demonstrations repeat."""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Union

import numpy as np

from unconstrain.recordings.files import natural

WIDEST = 1024
"""Numbers a sample, at most, that become columns; images have more."""

MATRICES = ((3, 3), (3, 4), (4, 4))
"""Shapes of rotations and poses."""

MOST_OF = 0.9
"""Share of the numbers of a demonstration that its own parts must hold to be the demonstrations instead."""

FEWEST_UNNUMBERED = 3
"""Groups, at least, that are demonstrations by their content alone, where their names are not numbered."""

EPISODES = frozenset({
    "demo", "demos", "demonstration", "ep", "episode", "motion", "rollout", "run", "seq", "sequence", "traj",
    "trajectory", "trial",
})  # fmt: skip
"""Words in the names of numbered arrays that say that each is a demonstration."""


@dataclass(frozen=True)
class Leaf:
    """An array of a tree.

    Parameters
    ----------
    shape : tuple of int
        As its user sees it.
    kind : numpy.dtype
    where : object
        What finds it in its file, or the array itself.
    index : tuple or None
        Which part of it, as an array is indexed; None for all of it.
    """

    shape: tuple[int, ...]
    kind: np.dtype
    where: Any
    index: tuple[Any, ...] | None = None

    @cached_property
    def size(self) -> int:
        """The number of values."""
        return math.prod(self.shape)

    @cached_property
    def numbers(self) -> int:
        """The number of values that may become columns: none of images."""
        longest = max(self.shape, default=1)
        return self.size if self.size <= longest * WIDEST and not self.is_image else 0

    @property
    def is_image(self) -> bool:
        """Whether these are pixels: bytes along several axes."""
        return self.kind == np.uint8 and len(self.shape) > 2


@dataclass(frozen=True)
class Odd:
    """Something in a tree that is no array.

    Parameters
    ----------
    reason : str
        What it is instead, as in "holds text".
    """

    reason: str


Node = Union[Leaf, Odd, "dict[str, Node]", "list[Node]"]
"""An array, something else, named parts, or a sequence of alike parts (cells, arrays of structs)."""


@dataclass(frozen=True)
class Demonstration:
    """One demonstration of a file.

    Parameters
    ----------
    label : str or int
        What the file calls it: a name, or a number.
    content : dict of str to Node
        Its parts, by name.
    """

    label: str | int
    content: dict[str, Node]


@dataclass(frozen=True)
class Found:
    """Demonstrations, and where they are.

    Parameters
    ----------
    path : tuple of str
        Names that lead to them; empty where the file is one demonstration.
    names : tuple of str
        Of the parts that repeat, as a sentence names them, such as "demos".
    members : tuple of str
        Of the parts that hold them, as the tree names them.
    demonstrations : tuple of Demonstration
        In their natural order: 10 comes after 9.
    others : tuple of tuple of str
        Names that lead to further parts that repeat, which are not read.
    """

    path: tuple[str, ...]
    names: tuple[str, ...]
    members: tuple[str, ...]
    demonstrations: tuple[Demonstration, ...]
    others: tuple[tuple[str, ...], ...] = ()


def find_demonstrations(tree: dict[str, Node]) -> Found:
    """Find the part of a tree that repeats, with the most numbers.

    What repeats is a list of parts, several lists of one length beside each other, or groups or arrays whose names
    differ by their numbers only. Where nothing does, or arrays that do not repeat hold more numbers, the whole tree is
    one demonstration.

    Parameters
    ----------
    tree : dict of str to Node

    Returns
    -------
    Found
    """
    candidates = list(_candidates(tree, ()))
    best = max(candidates, key=_numbers, default=None)
    if best is None or _numbers(best) < _loose(tree):
        return Found((), (), (), (Demonstration(0, tree),))
    others = {(*other.path, *_last_step(other)) for other in _apart(candidates, best)}
    best = replace(best, others=tuple(sorted(each for each in others if each and each != best.path)))
    inner = [find_demonstrations(each.content) for each in best.demonstrations]
    if all(
        each.names and _numbers(each) > MOST_OF * numbers_in(demo.content)
        for each, demo in zip(inner, best.demonstrations, strict=True)
    ):
        nested = (
            Demonstration(f"{outer.label}/{demo.label}", demo.content)
            for outer, each in zip(best.demonstrations, inner, strict=True)
            for demo in each.demonstrations
        )
        return replace(best, demonstrations=tuple(nested))
    return best


def choose_part(tree: dict[str, Node], part: str, separator: str) -> dict[str, Node] | list[str]:
    """Return one part of a tree, and with it the numbers above it.

    Parameters
    ----------
    tree : dict of str to Node
    part : str
        Its path, or the end of its path where that tells it from others.
    separator : str
        Of paths.

    Returns
    -------
    dict of str to Node, or list of str
        The part; or the paths of all parts there are, where none or several are meant.
    """
    every = dict(_parts(tree, ()))
    wanted = tuple(part.strip(separator).split(separator))
    meant = [path for path in every if path == wanted] or [
        path for path in every if path[-len(wanted) :] == wanted
    ]
    if len(meant) != 1:
        return [separator.join(path) for path in (meant or every)]
    chosen = every[meant[0]]
    content: dict[str, Node] = {meant[0][-1]: chosen}
    if isinstance(chosen, dict):
        content = dict(chosen)
    above: Node = tree
    for step in meant[0]:
        assert isinstance(above, dict)
        for name, node in above.items():
            if isinstance(node, Leaf) and node.size == 1:
                content.setdefault(name, node)
        above = above[step]
    return content


def leaves(node: Node, separator: str, path: str = "") -> Iterator[tuple[str, Leaf | Odd]]:
    """Yield the arrays of a tree, and what else is in it, by path."""
    if isinstance(node, Leaf | Odd):
        yield path, node
        return
    if isinstance(node, list):
        yield path, Odd(f"is a sequence of {len(node)} parts, not an array")
        return
    for name, inner in node.items():
        yield from leaves(inner, separator, f"{path}{separator}{name}" if path else name)


def outside(tree: Mapping[str, Node], found: Found, separator: str) -> dict[str, Leaf | Odd]:
    """Return what lies beside the demonstrations of a tree, by path."""
    if not found.names:
        return {}
    beside: dict[str, Leaf | Odd] = {}
    path: tuple[str, ...] = ()
    inner: Node = dict(tree)
    for step in (*found.path, None):
        assert isinstance(inner, dict)
        skipped = found.members if step is None else (step,)
        for name, node in inner.items():
            if name not in skipped:
                beside.update(leaves(node, separator, separator.join((*path, name))))
        if step is not None:
            inner, path = inner[step], (*path, step)
    return beside


def numbers_in(node: Node) -> int:
    """Return how many numbers of a tree may become columns."""
    if isinstance(node, Leaf):
        return node.numbers
    if isinstance(node, Odd):
        return 0
    return sum(map(numbers_in, node if isinstance(node, list) else node.values()))


def _numbers(found: Found) -> int:
    return sum(numbers_in(each.content) for each in found.demonstrations)


def _candidates(tree: Mapping[str, Node], path: tuple[str, ...]) -> Iterator[Found]:
    """Yield whatever repeats, outer parts first."""
    yield from _lists(tree, path)
    yield from _groups(tree, path)
    yield from _arrays(tree, path)
    for name, node in tree.items():
        if isinstance(node, dict):
            yield from _candidates(node, (*path, name))


def _parts(tree: Mapping[str, Node], path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Node]]:
    """Yield the groups and lists of a tree that hold numbers."""
    for name, node in tree.items():
        if isinstance(node, dict | list) and numbers_in(node):
            yield (*path, name), node
        if isinstance(node, dict):
            yield from _parts(node, (*path, name))


def _last_step(found: Found) -> tuple[str, ...]:
    """Return what leads from the path of demonstrations to them alone: the name of a list."""
    return found.members if len(found.members) == 1 else ()


def _apart(candidates: list[Found], best: Found) -> Iterator[Found]:
    """Yield the demonstrations that lie neither within the best nor around them."""
    own = {(*best.path, name) for name in best.members}
    around = {way[:depth] for way in own for depth in range(1, len(way) + 1)}
    for other in candidates:
        ways = [(*other.path, name) for name in other.members]
        within = any(way[:depth] in own for way in ways for depth in range(1, len(way)))
        if not within and not any(way in around for way in ways):
            yield other


def _loose(tree: Mapping[str, Node]) -> int:
    """Return how many numbers are in arrays of a tree that do not repeat."""
    repeats = {
        name for kind in (_lists, _groups, _arrays) for found in kind(tree, ()) for name in found.members
    }
    rest = {name: node for name, node in tree.items() if name not in repeats}
    return sum(
        _loose(node) if isinstance(node, dict) else node.numbers if isinstance(node, Leaf) else 0
        for node in rest.values()
    )


def _lists(tree: Mapping[str, Node], path: tuple[str, ...]) -> Iterator[Found]:
    lists = {name: node for name, node in tree.items() if isinstance(node, list) and node}
    for length in dict.fromkeys(map(len, lists.values())):
        alike = {name: node for name, node in lists.items() if len(node) == length and numbers_in(node)}
        if not alike:
            continue
        demonstrations = []
        for i in range(length):
            content: dict[str, Node] = {}
            for name, node in alike.items():
                part = node[i]
                if isinstance(part, dict) and len(alike) == 1:
                    content |= part
                else:
                    content[name] = part
            if numbers_in(content):
                demonstrations.append(Demonstration(i + 1, content))
        empty = length - len(demonstrations)
        said = f" ({empty} of {length} without numbers left out)" if empty else ""
        yield Found(path, tuple(f"{name}{said}" for name in alike), tuple(alike), tuple(demonstrations))


def _groups(tree: Mapping[str, Node], path: tuple[str, ...]) -> Iterator[Found]:
    groups = {name: node for name, node in tree.items() if isinstance(node, dict) and numbers_in(node)}
    stems: dict[str, list[str]] = {}
    for name in groups:
        if re.search(r"\d", name):
            stems.setdefault(re.sub(r"\d+", "#", name), []).append(name)
    if not stems and len(groups) == len(tree) >= FEWEST_UNNUMBERED:
        contents = {tuple(sorted(node)) for node in groups.values()}
        if len(contents) == 1:
            stems = {"*": list(groups)}
    for stem, names in stems.items():
        ordered = sorted(names, key=natural)
        demonstrations = tuple(Demonstration(name, groups[name]) for name in ordered)
        yield Found(path, (stem.replace("#", "*"),), tuple(names), demonstrations)


def _arrays(tree: Mapping[str, Node], path: tuple[str, ...]) -> Iterator[Found]:
    """Yield arrays that are a demonstration each: called so, or of several lengths and else alike."""
    numbered: dict[str, dict[tuple[str, ...], str]] = {}
    for name, node in tree.items():
        if isinstance(node, Leaf) and node.numbers > 1 and re.search(r"\d", name):
            numbers = tuple(re.findall(r"\d+", name))
            numbered.setdefault(re.sub(r"\d+", "#", name), {})[numbers] = name
    sets: dict[tuple[tuple[str, ...], ...], list[str]] = {}
    for stem, names in numbered.items():
        if len(names) > 1:
            sets.setdefault(tuple(sorted(names)), []).append(stem)
    for keys, stems in sets.items():
        if not any(_is_repeated(stem, [tree[name] for name in numbered[stem].values()]) for stem in stems):
            continue
        ordered = sorted(keys, key=lambda numbers: natural(numbered[stems[0]][numbers]))
        demonstrations = tuple(
            Demonstration("/".join(numbers), {_plain(stem): tree[numbered[stem][numbers]] for stem in stems})
            for numbers in ordered
        )
        members = tuple(numbered[stem][numbers] for numbers in ordered for stem in stems)
        yield Found(path, tuple(stem.replace("#", "*") for stem in stems), members, demonstrations)


def _is_repeated(stem: str, arrays: list[Node]) -> bool:
    if EPISODES & set(re.findall(r"[a-z]+", stem.lower())):
        return True
    shapes = [array.shape for array in arrays if isinstance(array, Leaf)]
    lengths = {max(shape) for shape in shapes}
    widths = {math.prod(shape) // max(shape) for shape in shapes}
    return len(lengths) > 1 and len(widths) == 1


def _plain(stem: str) -> str:
    return stem.replace("#", "").strip("_-. ") or "array"
