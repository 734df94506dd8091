"""What recordings cannot tell: whether the report of `identifiability` is true, and its advice worth following."""
