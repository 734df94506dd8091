"""`python -m unconstrain`: the command line."""

from unconstrain.cli import main

main()
