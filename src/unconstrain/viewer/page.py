"""The page and its life."""

import atexit
import threading
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from unconstrain.arrays import check_number
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import UnconstrainError
from unconstrain.stopping import Movement
from unconstrain.viewer import camera, exporting, legend, server
from unconstrain.viewer.controls import Controls
from unconstrain.viewer.coordinates import Picked
from unconstrain.viewer.diagnosis import Diagnosis
from unconstrain.viewer.field import HELD, Field
from unconstrain.viewer.following import Follower, Wanted, choose_steps
from unconstrain.viewer.frame import Frame
from unconstrain.viewer.movements import Movements
from unconstrain.viewer.newest import Newest
from unconstrain.viewer.obstacles import BOTH, BOX, Obstacles
from unconstrain.viewer.path import Path
from unconstrain.viewer.stage import Part, Stage
from unconstrain.viewer.start import Start
from unconstrain.viewer.surroundings import Surroundings
from unconstrain.viewer.timeline import Timeline

Array = NDArray[np.float64]


class Page:
    """A page in the browser, as `view` returns it.

    Parameters
    ----------
    stage : Stage
        What is shown.
    demos : Demonstrations, optional
        All recordings, also those that are not shown.
    notes : list of str
        What was guessed or left out, a sentence each.

    Attributes
    ----------
    url : str
        Where it is.
    stage : Stage
        What is shown now: coordinates, frame of the scene, start, and the newest rollout as `movement`.
    """

    def __init__(self, stage: Stage, demos: Demonstrations | None, notes: list[str]) -> None:
        self.stage, self.notes = stage, notes
        self._closed = threading.Event()
        self._state_listeners: list[Callable[[Array], None]] = []
        self._followers = {
            name: Follower(policy, stage.shown.demos.state_names) for name, policy in stage.policies.items()
        }
        self._point: Array | None = None
        self._is_under, self._anywhere = stage.under is not None, False
        self.movements, self.field, self.diagnosis = Movements(), Field(demos), Diagnosis(demos)
        self.surroundings, self.path = Surroundings(), Path(stage)
        self._following = Newest(self._follow, self.report)
        self._drawing = Newest(self._draw, self.report)
        self.obstacles = Obstacles(self.follow)
        self.start = Start(stage, self.drag)
        self.timeline = Timeline(self._at_time)
        self.controls = Controls(self)
        stage.listeners += [self.path.update, self._tell_rollout, self.timeline.set_movement]
        camera.look(stage)
        self.redraw()
        self.follow()
        # Threads that draw when a program ends would complain that the server is gone.
        atexit.register(self.close)

    @property
    def url(self) -> str:
        """Where the page is."""
        host, port = self.stage.server.get_host(), self.stage.server.get_port()
        return f"http://{'localhost' if host in ('127.0.0.1', '0.0.0.0') else host}:{port}"

    def __repr__(self) -> str:
        return f"<page at {self.url}{', closed' if self._closed.is_set() else ''}>"

    def wait(self) -> None:
        """Serve the page until it is closed, or Ctrl-C is pressed, which closes it."""
        try:
            while not self._closed.wait(0.5):
                pass
        except KeyboardInterrupt:
            self.close()

    def close(self) -> None:
        """End the server and all threads."""
        if self._closed.is_set():
            return
        self._closed.set()
        atexit.unregister(self.close)
        self.timeline.close()
        self._following.close()
        self._drawing.close()
        server.stop(self.stage.server)

    def settle(self, timeout: float = 30.0) -> bool:
        """Wait until all that was asked for is drawn.

        Parameters
        ----------
        timeout : float
            Seconds.

        Returns
        -------
        bool
            False after the timeout.
        """
        return self._drawing.settle(timeout) and self._following.settle(timeout)

    def on_state(self, listener: Callable[[Array], None]) -> None:
        """Call a function with the state (n,) at the time of the time line, whenever that changes.

        Parameters
        ----------
        listener : callable
            It may draw what has this state, a robot for example, on `page.stage.server.scene`.
        """
        self._state_listeners.append(listener)
        self.timeline.go_to(self.timeline.time)

    def drag(self, point: Array) -> None:
        """Put the start to a point of the scene; the rollout follows.

        Parameters
        ----------
        point : ndarray of shape (3,)
            In the scene.
        """
        self._point = point
        self._following.give(None)

    def follow(self) -> None:
        """Roll out anew."""
        self._following.give(None)

    def redraw(self) -> None:
        """Draw everything anew, in the background."""
        self._drawing.give(None)

    def show_policy(self, name: str) -> None:
        """Show another of the policies, by name.

        Parameters
        ----------
        name : str
            One of ``page.stage.policies``.
        """
        self.stage.name = name
        self.controls.colours.content = legend.describe_colours(self.stage)
        self.redraw()
        self.follow()

    def show_field(self, arrows: bool, streams: bool) -> None:
        """Show the field as arrows, stream lines, both or not at all.

        Parameters
        ----------
        arrows, streams : bool
            Whether these are shown.
        """
        self.field.shows_arrows, self.field.shows_streams = arrows, streams
        self.controls.arrows.value, self.controls.streams.value = arrows, streams
        self.redraw()

    def show_through(self, through: str) -> None:
        """Say where the arrows stand that are over more states than are shown.

        Parameters
        ----------
        through : str
            `field.RECORDED` or `field.HELD`.
        """
        self.field.through = through
        self.redraw()

    def show_diagnosis(self, visible: bool) -> None:
        """Show what is not determined, which is computed the first time.

        Parameters
        ----------
        visible : bool
            Whether it is shown.
        """
        self.diagnosis.visible = self.controls.unknown.value = visible
        self.controls.diagnosis.visible = visible
        self.controls.diagnosis.content = legend.describe_notes(
            [self.diagnosis.words or "computing what the recordings determine"]
        )
        self.redraw()

    def show_coordinates(self, which: list[int]) -> None:
        """Show other numbers of the states, counted from 0.

        Parameters
        ----------
        which : list of int
            Two or three.
        """
        stage = self.stage
        if isinstance(stage.coordinates, Picked) and stage.coordinates.which == which:
            return
        coordinates = Picked(stage.axes, which)
        self.controls.show_axes(which)
        stage.scenery = (coordinates, Frame.around(coordinates.place(stage.states)))
        for k, slider in enumerate(self.controls.others):
            slider.visible = k not in which
        self.controls.show_side(self.obstacles.side_in_units(stage))
        camera.look(stage)
        self.redraw()
        self.follow()

    def set_seconds(self, seconds: float) -> None:
        """Say how long rollouts last.

        Parameters
        ----------
        seconds : float
            From the start to the end.
        """
        self.stage.seconds = max(check_number(seconds, "seconds", positive=False), 1e-3)
        self.controls.show_seconds(self.stage.seconds)
        self.follow()

    def put_in_the_way(self, chosen: str) -> None:
        """Put a plane, a box, both or nothing in the way of the rollout.

        Parameters
        ----------
        chosen : str
            `obstacles.PLANE`, `BOX`, `BOTH` or `NOTHING`.
        """
        self.controls.obstacles.value = chosen
        self.controls.side.visible = chosen in (BOX, BOTH)
        self.obstacles.choose(chosen, self.stage)

    def resize_box(self, side: float) -> None:
        """Make the box of another side, in the units of what is shown.

        Parameters
        ----------
        side : float
            Of the whole box.
        """
        self.obstacles.resize(side * self.stage.frame.scale)

    def follow_under(self, is_under: bool) -> None:
        """Follow the policy under the constraint that was given, or freely.

        Parameters
        ----------
        is_under : bool
            Whether the constraint holds.
        """
        self._is_under = is_under
        self.follow()

    def lead_anywhere(self, anywhere: bool) -> None:
        """Let rollouts leave what was recorded, or stop them there.

        Parameters
        ----------
        anywhere : bool
            Whether they may lead anywhere.
        """
        self._anywhere = anywhere
        self.follow()

    def move_start(self, k: int, value: float) -> None:
        """Move the start along a number that is not shown.

        Parameters
        ----------
        k : int
            Which, counted from 0.
        value : float
            To where.
        """
        stage = self.stage
        values = stage.axes.values(stage.start[None])[0]
        values[k] = value
        stage.start = stage.axes.state(stage.start, values)
        self.follow()
        if self.field.through == HELD:
            self.redraw()

    def control_time(self, what: str) -> None:
        """Let the time line "play", "pause", or go "to start".

        Parameters
        ----------
        what : str
            "play", "pause" or "to start".
        """
        if what == "play":
            self.timeline.play()
        else:
            self.timeline.pause()
            if what == "to start":
                self.timeline.go_to(0.0)

    def draw_svg(self) -> bytes:
        """Draw the picture with matplotlib.

        Returns
        -------
        bytes
            An SVG file.
        """
        return exporting.svg(self.stage, self.field.sureness(self.stage))

    def _follow(self, _: None) -> None:
        stage = self.stage
        coordinates, frame = stage.scenery
        point, self._point = self._point, None
        if point is not None:
            stage.start = coordinates.put(stage.start, frame.from_scene(point))
        wanted = Wanted(
            stage.start,
            *choose_steps(stage.seconds, stage.interval),
            self.obstacles.barriers(),
            stage.under if self._is_under else None,
            self._anywhere,
        )
        stage.set_movement(self._followers[stage.name].follow(wanted, coordinates, frame))

    def _draw(self, _: None) -> None:
        stage, scenery = self.stage, self.stage.scenery
        # What takes long comes last, and what fails stops nothing else.
        quick: tuple[Part, ...] = (self.surroundings, self.movements, self.path, self.start, self.obstacles)
        for part in (*quick, self.field, self.diagnosis):
            try:
                part.draw(stage)
            except Exception as error:
                if stage.scenery is scenery:  # otherwise it is drawn anew already
                    self.report(error)
        why_not = self.field.sureness(stage).why_not
        if why_not:
            self.say(f"opacity is by distance from recorded states only: {why_not}")
        if self.diagnosis.visible:
            self.controls.diagnosis.content = legend.describe_notes([self.diagnosis.words])

    def _tell_rollout(self, movement: Movement) -> None:
        self.controls.ending.content = legend.describe_rollout(movement, self.stage)

    def _at_time(self, seconds: float, state: Array) -> None:
        self.path.mark(state)
        self.controls.time.value = min(seconds, self.controls.time.max)
        for listener in self._state_listeners:
            try:
                listener(state)
            except Exception as error:  # it is not ours, and the time line goes on
                self.report(error)

    def say(self, note: str) -> None:
        """Say something on the page, once.

        Parameters
        ----------
        note : str
            A sentence.
        """
        if note not in self.notes:
            self.notes.append(note)
            self.controls.notes.visible = True
            self.controls.notes.content = legend.describe_notes(self.notes)

    def report(self, error: Exception) -> None:
        """Say on the page what failed.

        Parameters
        ----------
        error : Exception
            A mistake of the user's, which is a sentence, or of ours.
        """
        told = isinstance(error, UnconstrainError)
        self.say(str(error) if told else f"something failed, {type(error).__name__}: {error}")
