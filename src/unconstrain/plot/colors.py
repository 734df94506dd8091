"""What each colour stands for in all pictures: those of Okabe and Ito, told apart by colour-blind readers too."""

TRUE = "#000000"
"""The true policy, or anything else that is known for certain."""

LEARNT = "#0072B2"
"""What was learnt by this library's methods."""

DIRECT = "#D55E00"
"""Ordinary regression; recorded actions; constraint rows."""

RECORDED = "#777777"
"""Recorded movements."""

PALE = "#B8B8B8"
"""Recorded actions, on which others are drawn."""

SERIES = (LEARNT, DIRECT, "#009E73", "#CC79A7")
"""Things of equal standing, in this order."""
