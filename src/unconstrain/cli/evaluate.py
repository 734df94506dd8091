"""`unconstrain evaluate`: a policy against recordings it has not seen."""

from pathlib import Path

import click

from unconstrain.cli import constraining, outputs, recordings, reporting, trusting
from unconstrain.cli.command import command, in_words_of_program
from unconstrain.progress import working

SHOWN_EPISODES = 20


@command(epilog="For example:\n\n\b\nunconstrain evaluate wipe.skops other_day.csv")
@click.argument("policy", type=click.Path(path_type=Path))
@recordings.recorded
@constraining.constraint
@trusting.trusted
@outputs.figure("Draw the policy over these recordings, and the contact it infers in them")
@outputs.overwrite
def evaluate(
    policy: Path,
    recorded: recordings.Recorded,
    constraint: Path | None,
    trusted: tuple[str, ...],
    figure: Path | None,
    overwrite: bool,
) -> None:
    """Hold a saved policy against other recordings.

    POLICY was saved by `unconstrain fit`, and FILES are read as those it was learnt from, unless an option says
    otherwise; --state names all columns anew. Where something was in the way even the true policy differs from the
    recorded action: what is shown is the whole action of free samples, and the motion of others.
    """
    read: list[str | Path] = [policy, *recorded.files, *([] if constraint is None else [constraint])]
    outputs.check_outputs(read, {"figure": figure}, overwrite=overwrite)
    from unconstrain.evaluation import evaluate as hold_against
    from unconstrain.evaluation.evaluation import COLUMNS
    from unconstrain.policies.inferred import describe_inferred

    learnt = trusting.load(policy, trusted)
    with working("reading"):
        recorded = recorded.like(getattr(learnt, "recording_", None))
        demos = constraining.tell(recorded.load(), constraint)
    recordings.describe(demos)
    recorded.check_names(learnt, demos)
    with working("evaluating") as report:
        found = hold_against(
            learnt,
            demos,
            most_episodes=SHOWN_EPISODES,
            without=recorded.options_used,
            progress=report,
        )
    if figure is not None:
        from unconstrain import plot
        from unconstrain.plot import figures

        plot.save(figures.draw_policy(learnt, demos), figure)
    learnt_from = describe_inferred(learnt)
    if learnt_from:
        reporting.say(in_words_of_program(f"of the recordings it was learnt from,\n{learnt_from}"))
    reporting.say_table(("on these recordings", *COLUMNS[1:]), found.rows())
    for sentence in found.sentences():
        reporting.say(in_words_of_program(sentence))
    if figure is not None:
        reporting.say(f"figure: {figure}")
