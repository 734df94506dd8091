"""`unconstrain evaluate`: a policy against recordings it has not seen."""

from pathlib import Path

import click

from unconstrain.cli import recordings, reporting
from unconstrain.cli.command import command
from unconstrain.errors import DataError
from unconstrain.progress import working

SHOWN_EPISODES = 20


@command(epilog="For example:\n\n\b\nunconstrain evaluate wipe.skops other_day.csv")
@click.argument("policy", type=click.Path(path_type=Path))
@recordings.recorded
def evaluate(policy: Path, recorded: recordings.Recorded) -> None:
    """Hold a saved policy against other recordings.

    POLICY was saved by `unconstrain fit`, and FILES are read as those it was learnt from, unless an option says
    otherwise; --state names all columns anew.
    """
    import numpy as np

    from unconstrain import metrics
    from unconstrain.policies import load_policy

    learnt = load_policy(policy)
    with working("reading"):
        demos = recorded.like(getattr(learnt, "recording_", None)).load()
    recordings.describe(demos)
    if demos.states.shape[1] != learnt.n_features_in_ or demos.actions.shape[1] != learnt.n_actions_:
        raise DataError(
            f"{policy} maps {learnt.n_features_in_} states to {learnt.n_actions_} actions, but the recordings have "
            f"{demos.states.shape[1]} and {demos.actions.shape[1]}: choose the columns it was learnt from"
        )
    P = learnt.predict(demos.states).reshape(demos.actions.shape)

    def row(label: str, which: np.ndarray | slice) -> tuple[str, ...]:
        U = demos.actions[which]
        share = f"{metrics.explained(U, P[which]):.2%}" if np.any(U) else "nothing moves"
        return label, str(len(U)), f"{metrics.inconsistency(U, P[which]):.4g}", share

    rows = []
    if demos.n_episodes > 1:
        labels = demos.episode_labels[:SHOWN_EPISODES]
        rows = [row(label, demos.episodes == code) for code, label in enumerate(labels)]
        if demos.n_episodes > len(rows):
            rows.append((f"... {demos.n_episodes - len(rows)} more", "", "", ""))
    rows.append(row("all", slice(None)))
    reporting.say_table(("episode", "samples", "inconsistency", "share of observed motion explained"), rows)
    if demos.policy is not None:
        error = metrics.normalized(metrics.unconstrained_policy_error(demos.policy, P), demos.policy)
        reporting.say(f"these recordings carry the true policy: nUPE {error:.4g}")
