"""`unconstrain inspect`: what is in a recording, and the command to type next."""

import click

from unconstrain.cli import reporting
from unconstrain.cli.command import command, in_words_of_program
from unconstrain.progress import working


@command(
    short_help="Show what is in a recording, and what to type next.",
    epilog="For example:\n\n\b\nunconstrain inspect wipe.csv",
)
@click.argument("files", nargs=-1, required=True, metavar="FILES...")
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Print one JSON object: rows, episodes, rate_hz, duration_s, columns, notes, next.",
)
@click.option(
    "--part",
    help="Which part of a file: a sheet, a section of an export, a file of an archive, a set of demonstrations.",
)
@click.option("--keys", is_flag=True, help="Only list the columns, or the topics where a file has these.")
def inspect(files: tuple[str, ...], as_json: bool, part: str | None, keys: bool) -> None:
    """Show what is in recordings: columns and what they are, rate, duration, episodes, gaps, oddities.

    FILES are recordings in any format that `unconstrain fit` reads. What is printed last is a command that was tried
    to read them; where there is none, a note says why.
    """
    import json
    from dataclasses import replace

    from unconstrain.recordings import inspection

    if keys and not as_json:
        for key in inspection.list_keys(files, part):
            reporting.say(key)
        return
    with working("reading"):
        found = inspection.inspect(files, part)
    found = replace(found, notes=tuple(map(in_words_of_program, found.notes)))
    if as_json:
        reporting.say(json.dumps(found.to_dict(), allow_nan=False))
    else:
        reporting.say(str(found))
