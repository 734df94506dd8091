"""What a fit in one pass learnt, in lines."""

import numpy as np

from unconstrain.policies.base import Policy


def describe_fit(policy: Policy) -> str:
    """Say what a policy was fitted to in one pass, and how well it predicts what was held out.

    Parameters
    ----------
    policy : Policy
        Fitted, by `fit_stream` or `distributed.fit`.

    Returns
    -------
    str
        A line for the samples, for known constraints, for samples without motion, for λ and for the held-out risk;
        those that do not apply are left out.

    Raises
    ------
    PolicyError
        The policy was saved without its sums.
    """
    accumulator = policy.resume()
    episodes = f" in {accumulator.folds.n_dealt:,} episodes" if accumulator.folds is not None else ""
    lines = [f"read: {policy.n_samples_seen_:,} samples{episodes}"]
    if policy.n_known_constraints_:
        share = policy.n_known_constraints_ / policy.n_samples_seen_
        lines.append(f"constraints: known of {share:.1%} of the samples")
    lines.append(f"zero actions: {policy.n_zero_actions_:,} without a direction")
    if accumulator.folds is None:
        return "\n".join(lines)
    total = accumulator.moments()
    error = float(policy.held_out_risk_[np.argmax(policy.alphas_ == policy.alpha_)])
    motion = float(total.squares.sum() / total.weight.sum())
    each = ", of the local models each by itself" if total.weight.ndim else ""
    explained = f", {1.0 - error / motion:.2%} of observed motion explained" if motion else ""
    lines.append(f"λ: {policy.alpha_:.3g} (chosen by cross-validation)")
    lines.append(f"held-out risk{each}: {error:.4g}{explained}")
    return "\n".join(lines)
