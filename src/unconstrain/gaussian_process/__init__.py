"""Gaussian processes over policies.

kernels.py     covariances of pairs of a state and a direction, as kernels of scikit-learn
pairs.py       such pairs as rows
parts.py       what a kernel is made of
rows.py        what samples say, one number a row
evidence.py    kernels, their hyperparameters and the noise, by marginal likelihood
process.py     the posterior, exact or on inducing rows
inducing.py    few rows as features, on which contact is inferred
spreading.py   few states that stand for many
conditioning.py  exactly, or on inducing rows
held_out.py    the process without each fold, and how wide its covariance has to be
learning.py    from samples to the posterior
model.py       what estimators ask of a model
"""
