"""Numbers as people and their programs write them, made those that Arrow reads."""

import pyarrow as pa
import pyarrow.compute as pc

from unconstrain.errors import DataError
from unconstrain.recordings.formats.text_times import iso_times

DECIMAL_COMMA = r"^\s*([+-]?\d*),(\d+(?:[eE][+-]?\d+)?)\s*$"
COMMAS_TELL = "commas in numbers are read as decimal marks"
POINTS_TOO = "in numbers such as 1.050,5 points set off thousands and commas are read as decimal marks"

# Each begins with a sign, if any. A number that begins with 0 has nothing to set off.
THOUSANDS = r"^\s*[+-]?[1-9]\d{0,2}(,\d{3})+(\.\d*)?\s*$"
SURE_THOUSANDS = r"^\s*[+-]?[1-9]\d{0,2}((,\d{3}){2,}(\.\d*)?|,\d{3}\.\d*)\s*$"
BOTH = r"^\s*[+-]?[1-9]\d{0,2}(\.\d{3})+,\d+\s*$"
PLAIN_SMALL = r"^\s*[+-]?\d{1,3}(\.\d*)?\s*$"
HUNDREDS = r"^\s*[+-]?[1-9]\d{2}(\.\d*)?\s*$"
PLAIN = r"^\s*[+-]?\d+(\.\d*)?\s*$"
SPACED = r"^[+-]?\d{1,3}(['’\x{a0}\x{202f}\x{2009} ]\d{3})+([.,]\d*)?$"
FORTRAN = r"^([+-]?\d*\.?\d*)[dD]([+-]?\d+)$"
WITH_UNIT = (
    r"^(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>[A-Za-z°%µμΩ][^\d,:;\[\]()]{0,7})$"
)

DATE = r"^(?:19|20)\d{2}[01]\d[0-3]\d[0-2]\d[0-5]\d[0-5]\d(?:\.?\d{1,9})?$"

MISSING = frozenset(
    {
        "na", "n/a", "n.a.", "<na>", "null", "none", "nil", "missing", "-", "--", "---", ".", "?", "*", "#n/a", "#na",
        "#null!", "#div/0!", "#value!", "#num!", "1.#qnan", "-1.#qnan", "1.#ind", "-1.#ind", "1.#inf", "-1.#inf",
        "nan(ind)", "-nan(ind)", "-nan",
    }
)  # fmt: skip
"""What stands for a number that is missing, in small letters."""

SENTINELS = (-999.0, -9999.0, -99999.0, -999999.0)
"""Numbers that stand for a missing one where they lie far from all others."""

FEWEST = 10
"""Numbers, at least, from which a sentinel is told."""

FAR = 5.0
"""A sentinel is as many times as far from the others as these are apart."""


def plain_text(
    column: pa.Array, where: str, called: str, guesses: dict[str, None], *, may_have_commas: bool
) -> pa.Array:
    """Return a column in which numbers and stamps are written as Arrow reads them, and other text as it is.

    Parameters
    ----------
    column : pyarrow.Array of text
    where, called : str
        The file and the column, and the column alone, as a sentence says them.
    guesses : dict of str to None
        What is guessed is added to it.
    may_have_commas : bool
        Whether a comma is not what separates cells.

    Returns
    -------
    pyarrow.Array of text
        Null where it is missing.

    Raises
    ------
    DataError
        It cannot be told what commas in numbers mean.
    """
    numbers = cast(column)
    if numbers is not None and len(column) and _any(column[:1], DATE):
        stamps, _ = iso_times(column)
        if stamps is not column:
            guesses[f"{called} is read as dates and times written without marks, such as {column[0]}"] = None
            return stamps
    if numbers is not None:
        return without_sentinels(column, numbers, called, guesses)
    column = pc.utf8_trim_whitespace(column)
    column = pc.if_else(pc.equal(column, ""), pa.scalar(None, pa.string()), column)
    own: dict[str, None] = {}
    cleaned = _without_words(column, called, own)
    if may_have_commas:
        cleaned = _without_commas(cleaned, where, called, own)
    if cast(cleaned) is None:
        cleaned = _without_spaces(cleaned, called, own)
        if may_have_commas and any("spaces" in guess for guess in own):
            cleaned = _without_commas(cleaned, where, called, own)
        cleaned = pc.replace_substring_regex(cleaned, FORTRAN, r"\1e\2")
        cleaned = _without_units(cleaned, called, own)
    numbers = cast(cleaned)
    if numbers is not None:
        guesses |= own
        return without_sentinels(cleaned, numbers, called, guesses)
    worded = _without_words(column, called, {})
    stamps, found = iso_times(worded)
    if stamps is not worded:
        guesses |= {f"{called}: {guess}": None for guess in found}
        return stamps
    # What numbers there are beside text have their commas read alike.
    again = _without_commas(column, where, called, guesses) if may_have_commas else column
    return again


def cast(column: pa.Array) -> pa.Array | None:
    """Return text as numbers; None where some of it is none.

    Parameters
    ----------
    column : pyarrow.Array of text

    Returns
    -------
    pyarrow.Array of float64, or None
    """
    try:
        return column.cast(pa.float64())
    except pa.ArrowInvalid:
        return None


