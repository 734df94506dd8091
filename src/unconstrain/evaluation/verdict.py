"""What an evaluation comes to, in one sentence: is a constraint there, what explains the motion, is it safe to move."""

import math
from dataclasses import dataclass

from unconstrain.evaluation.findings import KNOWN, WELL, Findings

BARELY = 0.5
"""Share explained of what was held out; with less, too much is left that looks like anything."""

LITTLE = 0.01
"""A difference in what is explained that is not worth a word."""

FEWEST = 20
"""Samples, of which fewer tell nothing."""

DETERMINED = 0.9
"""Share of the policy that recordings have to determine, or else the rest is named."""

LONGEST_EQUATIONS = 120
"""Characters of equations that a sentence can hold; of more, their number is said."""


@dataclass(frozen=True)
class Verdict:
    """What findings come to.

    Parameters
    ----------
    is_safe : bool
        Whether nothing found speaks against letting it move a robot, slowly and watched.
    is_of_use : bool
        Whether it explains more than half of what is shown: in simulation it is worth a look.
    sentence : str
        Why, and what to do.
    """

    is_safe: bool
    is_of_use: bool
    sentence: str

    def __str__(self) -> str:
        return self.sentence


def conclude(found: Findings) -> Verdict:
    """Conclude from findings whether a policy is fit to be used.

    Parameters
    ----------
    found : Findings
        Of one policy.

    Returns
    -------
    Verdict
        One sentence, of clauses: use it or not, constraints, what explains the motion, what is not determined, where it
        leads.
    """
    if math.isnan(found.explained):
        return Verdict(False, False, "nothing moves in these recordings, so they say nothing of a policy")
    against = _list_objections(found)
    explained, constraints = _describe_explained(found), _describe_constraints(found)
    not_followed = _describe_not_followed(found)
    if against:
        head = "not for a robot yet: "
        clauses = [*against, constraints] if found.explained < WELL else [*against, constraints, explained]
    elif not_followed:
        head = "nothing found speaks against a robot, but "
        clauses = [not_followed, constraints, explained]
    else:
        head = "safe to try on a robot, slowly: "
        clauses = [constraints, explained, _describe_following(found)]
    if found.fixed:
        clauses.append(_describe_fixed(found))
    sentence = head + "; ".join(clause for clause in clauses if clause)
    return Verdict(not (against or not_followed), max(found.explained, found.typical) >= BARELY, sentence)


def _list_objections(found: Findings) -> list[str]:
    against = []
    if found.n_samples < FEWEST:
        against.append(f"{found.n_samples} samples are too few to judge by")
    if found.explained < WELL:
        against.append(_describe_missing(found))
    # What a constraint that never varies hides is said by itself.
    open_to_see = 1 - len(found.fixed) / found.n_actions
    if found.determined is not None and found.determined < DETERMINED * open_to_see:
        against.append(
            f"{1 - found.determined:.0%} of the policy is not determined by what it was learnt from (`unconstrain "
            "diagnose` says where, and what to record next)"
        )
    if found.goal_distance > 1:
        against.append("its goal lies outside of what was recorded")
    following = found.following
    if following is not None and following.n_stopped:
        where = (
            f"from {following.n_stopped} of {following.n_starts} recorded starts it leaves what was recorded, first "
            f"after {following.first:.2g} s"
        )
        against.append(f"{where} ({found.remedy})" if found.remedy else where)
    return against


def _describe_missing(found: Findings) -> str:
    explained, missing = _describe_explained(found), found.missing
    if found.typical >= WELL:
        return (
            f"{explained}, but {found.typical:.1%} of the middle one: some episodes go where no other went, and there "
            "it is of no use until more is recorded"
        )
    if missing is not None:
        return (
            f"{explained}, and fitted to them with {missing.meaning} it would be some {missing.explained:.0%} "
            f"(`fit {missing.option}`)"
        )
    if found.tried:
        best: dict[str, float] = {}
        for each in found.tried:
            best[each.meaning] = max(each.explained, best.get(each.meaning, 0.0))
        names = ", ".join(f"{meaning} {share:.0%}" for meaning, share in best.items())
        return (
            f"{explained}, and nothing tried instead explains it ({names}), so a state is missing, or the model is too "
            "coarse"
        )
    return explained


def _describe_constraints(found: Findings) -> str:
    if found.known >= KNOWN:
        return f"what was in the way is known of {found.known:.0%} of the samples"
    if found.in_doubt:
        if found.explained < BARELY:
            return ""  # what is not explained at all looks like anything
        return "no varying constraint was found, nor ruled out: some samples look constrained"
    if found.free is None:
        return (
            "it is ordinary regression, right only if nothing was in the way"
            if found.is_regression
            else "every sample was taken for constrained"
        )
    if found.is_regression or found.free > 1 - LITTLE / 2:
        return "no varying constraint was found"
    return f"a varying constraint seems to have bent {1 - found.free:.0%} of the samples"


def _describe_fixed(found: Findings) -> str:
    equations = " and ".join(found.fixed)
    if len(equations) <= LONGEST_EQUATIONS:
        return f"all motion obeys {equations}, so nothing is known of the policy across that"
    return (
        f"nothing moves along {len(found.fixed)} of {found.n_actions} directions (`unconstrain constraints` names "
        "them), so nothing is known of the policy there"
    )


def _describe_explained(found: Findings) -> str:
    gain = found.explained - found.regression
    by = f"it explains {max(found.explained, 0.0):.1%} of what {found.held_out} show"
    if found.explained <= LITTLE:
        by = f"it explains no more of what {found.held_out} show than standing still"
    if found.is_regression or math.isnan(gain):
        return by
    if abs(gain) < LITTLE:
        return f"{by}, as does ordinary regression"
    other = " (`fit --risk direct`)" if gain < 0 else ""
    return f"{by}, where ordinary regression{other} explains {max(found.regression, 0.0):.1%}"


def _describe_not_followed(found: Findings) -> str:
    if found.following is not None:
        return ""
    if found.known >= KNOWN:
        return "it was not followed, as it moves under the constraint that is known (`rollout --constraint`)"
    if not found.is_kinematic:
        return "it was not followed, as actions are not velocities of the states"
    if not found.has_time:
        return "it was not followed, as the recordings have no time"
    return "it was not followed, as the recordings are too short"


def _describe_following(found: Findings) -> str:
    following = found.following
    assert following is not None
    starts = "the recorded start" if following.n_starts == 1 else f"{following.n_starts} recorded starts"
    return f"from {starts} it stays near what was recorded, as long as that took"
