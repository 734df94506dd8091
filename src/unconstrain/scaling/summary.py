"""What a fit to a stream learnt, in lines."""

import numpy as np

from unconstrain.fitting.inference import CONSTRAINED, FREE
from unconstrain.policies.base import Policy


def describe_fit(policy: Policy) -> str:
    """Say what a policy was fitted to as a stream, and how well it predicts what was held out.

    Parameters
    ----------
    policy : Policy
        Fitted, by `fit_stream` or `distributed.fit`.

    Returns
    -------
    str
        A line for the samples, for known constraints, for samples without motion, for contact, noise and likelihoods
        as inferred, for λ and for the held-out risk; those that do not apply are left out.

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
    if accumulator.belief is not None:
        lines += _describe_contact(policy)
    chosen = f"λ: {policy.alpha_:.3g} (chosen by cross-validation)"
    if policy.risk == "corrected" or accumulator.belief is not None or accumulator.folds is None:
        return "\n".join([*lines, chosen] if accumulator.folds is not None else lines)
    total = accumulator.moments()
    error = float(policy.held_out_risk_[np.argmax(policy.alphas_ == policy.alpha_)])
    motion = float(total.squares.sum() / total.weight.sum())
    each = ", of the local models each by itself" if total.weight.ndim else ""
    explained = f", {1.0 - error / motion:.2%} of observed motion explained" if motion else ""
    lines.append(chosen)
    lines.append(f"held-out risk{each}: {error:.4g}{explained}")
    return "\n".join(lines)


def _describe_contact(policy: Policy) -> list[str]:
    """Say what the adaptive risk found, beside what else could have been."""
    speed = f", and {policy.speed_noise_:.1%} of the speed" if policy.speed_noise_ else ""
    held_out = "held-out log-likelihood" if policy.alpha == "cv" else "log-likelihood"
    others = policy.log_likelihoods_
    name, value = next(iter(others.items()))
    beside = "".join(
        f", {other} {others[other]:.4g}" for other in (FREE, CONSTRAINED) if other in others and other != name
    )
    return [
        f"contact: {policy.free_share_:.1%} of the samples free",
        f"noise: {policy.noise_:.3g} in the unit of the actions{speed}",
        f"{held_out} of a sample: {value:.4g} ({name}){beside}",
    ]
