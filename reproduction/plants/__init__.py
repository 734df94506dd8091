"""Simulated plants whose policy and constraints are known, so that what is learnt can be judged."""
