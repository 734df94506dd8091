"""The page of the grasp in a real browser: it is drawn, and its slider, number box and handle move the barrier."""

import shutil
import threading
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco")
pytest.importorskip("mink")
pytest.importorskip("viser")
pytest.importorskip("playwright")

from playwright.sync_api import sync_playwright

from reproduction.grasp.interaction import NOTHING
from reproduction.grasp.page import GraspPage
from reproduction.grasp.trial import learn, make_demonstrator, record_training
from reproduction.plants.robot_choice import OUR_OWN

CHROMIUM = shutil.which("chromium")
QUIET = ["--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run"]
DRAWING = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
SHOTS = Path(__file__).parents[2] / "out" / "screenshots"


@pytest.fixture
def grasp():
    demonstrator = make_demonstrator(OUR_OWN)
    recording, _ = record_training(demonstrator, 0, n=40, duration=1.0)
    learnt, _ = learn(recording.demonstrations, "inconsistency")
    page = GraspPage(demonstrator, {"learnt": learnt, "true policy": demonstrator.policy}, port=0)
    loop = threading.Thread(target=page.run, daemon=True)
    loop.start()
    yield page
    page.close()
    loop.join(timeout=5)


@pytest.fixture
def browser():
    if CHROMIUM is None:
        pytest.skip("no chromium")
    with sync_playwright() as play:
        opened = play.chromium.launch(
            executable_path=CHROMIUM, args=["--headless", "--no-sandbox", *DRAWING, *QUIET]
        )
        yield opened
        opened.close()


def wait_for(condition, seconds=10.0):
    until = time.monotonic() + seconds
    while not condition() and time.monotonic() < until:
        time.sleep(0.05)
    return condition()


def pixel(camera, point, width, height):
    """Return where a point of the scene is on the screen."""
    w, x, y, z = camera.wxyz
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    right, down, ahead = (np.asarray(point) - camera.position) @ turn
    focal = height / 2 / np.tan(camera.fov / 2)
    return width / 2 + focal * right / ahead, height / 2 + focal * down / ahead


def test_the_page_in_a_browser(grasp, browser):
    width, height = 1000, 640
    page = browser.new_page(viewport={"width": width, "height": height})
    errors, requests = [], []
    page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
    page.on("request", lambda request: requests.append(request.url))
    page.goto(grasp.url)
    page.wait_for_selector("canvas")
    page.get_by_text("Start anew once it rests").wait_for()
    assert wait_for(lambda: len(grasp.server.get_clients()) == 1)
    before = grasp.interaction.seconds
    assert wait_for(lambda: grasp.interaction.seconds > before, 5), "the robot moves"
    assert wait_for(lambda: "steps a second" in page.inner_text("body"))
    grasp.is_paused = True  # software draws a robot that moves so slowly that all else waits

    def find_ball():
        from io import BytesIO

        from PIL import Image

        image = np.asarray(Image.open(BytesIO(page.screenshot())).convert("RGB")).reshape(-1, 3).astype(int)
        red, green, blue = image.T
        return np.count_nonzero((red > 200) & (green > 90) & (green < 190) & (blue < 110))

    assert wait_for(lambda: find_ball() > 500), "the ball is orange, and in the picture"

    box = page.locator("input[inputmode=decimal]").nth(1)
    box.fill("0.1")
    box.press("Enter")
    assert wait_for(lambda: abs(grasp.interaction.in_the_way.aside - 0.1) < 1e-9)
    page.get_by_text("No training barrier is like this").wait_for()

    camera = next(iter(grasp.server.get_clients().values())).camera
    handle = np.array(grasp.barrier.handles["aside"].position)
    x, y = pixel(camera, handle + np.array([0, 0.06, 0]), width, height)
    to_x, to_y = pixel(camera, handle + np.array([0, -0.04, 0]), width, height)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move((x + to_x) / 2, (y + to_y) / 2)
    page.mouse.move(to_x, to_y, steps=2)
    page.mouse.up()
    assert wait_for(lambda: abs(grasp.interaction.in_the_way.aside) < 0.03), (
        "the handle is dragged to the right"
    )

    page.evaluate(
        "document.querySelectorAll('.mantine-Notification-closeButton').forEach(each => each.click())"
    )
    grasp.change(width=0.3, aside=0.1)
    grasp.restart()
    assert wait_for(lambda: grasp.interaction.seconds == 0)
    grasp.is_paused = False
    assert wait_for(lambda: grasp.interaction.seconds > 1.4)
    grasp.is_paused = True
    SHOTS.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=SHOTS / "grasp_page.png")
    grasp.change(kind=NOTHING)
    assert wait_for(lambda: not grasp.barrier.boxes[0].visible)
    assert errors == []
    assert all(url.startswith((grasp.url, "ws://localhost", "data:", "blob:")) for url in requests)
