"""Gaussian processes over policies.

kernels.py     covariances of pairs of a state and a direction, as kernels of scikit-learn
rows.py        what samples say, one number a row
evidence.py    kernels, their hyperparameters and the noise, by marginal likelihood
process.py     the posterior, exact or on inducing rows
inducing.py    few rows as features, on which contact is inferred
learning.py    from samples to the posterior
"""