def _without_words(column: pa.Array, called: str, guesses: dict[str, None]) -> pa.Array:
    """Return a column without the words that stand for something missing."""
    words = pc.is_in(pc.utf8_lower(column), pa.array(sorted(MISSING)))
    count = pc.sum(words).as_py() or 0
    if not count or count == len(column) - column.null_count:
        return column
    shown = ", ".join(repr(word) for word in pc.unique(column.filter(words)).to_pylist()[:3])
    guesses[f"{called} holds {shown} in {count} row{'' if count == 1 else 's'}, taken for missing"] = None
    return pc.if_else(words, pa.scalar(None, pa.string()), column)


def without_sentinels(column: pa.Array, numbers: pa.Array, called: str, guesses: dict[str, None]) -> pa.Array:
    """Return a column without a number such as -9999 that lies far from all others.

    Parameters
    ----------
    column : pyarrow.Array of text
    numbers : pyarrow.Array
        Its numbers.
    called : str
        The column, as a sentence says it.
    guesses : dict of str to None
        What is guessed is added to it.

    Returns
    -------
    pyarrow.Array of text
    """
    if len(numbers) < FEWEST:
        return column
    for sentinel in SENTINELS:
        held = pc.equal(numbers, sentinel)
        count = pc.sum(held).as_py() or 0
        if not count:
            continue
        others = pc.min_max(numbers.filter(pc.and_(pc.invert(held), pc.is_finite(numbers))))
        low, high = others["min"].as_py(), others["max"].as_py()
        if low is None or not low < high:
            continue
        if min(abs(sentinel - low), abs(sentinel - high)) > FAR * (high - low):
            rows = f"{count} row{'' if count == 1 else 's'}"
            guesses[
                f"{called} holds {sentinel:g} in {rows}, taken for missing since all others lie from {low:g} to "
                f"{high:g}; write another number if it is meant"
            ] = None
            column = pc.if_else(held, pa.scalar(None, column.type), column)
    return column


def _without_spaces(column: pa.Array, called: str, guesses: dict[str, None]) -> pa.Array:
    """Return a column whose numbers have no spaces or apostrophes between thousands."""
    spaced = _matches(column, SPACED)
    if not pc.any(spaced).as_py():
        return column
    guesses[f"spaces or apostrophes in numbers of {called} are read as setting off thousands"] = None
    return pc.if_else(spaced, pc.replace_substring_regex(column, r"['’\x{a0}\x{202f}\x{2009} ]", ""), column)


def _without_units(column: pa.Array, called: str, guesses: dict[str, None]) -> pa.Array:
    """Return a column whose numbers have no unit behind them, where all have the same."""
    some = column.drop_null()
    if not len(some) or not pc.all(_matches(some, WITH_UNIT)).as_py():
        return column
    parts = pc.extract_regex(column, WITH_UNIT)
    units = pc.unique(parts.field("unit").filter(column.is_valid())).to_pylist()
    if len(units) > 1:
        return column
    guesses[f"numbers of {called} have the unit {units[0].strip()} behind them, which is not converted"] = (
        None
    )
    return pc.if_else(column.is_valid(), parts.field("number"), pa.scalar(None, pa.string()))


def _without_commas(column: pa.Array, where: str, called: str, guesses: dict[str, None]) -> pa.Array:
    """Return text whose numbers have neither decimal commas nor thousands set off."""
    has_comma = pc.match_substring(column, ",")
    if not pc.any(has_comma).as_py():
        return column
    with_comma, others = column.filter(has_comma), column.filter(pc.invert(has_comma))
    if _any(with_comma, BOTH):
        column = pc.replace_substring_regex(column, r"(\d)\.(\d{3})", r"\1\2")
        guesses[POINTS_TOO] = None
        return pc.replace_substring_regex(column, DECIMAL_COMMA, r"\1.\2")
    numbers = with_comma.filter(pc.or_(_matches(with_comma, DECIMAL_COMMA), _matches(with_comma, THOUSANDS)))
    if not len(numbers):
        return column
    is_decimal = not pc.all(_matches(numbers, THOUSANDS)).as_py()
    plain = others.filter(_matches(others, PLAIN))
    # 950 beside 1,050: a decimal that always has three digits would be 950,000.
    beside = len(plain) > 0 and pc.all(_matches(plain, PLAIN_SMALL)).as_py()
    is_thousands = _any(numbers, SURE_THOUSANDS) or (not is_decimal and beside and _any(plain, HUNDREDS))
    if beside and not is_decimal and not is_thousands:
        raise DataError(
            f"{where} holds {numbers[0].as_py().strip()!r} beside {plain[0].as_py().strip()!r}, so its comma may be a "
            "decimal mark or set off thousands; write numbers with points and without anything between thousands"
        )
    if is_decimal and is_thousands:
        odd = numbers.filter(pc.invert(_matches(numbers, THOUSANDS)))[0].as_py().strip()
        sure = numbers.filter(_matches(numbers, SURE_THOUSANDS))[0].as_py().strip()
        raise DataError(
            f"{where} holds {sure!r} and {odd!r}, so its commas mean two things; write numbers with points and "
            "without anything between thousands"
        )
    if is_thousands:
        guesses[f"commas in numbers of {called} are read as setting off thousands"] = None
        return pc.if_else(_matches(column, THOUSANDS), pc.replace_substring(column, ",", ""), column)
    guesses[COMMAS_TELL] = None
    return pc.replace_substring_regex(column, DECIMAL_COMMA, r"\1.\2")


def _matches(column: pa.Array, pattern: str) -> pa.Array:
    return pc.match_substring_regex(column, pattern)


def _any(column: pa.Array, pattern: str) -> bool:
    return bool(pc.any(_matches(column, pattern)).as_py())
