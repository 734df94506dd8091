"""A humanoid reaches for a ball through a gap in a barrier (section 4.3): Table II, Figs. 5 and 6."""
