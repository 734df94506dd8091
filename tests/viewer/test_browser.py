"""The page in a real browser: drawn, dragged with a mouse, and nothing fetched from elsewhere."""

import shutil
import time
from pathlib import Path

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.viewer import controls
from unconstrain.viewer.obstacles import PLANE

SCREENSHOTS = Path(__file__).parents[2] / "out" / "screenshots"
CHROMIUM = shutil.which("chromium")
SIZE = {"width": 1300, "height": 800}
ARGUMENTS = (
    "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist", "--disable-background-networking", "--disable-component-update",
    "--disable-sync", "--no-first-run",
)  # fmt: skip


@pytest.fixture(scope="module")
def page(policy, demos):
    pytest.importorskip("viser")
    opened = uc.view(policy, demos, port=0)
    assert opened.settle()
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def browser(page):
    if CHROMIUM is None:
        pytest.skip("there is no browser: Debian's package chromium")
    playwright = pytest.importorskip("playwright.sync_api")
    SCREENSHOTS.mkdir(parents=True, exist_ok=True)
    with playwright.sync_playwright() as driver:
        program = driver.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        seen = program.new_page(viewport=SIZE)
        seen.asked, seen.faults = [], []
        seen.on("request", lambda request: seen.asked.append(request.url))
        seen.on("websocket", lambda socket: seen.asked.append(socket.url))
        seen.on("pageerror", lambda error: seen.faults.append(str(error)))
        seen.on("console", lambda told: told.type == "error" and seen.faults.append(told.text))
        seen.goto(page.url)
        seen.locator(".mantine-Notification-closeButton").click()  # which says that there is no graphics card
        seen.locator("canvas").first.wait_for(timeout=20_000)
        until(lambda: page.stage.server.get_clients(), 20)
        yield seen
        program.close()


def until(condition, seconds=10.0):
    """Wait for what another thread does."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.05)


def pixel(page, point):
    """Where a point of the scene is on the screen."""
    camera = page.stage.server.initial_camera
    away = np.asarray(point) - camera.position
    to_pixels = SIZE["height"] / 2 / (-away[2] * np.tan(camera.fov / 2))
    return SIZE["width"] / 2 + away[0] * to_pixels, SIZE["height"] / 2 - away[1] * to_pixels


def colours(browser, name):
    """How many pixels of a screenshot have about the colour #rrggbb."""
    from matplotlib.image import imread

    browser.screenshot(path=SCREENSHOTS / f"{name}.png")
    image = np.round(255 * imread(SCREENSHOTS / f"{name}.png")[..., :3])

    def count(colour):
        wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
        return int((np.abs(image - wanted).max(axis=-1) < 30).sum())

    return count


def test_all_of_it_is_drawn_and_nothing_is_fetched_from_elsewhere(page, browser):
    until(lambda: colours(browser, "view")("#0072B2") > 2000)
    seen = colours(browser, "view")
    for colour in ("#000000", "#009E73", "#CC79A7"):
        assert seen(colour) > 300
    port = page.stage.server.get_port()
    own = tuple(f"{kind}://localhost:{port}" for kind in ("http", "ws", "blob:http"))
    assert len(browser.asked) >= 2
    assert [url for url in browser.asked if not url.startswith((*own, "data:"))] == []
    assert browser.faults == []


def test_a_mouse_drags_the_start_and_the_rollout_follows(page, browser):
    stage = page.stage
    before, begun = stage.updates, stage.places(stage.start[None])[0]
    # The square of the handle moves it within the plane.
    x, y = pixel(page, begun + 0.04 * stage.frame.extent * np.array([1.0, 1.0, 0.0]))
    browser.mouse.move(x, y)
    browser.mouse.down()
    for k in range(15):
        browser.mouse.move(x - 8 * k, y - 6 * k)
        time.sleep(0.02)
    browser.mouse.up()
    until(lambda: stage.updates >= before + 5)
    assert page.settle()
    moved = stage.places(stage.start[None])[0] - begun
    assert moved[0] < -0.1
    assert moved[1] > 0.1
    np.testing.assert_array_equal(stage.movement.states[0], stage.start)


def test_boxes_dropdowns_and_numbers_do_what_they_say(page, browser):
    page.start.drag_to(np.array([0.3, 0.75, 0.0]))
    page.set_seconds(3.0)
    blue = colours(browser, "view")("#0072B2")
    browser.get_by_label("In its way").click()
    browser.get_by_role("option", name=PLANE, exact=True).click()
    until(lambda: page.obstacles.chosen == PLANE and page.settle())
    until(lambda: colours(browser, "view-plane")("#F5E4B4") > 1000)
    browser.get_by_label("Policy").click()
    browser.get_by_role("option", name="ordinary regression").click()
    until(lambda: page.stage.name == "ordinary regression" and page.settle())
    until(lambda: colours(browser, "view-direct")("#0072B2") < 0.5 * blue)
    browser.get_by_label("Field: stream lines").check()
    until(lambda: page.field.shows_streams and page.settle())
    browser.get_by_label("What is not determined").check()
    browser.get_by_text("Determined:").wait_for()
    until(lambda: colours(browser, "view-unknown")("#56B4E9") > 200)
    assert page.notes == []
    assert browser.faults == []


def test_pictures_and_rollouts_are_saved(page, browser, tmp_path, monkeypatch):
    monkeypatch.setattr(controls, "RENDERED", (300, 400))
    browser.get_by_text("Save", exact=True).click()
    for button, beginning in (
        ("Picture (PNG)", b"\x89PNG"),
        ("Picture (SVG)", b"<?xml"),
        ("Rollout (CSV)", b'"t"'),
    ):
        with browser.expect_download(timeout=30_000) as saved:
            browser.get_by_role("button", name=button).click()
        path = tmp_path / saved.value.suggested_filename
        saved.value.save_as(path)
        assert path.read_bytes().startswith(beginning)
    from matplotlib.image import imread

    image = imread(tmp_path / "view.png")
    assert image.shape[:2] == (300, 400)
    assert len(np.unique(image.reshape(-1, image.shape[-1]), axis=0)) > 100
