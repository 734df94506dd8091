"""Risk "adaptive" beside the other two and beside what is told all projections, on everything there is data of."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console

from reproduction.adaptive import figures, tables
from reproduction.adaptive.bound import is_free
from reproduction.adaptive.closed import CLOSED
from reproduction.adaptive.intervals import INTERVALS
from reproduction.adaptive.judgement import DETERMINED, EXACT
from reproduction.adaptive.recorded import RECORDED, find_missing, list_files
from reproduction.adaptive.settings import Part, Result
from reproduction.adaptive.simulated import LITTLE_NOISE, NOISE_STREAM, SIMULATED, draw_noise
from reproduction.adaptive.ways import ADAPTIVE, LEAST_NOISE, add_noise, learn, list_ways, probably_free
from reproduction.constraints.measured import make_grasp_model, record_grasps
from reproduction.outcome import Outcome, make_folder, write_figures, write_results
from reproduction.trials import run_trials
from unconstrain.errors import UnconstrainError
from unconstrain.robots import import_mujoco

PARTS: dict[str, Part] = {**SIMULATED, **INTERVALS, **CLOSED, **RECORDED}
"""By name, in the order of the report."""

CYCLES = ("cycle", "cycle400")
"""Parts of the limit cycle, which have a figure each."""

NEEDED = "give the folder of recordings as --data"

CHOICES = (
    "Noise is Gaussian and independent in every component of the recorded actions, of the same standard deviation: the "
    "share named, of the root mean square over all components of all clean actions learnt from. It is noise of "
    "observation: states are clean, and so are the data tested on.",
    "Told: the same model and the same noisy data, by inconsistency with the true projection of every sample known, "
    "N = I for free ones.",
    "Bound: Cramér and Rao's, for the features of the model and clean actions. A constrained sample whose projection "
    "is not known informs by (‖u‖²/‖π‖²) û ûᵀ/σ², a free one by I/σ², one that is told by N/σ². The prior variance is "
    "the most probable one of the true policy's parameters, seen through the same noise. Without noise the bound is "
    f"that of {LEAST_NOISE:.1%} noise. Local models are taken one by one. In physics σ is what recorded actions differ "
    "from N π by.",
    "“told + bound” is told's error with its part from noise exchanged for that of the bound: what can be hoped for "
    "where the model's misfit is larger than the noise, of which the bound knows nothing.",
    f"The projections determine a policy where they do {DETERMINED:.0%} of its directions (`identifiability`); errors "
    f"below {EXACT:g} count as none.",
    "Limit cycle: each third of a movement is free with the probability named; tested on 40 other movements, made "
    "likewise.",
    "λ is chosen for every way by its own held-out risk, five folds of episodes, also on the arm, where Table I holds "
    "out samples.",
    "Intervals: components of the true action within ±1.645 standard deviations of the prediction, at the states "
    "tested on; the arm's are samples held out of the same movements.",
    f"Noise of data set k has the stream (k, {NOISE_STREAM}), the same numbers at every level of noise.",
    "Recordings: where nothing constrains, ordinary regression is what is told everything, so there is no column for "
    "it. Demonstrations of handwriting are dealt out at random, the same way for every shape in a trial. Held-out "
    "log-likelihood takes samples one by one, and for every way the noise, spread of speed and free share that are "
    "likeliest on what was learnt from.",
)


def reproduce(
    out: Path,
    *,
    trials: int | None = None,
    jobs: int = 1,
    console: Console,
    data: Path | None = None,
    part: str | None = None,
) -> Outcome:
    """Run the parts, and write tables, figures and the JSON of all trials into `out`.

    Parameters
    ----------
    out : Path
        The folder to write into. Finished trials are kept there.
    trials : int, optional
        Data sets of each part, by default ten; of recordings no more than there are splits.
    jobs : int
        Processes.
    console : Console
        Where progress is shown.
    data : Path, optional
        The folder of recordings. Parts that need it are left out without, and that is said.
    part : str, optional
        The only part to run.

    Returns
    -------
    Outcome
        With the tables as Markdown.

    Raises
    ------
    UnconstrainError
        If there is no such part or folder, or the only part lacks what it needs.
    """
    if part is not None and part not in PARTS:
        raise UnconstrainError(f"there is no part {part!r}: choose one of {', '.join(PARTS)}")
    if data is not None and not data.is_dir():
        raise UnconstrainError(f"there is no folder {data}: {NEEDED}")
    reasons = {name: _find_lack(name, data) for name in PARTS if part in (None, name)}
    if part is not None and reasons[part] is not None:
        raise UnconstrainError(f"the part {part!r} cannot be run: {reasons[part]}")
    make_folder(out)
    ways = list_ways()
    results: dict[str, list[Result]] = {}
    findings = []
    for name, reason in reasons.items():
        if reason is None:
            results[name] = _run_part(name, ways, out, trials, jobs, console, data)
        else:
            findings.append(f"{PARTS[name].title} is left out: {reason}.")
    if ADAPTIVE not in ways:
        findings.append(f'This version of the library has no risk "{ADAPTIVE}": its column is left out.')
    written = [tables.write_part(PARTS[name], trials_of) for name, trials_of in results.items()]
    table = "\n".join(written)
    shown, drawn = write_figures(out, _draw(results, ways))
    kept = {
        name: {"ways": PARTS[name].ways or ways, "trials": trials_of} for name, trials_of in results.items()
    }
    return Outcome(
        title="Which samples were free, inferred",
        table=table,
        figures=shown,
        choices=CHOICES,
        findings=(*tables.list_findings(PARTS, results), *findings),
        files=(*write_results(out, kept, table), *drawn),
    )


def _find_lack(name: str, data: Path | None) -> str | None:
    """Say what a part needs that is not here, if anything."""
    needs = PARTS[name].needs
    if needs == "data":
        return NEEDED if data is None else find_missing(name, data)
    if needs == "sim":
        try:
            import_mujoco()
        except UnconstrainError as error:
            return str(error)
    return None


def _run_part(
    name: str,
    ways: tuple[str, ...],
    out: Path,
    trials: int | None,
    jobs: int,
    console: Console,
    data: Path | None,
) -> list[Result]:
    part = PARTS[name]
    ways = part.ways or ways
    most = part.trials
    count = most if trials is None else min(trials, most) if part.fixed else trials
    settings: dict[str, Any] = {"experiment": "adaptive", "part": name, "ways": ways, **part.settings}
    if part.needs == "data" and data is not None:
        # Not where they are: which there are.
        settings["files"] = [path.name for path in list_files(name, data)]
    return run_trials(
        partial(part.run, ways, data),
        count,
        out / f"{name}.jsonl",
        settings=settings,
        jobs=jobs,
        console=console,
        label=f"adaptive, {name}",
    )


def _draw(results: dict[str, list[Result]], ways: Sequence[str]) -> dict[str, Any]:
    drawn = {
        name: (
            figures.plot_cycle(results[name]),
            f"{PARTS[name].title}: mean nUPE over {len(results[name])} data sets against noise, by the share of free "
            "segments; and the Cramér-Rao bound without projections.",
        )
        for name in CYCLES
        if name in results
    }
    if "grasp" in results and ADAPTIVE in ways:
        clean, _ = record_grasps(0)
        noise = LITTLE_NOISE[-1]
        noisy, _ = add_noise(clean, noise, draw_noise(0))
        learnt = learn(make_grasp_model(), ADAPTIVE, noisy)
        assert clean.projections is not None
        figure = figures.plot_contact(clean, is_free(clean.projections), probably_free(learnt, noisy))
        drawn["contact"] = (
            figure,
            f"The ten grasps of data set 0, {100 * noise:g} % noise. Left: the ways of both hands from above, coloured "
            "alike, since a sample is constrained if the barrier blocks either. Right: the same over time, a pair of "
            "bars for each grasp.",
        )
    return drawn
