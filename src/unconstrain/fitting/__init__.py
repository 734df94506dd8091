"""From samples to the parameters of a policy.

observation.py   what a recorded action says of the policy: Q, Q u
moments.py       the sums a fit is solved from
kernels/         adding samples up into them, fast
model.py         what is asked of a model: a policy that is linear in its parameters, with everything placed
global_model.py  one set of parameters for all states
local_models.py  local models that are blended
accumulator.py   the object that fits, streams and clusters drive: add, merge, solve
sums.py          what it holds: moments by fold, and counts
solve.py         folds, and the choice of λ
wide/            models so wide that samples are held instead of summed up, and solved by conjugate gradients
posterior.py     how sure a fit is
calibration.py   how much wider that has to be, by what was held out
"""
