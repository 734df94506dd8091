from dataclasses import dataclass, fields

import click
import pytest

from unconstrain.cli import models
from unconstrain.cli.declared import ColumnName, ColumnNames, Number, Numbers, declared_options, parameters
from unconstrain.cli.fit import fit
from unconstrain.features.centers import PLACEMENTS
from unconstrain.fitting.observation import RISKS
from unconstrain.recordings.columns import Columns
from unconstrain.recordings.preparation import Preparation


@dataclass(frozen=True)
class Asked:
    """What is asked.

    Parameters
    ----------
    some : column, or list of columns
        Some `width_of` columns.
    one : column
        One column,
        over two lines.
    width_of : float, optional
        A width.
    kind : {"a", "b"}
        A choice.
    loud : bool
        A flag.

    Raises
    ------
    DataError
        Never.
    """

    some: str | int | list[str | int] | None = None
    one: str | int | None = None
    width_of: float = 0.5
    kind: str | None = None
    loud: bool = False


def test_a_field_becomes_an_option_with_its_type_default_and_description():
    command = lambda: None  # noqa: E731
    for decorator in reversed(declared_options(Asked, section="Asked")):
        command = decorator(command)
    some, one, width, kind, loud = click.command()(command).params
    assert (some.opts, some.help) == (["--some"], "Some --width-of columns.")
    assert one.help == "One column, over two lines."
    assert (width.opts, width.default) == (["--width-of"], 0.5)
    assert isinstance(some.type, ColumnNames)
    assert isinstance(one.type, ColumnName)
    assert isinstance(width.type, Number)
    assert kind.type.choices == ("a", "b")
    assert loud.is_flag


@pytest.mark.parametrize("declaration", [Columns, Preparation])
def test_all_that_the_library_declares_is_an_option(declaration):
    options = {option.name: option for option in fit.params}
    for field in fields(declaration):
        assert field.name in parameters(declaration)
        assert options[field.name].default == field.default
        assert options[field.name].help


def test_models_have_the_librarys_words():
    assert set(models.PLACEMENTS) == set(PLACEMENTS)
    assert set(models.RISKS) == set(RISKS)


@pytest.mark.parametrize(
    ("kind", "text", "value"),
    [
        (ColumnNames(), "x,y", ["x", "y"]),
        (ColumnNames(), "x, y", ["x", "y"]),
        (ColumnNames(), "0,12", [0, 12]),
        (ColumnNames(), "differentiate", "differentiate"),
        (ColumnNames(), '"x, in m",y', ["x, in m", "y"]),
        (ColumnNames(), "²,x", ["²", "x"]),
        (ColumnName(), "t", "t"),
        (ColumnName(), "3", 3),
        (ColumnName(), '"t, in s"', "t, in s"),
        (Number(), "0.5", 0.5),
        (Number(zero=True, words=("cv",)), "cv", "cv"),
        (Number(zero=True), "0", 0.0),
        (Numbers(), "-1,2e3", [-1.0, 2e3]),
    ],
)
def test_texts_are_parsed(kind, text, value):
    assert kind.convert(text, None, None) == value
    assert isinstance(value, str) or kind.convert(value, None, None) == value


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        (ColumnNames(), ""),
        (ColumnNames(), "x,,y"),
        (ColumnNames(), "x\ny"),
        (ColumnName(), "x,y"),
        (Number(), "0"),
        (Number(), "-1"),
        (Number(), "nan"),
        (Number(), "1e999"),
        (Number(), "one"),
        (Number(zero=True), "-1"),
        (Numbers(), "1,"),
        (Numbers(), "1,inf"),
    ],
)
def test_mistakes_are_told(kind, text):
    with pytest.raises(click.UsageError):
        kind.convert(text, None, None)
