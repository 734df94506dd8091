"""What tests of several commands share."""

import os
import subprocess
import sys

COLUMNS = ("--state", "x1,x2", "--action", "u1,u2", "--episode", "episode")


def share(line):
    """The last percentage in a line, that of what is shown, as a fraction."""
    return float(line.split("%")[-2].split()[-1]) / 100


def start(*arguments, **options):
    """The program as a process of its own."""
    command = [sys.executable, "-m", "unconstrain", *map(str, arguments)]
    return subprocess.run(command, text=True, env=os.environ | options.pop("env", {}), timeout=120, **options)
