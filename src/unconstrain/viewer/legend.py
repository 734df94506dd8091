"""What the page says in words: the legend, what was guessed or left out, and how the rollout ended."""

import re
from html import escape

from unconstrain.stopping import Movement, describe_stop
from unconstrain.viewer import palette
from unconstrain.viewer.following import USUAL, choose_steps, is_held
from unconstrain.viewer.stage import DIRECT, Stage

ANYWHERE = "May leave what was recorded"

BOX = (
    '<span style="display:inline-block;width:0.9em;height:0.9em;border-radius:2px;vertical-align:-0.1em;'
    'background:{colour}"></span> {words}<br>'
)
TEXT = '<div style="font-size:0.8rem;line-height:1.45;padding:0.2rem 0.9rem;overflow-wrap:anywhere">{}</div>'


def describe_colours(stage: Stage) -> str:
    """Say what each colour stands for.

    Parameters
    ----------
    stage : Stage
        What is shown.

    Returns
    -------
    str
        HTML.
    """
    if stage.shown.free is None:
        rows = [(palette.RECORDED, f"recorded (contact {stage.shown.source})")]
    else:
        rows = [
            (palette.FREE, f"recorded, free (contact {stage.shown.source})"),
            (palette.CONSTRAINED, "recorded, constrained; blends are between"),
        ]
    direct = stage.name == DIRECT
    rows += [
        (palette.DIRECT if direct else palette.LEARNT, f"{stage.name}; fainter where it is less sure"),
        (palette.PATH, "rollout from the start that you drag"),
        (palette.HELD, "rollout where something is in its way"),
    ]
    return TEXT.format("".join(BOX.format(colour=colour, words=escape(words)) for colour, words in rows))


def describe_rollout(movement: Movement, stage: Stage) -> str:
    """Say where a rollout leads, and why it ended.

    Parameters
    ----------
    movement : Movement
        One.
    stage : Stage
        What it is a rollout of.

    Returns
    -------
    str
        HTML.
    """
    steps, wanted = choose_steps(stage.seconds, stage.interval)
    dt = 0.0 if movement.time is None or len(movement) < 2 else float(movement.time[1] - movement.time[0])
    end = ", ".join(
        f"{name} {value:.4g}" for name, value in zip(movement.state_names, movement.states[-1], strict=True)
    )
    said = [f"{len(movement) - 1} steps of {dt:.3g} s; then {end}."]
    if wanted > 1.01 * min(stage.interval, USUAL):
        said.append(
            "These are coarser than is usual, so that they can be followed; shorter rollouts have finer ones."
        )
    held = is_held(movement).mean()
    if held:
        said.append(f"Something was in the way of {held:.0%} of it.")
    if movement.stopped:
        told = describe_stop(movement.stopped[0], steps, movement.state_names)
        # What allows it is an argument elsewhere, and a checkbox here.
        told = re.sub(r"; say with beyond=.*", f'; "{ANYWHERE}" lets it go on', told)
        said.append(sentence(told))
    return TEXT.format(escape(" ".join(said), quote=False))


def describe_notes(notes: list[str]) -> str:
    """Write sentences as HTML."""
    return TEXT.format("<br>".join(escape(sentence(note), quote=False) for note in notes))


def sentence(text: str) -> str:
    """Begin a text with a capital letter, and end it with a point."""
    whole = text[:1].upper() + text[1:]
    return whole if whole.endswith((".", "!", "?")) else f"{whole}."
