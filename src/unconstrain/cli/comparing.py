"""A model fitted with every risk, and what held-out episodes say of each: what `fit` and `diagnose` share."""

from typing import TYPE_CHECKING

from unconstrain.cli import models, reporting
from unconstrain.cli.command import in_words_of_program
from unconstrain.cli.declared import is_given
from unconstrain.progress import working

if TYPE_CHECKING:
    from unconstrain.demonstrations import Demonstrations
    from unconstrain.evaluation import Comparison, Evaluation
    from unconstrain.policies.base import Policy
    from unconstrain.selection import Row


def compare(demos: "Demonstrations", model: models.Model, folds: str | None) -> "Comparison":
    """Fit all risks, and keep the better unless the command line asks for one.

    Parameters
    ----------
    demos : Demonstrations
    model : Model
    folds : "episodes", "blocks", or None
        What is held out.

    Returns
    -------
    Comparison
        Its own policy is the one that is kept.
    """
    from unconstrain.constraints.recorded import describe_known
    from unconstrain.evaluation import compare_risks

    if demos.projections is not None:
        reporting.say(f"constraints: {describe_known(demos.projections)}")
    with working("fitting") as report:

        def progress(row: "Row") -> None:
            report(f"fitted {row.name} in {row.seconds:.1f} s")

        policy = None if model.is_chosen else model.build()
        compared = compare_risks(policy, demos, groups=demos.folds(folds), progress=progress)
    if compared.better is not None and not is_given("risk"):
        return compared.taking(compared.better)
    return compared


def evaluate(
    compared: "Comparison",
    demos: "Demonstrations",
    used: frozenset[str],
    *,
    stable: "Policy | None" = None,
    label: str = "taken",
) -> "Evaluation":
    """Say what held-out episodes tell of the policy that is kept.

    Parameters
    ----------
    compared : Comparison
    demos : Demonstrations
    used : frozenset of str
        Options that made the states what they are; see `Recorded.options_used`.
    stable : Policy, optional
        The policy made to end at its goal.
    label : str
        What becomes of it, for its line of the table.

    Returns
    -------
    Evaluation
    """
    from unconstrain.evaluation import evaluate_held_out

    with working("evaluating") as report:
        return evaluate_held_out(compared, demos, stable=stable, label=label, without=used, progress=report)


def describe(comparison: "Comparison", evaluation: "Evaluation") -> None:
    """Say what was inferred, how all risks predict what was held out, and what that comes to."""
    from unconstrain.evaluation.evaluation import COLUMNS
    from unconstrain.evaluation.verdict import LITTLE
    from unconstrain.policies.inferred import describe_inferred

    policy, better = comparison.policy, comparison.better
    if comparison.chosen is not None:
        reporting.say(str(comparison.chosen))
    left_out = ", left out by the inconsistency" if policy.risk == "inconsistency" else ""
    reporting.say(f"zero actions: {policy.n_zero_actions_} without a direction{left_out}")
    chosen = " (chosen by cross-validation)" if policy.alpha == "cv" else ""
    reporting.say(f"λ: {policy.alpha_:.3g}{chosen}")
    inferred = describe_inferred(policy)
    if inferred:
        reporting.say(in_words_of_program(inferred))
    reporting.say_table(("held out", *COLUMNS[1:]), evaluation.rows())
    if is_given("risk"):
        if better is not None:
            rival = "ordinary regression" if better == "direct" else f"the risk {better}"
            reporting.say(
                f"warning: {rival} is better on what was held out than --risk {policy.risk}, which was asked for; "
                "without --risk the better one is taken"
            )
    elif policy.risk != "adaptive":
        reporting.say(
            f"note: --risk {policy.risk} is better on what was held out, so it is taken; --risk adaptive keeps what "
            "was inferred all the same"
        )
    elif evaluation.regression is not None and evaluation.regression.shown > evaluation.policy.shown + LITTLE:
        reporting.say(
            "note: ordinary regression explains more in all, but not in the middle fold, so --risk adaptive is taken; "
            "--risk direct takes the other"
        )
    for sentence in evaluation.sentences():
        reporting.say(in_words_of_program(sentence))
