"""The command line: one file a command, and what several of them share."""

import sys


def main() -> None:
    """Run the program, and end with its exit code: 0, 2 after a user's mistake, 130 after Ctrl-C."""
    try:
        from unconstrain.cli.app import run  # here, because Ctrl-C may come while it is imported

        code = run()
    except KeyboardInterrupt as stop:
        said = f"{stop}; " if str(stop) else "interrupted: "
        print(f"{said}nothing was left half written", file=sys.stderr)
        # If an interrupt passes through `exec`, Python kills itself at its end, unless a later one ends well.
        exec("")
        code = 130
    sys.exit(code)


__all__ = ["main"]
