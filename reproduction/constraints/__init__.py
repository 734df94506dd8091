"""Constraints learnt, measured and used: beyond the paper, up to what later papers on learning constraints show."""
