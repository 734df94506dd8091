"""Words for what states are, without anything that is slow to import."""

FRAMES = ("world", "body")
"""In which frame angular velocities are."""
