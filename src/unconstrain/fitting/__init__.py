"""From samples to the parameters of a policy.

observation.py   what a recorded action says of the policy: Q, Q u
moments.py       the sums a fit is solved from
kernels/         adding samples up into them, fast
model.py         policies that are linear in their parameters, with everything placed and no parameters
accumulator.py   the object that fits, streams and clusters drive: add, merge, solve
sums.py          what it holds: moments by fold, and counts
solve.py         folds, and the choice of λ
posterior.py     how sure a fit is
"""
