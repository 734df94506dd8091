"""The fast inner loops that add samples up, and the definition that a test compares each with.

products.py    the distinct products of an array's columns
blocks.py      blocks of samples that stay in the processor's cache, shared out over threads
parametric.py  moments of one model
local.py       moments of many local models at once
reference.py   the same moments as the equations define them
"""
