"""What the page of the grasp says, and what changes it: the barrier, the policy, and how the robot goes on."""

from typing import TYPE_CHECKING, Any

from reproduction.grasp.interaction import GAP, MIDDLE, NOTHING, InTheWay
from reproduction.plants.grasping import FREQUENCY
from unconstrain.viewer import legend, palette

if TYPE_CHECKING:
    from reproduction.grasp.page import GraspPage

WIDEST, FARTHEST = 0.6, 0.25
"""Of the sliders, in metres."""

KNOWN = {
    GAP: "Training gaps are in the middle, 5 to 45 cm wide as a rule.",
    NOTHING: "Nothing is in the way.",
}
NEVER = "No training barrier is like this: {}."
REASONS = {GAP: "the gap is moved aside", MIDDLE: "it has to be reached around"}

IN_TIME = 0.97
"""A share of the steps from which on the robot moves in real time, as far as one sees."""

ASIDE = 0.005
"""A gap that is moved by less (m) is in the middle."""


class Panel:
    """Sliders, buttons and words.

    Parameters
    ----------
    page : GraspPage
        What they change.
    """

    def __init__(self, page: "GraspPage") -> None:
        gui, way = page.server.gui, page.interaction.in_the_way
        self.state = gui.add_html("")
        rows = [
            (palette.PATH, "where the hands went"),
            (palette.LEARNT, "where they will go, if the body can follow"),
            (palette.HELD, "where the barrier will hold them"),
        ]
        gui.add_html(
            legend.TEXT.format("".join(legend.BOX.format(colour=c, words=words) for c, words in rows))
        )
        with gui.add_folder("In the way"):
            self.kind = gui.add_dropdown("What", (GAP, MIDDLE, NOTHING), initial_value=way.kind)
            self.width = gui.add_slider("Width (m)", 0.0, WIDEST, 0.01, way.width)
            self.aside = gui.add_slider("Aside (m)", -FARTHEST, FARTHEST, 0.01, way.aside)
            self.note = gui.add_html("")
        with gui.add_folder("Robot"):
            names = tuple(page.interaction.policies)
            self.policy = gui.add_dropdown("Led by", names, initial_value=names[0], visible=len(names) > 1)
            self.pause = gui.add_checkbox("Pause", False)
            self.anew = gui.add_checkbox("Start anew once it rests", page.starts_anew)
            self.restart = gui.add_button("Start anew")

        def change(event: Any, name: str, of: Any) -> None:
            if event.client is not None:  # not when a handle, or the program, moved it
                page.change(**{name: of.value})

        self.kind.on_update(lambda event: change(event, "kind", self.kind))
        self.width.on_update(lambda event: change(event, "width", self.width))
        self.aside.on_update(lambda event: change(event, "aside", self.aside))
        self.policy.on_update(lambda event: page.lead(self.policy.value))
        self.pause.on_update(lambda event: setattr(page, "is_paused", self.pause.value))
        self.anew.on_update(lambda event: setattr(page, "starts_anew", self.anew.value))
        self.restart.on_click(lambda event: page.restart())

    def show_obstacle(self, way: InTheWay) -> None:
        """Show what is in the way now."""
        self.kind.value = way.kind
        for slider, value in ((self.width, way.width), (self.aside, way.aside)):
            slider.value = min(max(round(value, 3), slider.min), slider.max)
            slider.disabled = way.kind == NOTHING
        never = way.kind == MIDDLE or (way.kind == GAP and abs(way.aside) > ASIDE)
        said = NEVER.format(REASONS[way.kind]) if never else KNOWN[way.kind]
        self.note.content = legend.TEXT.format(said)

    def show_state(self, page: "GraspPage") -> None:
        """Say how far the robot is, and how fast it is shown."""
        robot = page.interaction
        share = page.rate / FREQUENCY
        pace = "real time" if share > IN_TIME else f"{share:.2f} of real time"
        held = [side for side, is_held in zip(("left", "right"), robot.held, strict=True) if is_held]
        said = [
            f"{page.rate:.0f} steps a second: {pace}.",
            f"{robot.seconds:.1f} s since the start; hands {100 * robot.to_go:.0f} cm from where they grasp.",
        ]
        if held:
            said.append(f"The barrier holds the {' and the '.join(held)} hand.")
        self.state.content = legend.TEXT.format("<br>".join(said))
