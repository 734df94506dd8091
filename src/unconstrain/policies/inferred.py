"""What a policy has found out about its recordings, in sentences."""

import numpy as np

from unconstrain.fitting.inference import CONSTRAINED, FREE, SPEED
from unconstrain.notebook import format_sentences, format_table
from unconstrain.policies.base import Policy

NOTHING_FOUND = "no contact was found in these recordings, so this is ordinary regression"
NOTHING_MORE_FOUND = (
    "beyond the constraints that are known no contact was found in these recordings: "
    "other samples count as free"
)
IN_DOUBT = (
    "warning: no contact could be told from what the model itself misses, so all samples count as free; but some of "
    "them look constrained, so try a finer model (more centres, another width or another kind), which can tell"
)

DOUBTFUL = 0.1
"""Gain in log-likelihood of a sample, whatever it is worth, by which contact would explain more than none."""


def finds_no_contact(policy: Policy) -> bool:
    """Whether all samples that the policy has learnt from were taken for free, having been looked at.

    Parameters
    ----------
    policy : Policy
        Fitted.

    Returns
    -------
    bool
        False for other risks than "adaptive".
    """
    return policy.solution_.belief is not None and next(iter(policy.log_likelihoods_), None) == FREE


def is_in_doubt(policy: Policy) -> bool:
    """Whether contact would explain more than none, though it could not be told from what the model misses.

    Parameters
    ----------
    policy : Policy
        Fitted.

    Returns
    -------
    bool
        False for other risks than "adaptive".
    """
    if not finds_no_contact(policy):
        return False
    likelihoods = policy.log_likelihoods_
    # Constraints on every sample explain anything, so their likelihood is no ground for doubt.
    rivals = [value for name, value in likelihoods.items() if name not in (CONSTRAINED, SPEED)]
    return max(rivals) - likelihoods[FREE] > DOUBTFUL


def describe_inferred(policy: Policy) -> str:
    """Say in which scale actions are, which samples were free, and how large the noise and how likely all that is.

    Parameters
    ----------
    policy : Policy
        Fitted.

    Returns
    -------
    str
        A few lines: the scale of the actions, where there is one, and what was found out. For the corrected risk that
        is the noise, for those that find out nothing none.
    """
    scaled = policy.model_.scale is not None
    unit = "units of the scale" if scaled else "the unit of the action"
    lines = []
    if scaled:
        each = ", ".join(f"{value:.3g}" for value in policy.scale_)
        lines.append(
            f"scale of the actions, in which errors and noise are measured: {each}; scale= says otherwise"
        )
    if policy.risk == "corrected":
        return "\n".join([*lines, f"noise: {policy.noise_:.3g} in {unit}"])
    if policy.solution_.belief is None:
        return "\n".join(lines)
    lines += [
        f"inferred: {policy.free_share_:.1%} of the samples were free",
        f"noise: {policy.noise_:.3g} in {unit}",
    ]
    if policy.solution_.record.beginning:
        lines.append(policy.solution_.record.beginning)
    if policy.speed_noise_ > 0:
        lines.append(f"noise of the speed: {policy.speed_noise_:.1%}")
    likelihoods = policy.log_likelihoods_
    if likelihoods:
        chosen = next(iter(likelihoods))
        others = [f"{likelihoods[name]:.4g} if {name}" for name in (FREE, CONSTRAINED) if name in likelihoods]
        held_out = "held-out " if getattr(policy, "alpha", "cv") == "cv" else ""
        lines.append(
            f"log-likelihood of a {held_out}sample: {policy.log_likelihood_:.4g} as inferred, {', '.join(others)}"
        )
        if chosen == FREE:
            found = NOTHING_MORE_FOUND if policy.n_known_constraints_ else NOTHING_FOUND
            lines.append(IN_DOUBT if is_in_doubt(policy) else found)
    return "\n".join(lines)


def to_html(policy: Policy) -> str:
    """Write what a policy has learnt in HTML, which notebooks show.

    Parameters
    ----------
    policy : Policy
        Fitted.

    Returns
    -------
    str
        HTML: a table, and what was inferred in sentences.
    """
    rows = [
        ("states", policy.space_.words),
        ("actions", str(policy.n_actions_)),
        ("samples learnt from", f"{policy.n_samples_seen_:,}"),
        ("risk", policy.risk),
    ]
    if policy.n_zero_actions_:
        rows.append(("of them without motion", f"{policy.n_zero_actions_:,}"))
    alpha = getattr(policy, "alpha_", np.nan)
    if np.isfinite(alpha):
        rows.append(("weight decay λ", f"{alpha:.3g}"))
    if policy.determined_share_ is not None:
        rows.append(("determined by the recordings", f"{policy.determined_share_:.0%}"))
    if policy.stability_ is not None:
        rows.append(("stabilised", "yes"))
    name = type(policy).__name__
    return format_table((name, "fitted"), rows) + format_sentences(describe_inferred(policy).splitlines())
