"""The paper's experiments, and those that go beyond it: ``python -m reproduction toy``.

`plants` holds what is simulated. Every experiment is a package: `experiment` runs it, `trials` holds one data set of
it, `tables` and `figures` show the results beside the figures of `published`. `report` puts all on one page.
"""
