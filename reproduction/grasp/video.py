"""The video: expert, learnt and direct policy carry the robot to the ball, side by side."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pictures
from PIL import ImageDraw, ImageFont

from reproduction.grasp.figures import (
    LABELS,
    UNSEEN_ASIDE,
    make_unseen_gap,
    place_camera,
    record_from_home,
    stage,
)
from reproduction.plants.barrier import Barrier
from reproduction.plants.grasping import FREQUENCY, Demonstrator
from reproduction.plants.scene import show
from unconstrain import atomic
from unconstrain.errors import UnconstrainError
from unconstrain.simulation import Policy

Image = NDArray[np.uint8]

PANEL, MARGIN = 480, 48
"""Side of each picture and height of the text above and below, in pixels; multiples of 16, as the coder wants."""

FRAME_RATE = 25
DURATION, HOLD = 3.0, 1.0
"""Seconds of movement, and of its last picture, in each part."""


def render_frames(demonstrator: Demonstrator, policies: dict[str, Policy]) -> Iterator[Image]:
    """Render the video's pictures: first free, then through a gap never trained on.

    `policies` go by the names of `LABELS`.
    """
    model = stage(demonstrator)
    parts: list[tuple[str, Barrier | None]] = [
        ("nothing in the way", None),
        (
            f"a gap never trained on: moved aside by {100 * UNSEEN_ASIDE:.0f} cm",
            make_unseen_gap(demonstrator),
        ),
    ]
    every = round(FREQUENCY / FRAME_RATE)
    with place_camera(demonstrator, model, PANEL, PANEL) as view:
        for title, obstacle in parts:
            ways = {
                name: record_from_home(demonstrator, policy, obstacle, DURATION).postures[0, ::every]
                for name, policy in policies.items()
            }
            show(model, obstacle)
            length = len(next(iter(ways.values())))
            for k in range(length):
                panels = [view.picture(postures[k]) for postures in ways.values()]
                time = f"{title}   {k / FRAME_RATE:.1f} s"
                picture = _add_captions(np.hstack(panels), [LABELS[name] for name in ways], time)
                yield picture
            for _ in range(round(HOLD * FRAME_RATE)):
                yield picture


def check_video(path: str | os.PathLike[str]) -> None:
    """Find out whether a video can be written, before there is one.

    Parameters
    ----------
    path : str or path
        Of the file to be.

    Raises
    ------
    UnconstrainError
        If the name does not end in .mp4, its folder is missing, or imageio is not installed.
    """
    path = Path(path)
    if path.suffix.lower() != ".mp4":
        raise UnconstrainError(f"a video cannot be written to {path.name!r}: end the name in .mp4")
    if not path.absolute().parent.is_dir():
        raise UnconstrainError(f"a video cannot be written to {path}: there is no folder {path.parent}")
    try:
        import imageio.v2  # noqa: F401
        from imageio_ffmpeg import get_ffmpeg_exe

        get_ffmpeg_exe()
    except (ImportError, RuntimeError) as error:
        raise UnconstrainError(
            f"videos are written by imageio and its ffmpeg, which cannot be imported here ({error}): "
            "pip install 'unconstrain[sim]'"
        ) from error


def write_video(
    path: str | os.PathLike[str], demonstrator: Demonstrator, policies: dict[str, Policy]
) -> Path:
    """Write the video to an .mp4 file, whole or not at all, and return its path.

    Raises
    ------
    UnconstrainError
        As `check_video` does, or if there is no OpenGL.
    """
    path = Path(path)
    check_video(path)
    import imageio.v2

    get_writer: Any = imageio.v2.get_writer  # what it returns depends on the format
    pictures = render_frames(demonstrator, policies)
    first = next(pictures)  # before any file is begun, so that a lack of OpenGL leaves none
    with (
        atomic.replacing(path) as temporary,
        get_writer(temporary, fps=FRAME_RATE, codec="libx264", quality=7, macro_block_size=16) as video,
    ):
        video.append_data(first)
        for picture in pictures:
            video.append_data(picture)
    return path


def _add_captions(panels: Image, labels: list[str], caption: str) -> Image:
    """Write a label above each of the panels (PANEL, S PANEL, 3), and one caption below."""
    height, width = panels.shape[:2]
    page = Pictures.new("RGB", (width, height + 2 * MARGIN), "white")
    page.paste(Pictures.fromarray(panels), (0, MARGIN))
    draw = ImageDraw.Draw(page)
    font = ImageFont.truetype(str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"), 20)
    for i, label in enumerate(labels):
        draw.text(((i + 0.5) * width / len(labels), MARGIN / 2), label, fill="black", font=font, anchor="mm")
    draw.text((width / 2, height + 1.5 * MARGIN), caption, fill="black", font=font, anchor="mm")
    return np.asarray(page)
