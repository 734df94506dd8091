"""`python -m reproduction`: the program."""

import sys


def main() -> None:
    """Run the program, and end with its exit code: 0, 2 after a user's mistake, 130 after Ctrl-C."""
    try:
        from reproduction.program import run  # here, because Ctrl-C may come while it is imported

        code = run()
    except KeyboardInterrupt:
        print("interrupted: finished trials are kept", file=sys.stderr)
        code = 130
    sys.exit(code)


if __name__ == "__main__":
    main()
