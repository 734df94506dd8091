"""Units of columns, as names and headers write them."""

import re

UNITS = {
    "m": "m", "mm": "mm", "cm": "cm", "km": "km", "um": "um", "inch": "inch", "rad": "rad", "rads": "rad",
    "radian": "rad", "radians": "rad", "deg": "deg", "degs": "deg", "degrees": "deg", "degree": "deg", "s": "s",
    "sec": "s", "secs": "s", "seconds": "s", "second": "s", "ms": "ms", "msec": "ms", "milliseconds": "ms",
    "us": "us", "usec": "us", "microseconds": "us", "ns": "ns", "nsec": "ns", "nsecs": "ns", "nanosec": "ns",
    "nanoseconds": "ns", "n": "N", "nm": "Nm", "meter": "m", "meters": "m", "metre": "m", "metres": "m",
    "millimeters": "mm", "millimetres": "mm", "centimeters": "cm", "centimetres": "cm", "°": "deg",
}  # fmt: skip
"""Units as names of columns and headers write them, in small letters."""

UNIT = re.compile(
    r"(-|[nuµμm]?s|secs?|seconds?|min|h|[ckmuµμ]?m|(milli|centi)?met(re|er)s?|inch|rad|radians?|deg|degrees?|°|[kmM]?N|"
    r"N\s?[·*.]?\s?m+|[kM]?Hz|m?[VAG]|W|J|k?g|°?[CF]|K|[hk]?Pa|bar|rpm|counts?|px|pixels?|u?T|%|"
    r"(m|mm|cm|rad|deg|°)[ /·]*s(/s|\^?-?[12²])?)",
    re.IGNORECASE,
)
"""What may stand where a unit is expected."""

SI = re.compile(
    r"((m|rad|kg|s|N|Nm|A|V|W|J|K|Pa|Hz)([ ·*/.]+(s|m|rad|kg)(\^?-?[1-3]|[²³])?)*)?|(?P<time>[mun]s)|%"
)
"""Units that need no word, since they are what is expected, and those of time, which are known."""


def plain_unit(text: str) -> str:
    """Return a unit as this package writes it, without brackets; others as they are, and "" for a dash.

    >>> plain_unit("[MM]"), plain_unit("degrees"), plain_unit("(m/s)"), plain_unit("-")
    ('mm', 'deg', 'm/s', '')
    """
    bare = text.strip().strip("[](){}<>").strip().replace("µ", "u").replace("μ", "u")
    return "" if bare in ("-", "--") else UNITS.get(bare.lower(), bare)


def unit_in(name: str) -> str:
    """Return the unit that stands in brackets at the end of a name, or "".

    >>> unit_in("X [mm]"), unit_in("Time (Seconds)"), unit_in("q[0]"), unit_in("x")
    ('mm', 's', '', '')
    """
    found = re.search(r"[\[(]([^\])\[(]{1,12})[\])]\s*$", name)
    return plain_unit(found[1]) if found and UNIT.fullmatch(found[1].strip()) else ""


def said_of_units(units: dict[str, str]) -> tuple[str, ...]:
    """Say which columns are not in SI units, as a note does.

    Parameters
    ----------
    units : dict of str to str
        By column.

    Returns
    -------
    tuple of str
        One sentence, or none.
    """
    own: dict[str, list[str]] = {}
    for name, unit in units.items():
        if not SI.fullmatch(unit):
            own.setdefault(unit, []).append(name)
    if not own:
        return ()
    told = [
        f"{', '.join(names[:4])}{f' and {len(names) - 4} more' if len(names) > 4 else ''} in {unit}"
        for unit, names in own.items()
    ]
    return (f"units are those of the file, and not converted: {'; '.join(told)}",)
