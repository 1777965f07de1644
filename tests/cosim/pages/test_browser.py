"""Pages in a real browser, from the disk and without a network: drawn, moved, and free of errors.

Pictures of the pages stay in the folder that `HFSA_SCREENSHOTS` names, else in that of the test.
"""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from hfsa.components._mechanics.sdelta_geometry import Posture
from hfsa.components.sdelta import analyze
from hfsa.cosim.cli import main

CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
webdriver = pytest.importorskip("selenium.webdriver", reason="selenium, which drives the browser, is not installed")

pytestmark = pytest.mark.skipif(
    not (CHROMIUM and DRIVER), reason="there is no chromium with chromedriver (Debian: chromium, chromium-driver)"
)

POSTURE = Posture((10.0, 5.0, 8.0), (0.02, 0.01, 0.155))
WORDS = ["posture.rotation=10,5,8", "posture.position=0.02,0.01,0.155"]


@pytest.fixture(scope="module")
def browser():
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for word in ("headless=new", "no-sandbox", "window-size=1200,900", "enable-unsafe-swiftshader"):
        options.add_argument(f"--{word}")
    options.add_argument("--host-resolver-rules=MAP * ~NOTFOUND")  # no network
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(DRIVER))
    driver.set_script_timeout(60)
    yield driver
    driver.quit()


@pytest.fixture
def page(browser, tmp_path, monkeypatch):
    """Draw a part into a page and open it."""
    monkeypatch.chdir(tmp_path)

    def opened(part: str, *words: str):
        file = tmp_path / f"{part}.html"
        assert main(["view", part, *(token for word in words for token in ("-p", word)), "-o", str(file)]) == 0
        browser.get(file.as_uri())
        keep(browser, part, tmp_path)
        return browser

    yield opened
    errors = [entry["message"] for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]
    assert not errors


def keep(browser, name: str, folder: Path) -> None:
    target = Path(os.environ.get("HFSA_SCREENSHOTS", folder))
    target.mkdir(parents=True, exist_ok=True)
    browser.save_screenshot(str(target / f"{name}.png"))


def points(browser, place: int) -> np.ndarray:
    """Coordinates of a trace, shape (points, 3), gaps left out, as the plot holds them now."""
    script = "const t = document.getElementById('plot').data[arguments[0]]; return [t.x, t.y, t.z].map(a => [...a]);"
    columns = browser.execute_script(script, place)
    return np.array([row for row in zip(*columns, strict=True) if None not in row], dtype=float)


def traces(browser) -> list[dict]:
    return browser.execute_script(
        "return document.getElementById('plot').data.map(t => ({name: t.name || '', type: t.type}))"
    )


def select(browser, place: int) -> None:
    browser.find_elements("css selector", "[role=tab]")[place].click()


def slide(browser, share: float) -> None:
    browser.execute_script(
        "const s = document.getElementById('size'); s.value = arguments[0]; s.dispatchEvent(new Event('input'));", share
    )


def colours(browser) -> int:
    """Number of colours of the middle of the canvas."""
    from io import BytesIO

    from PIL import Image

    image = Image.open(BytesIO(browser.find_element("id", "plot").screenshot_as_png)).convert("RGB")
    return len(image.resize((200, 150)).getcolors(30000) or ())


def test_the_robot_is_drawn_and_its_modes_are_those_of_analyze(page):
    browser = page("sdelta", *WORDS)
    tabs = [tab.text for tab in browser.find_elements("css selector", "[role=tab]")]
    numbers = analyze(posture=POSTURE)
    frequencies = numbers["natural_frequencies_hz"]
    pitches = [f", pitch {1e3 * pitch:.3g} mm" for pitch in numbers["modal_pitches"]]
    assert tabs[1:7] == [
        f"mode {i}: {f:.4g} Hz, {kind}{pitch if kind == 'screw' else ''}"
        for i, (f, kind, pitch) in enumerate(zip(frequencies, numbers["modal_kinds"], pitches, strict=True), 1)
    ]
    assert tabs[7:] == ["modal screws", "compliant axes", "eigenscrews"]
    assert colours(browser) > 20


@pytest.mark.slow
def test_the_displacement_of_a_mode_is_that_of_its_screw(page):
    """Joints move along theta x (S_j - C) + d, whatever the slider says, and back to rest at zero."""
    browser = page("sdelta", *WORDS)
    select(browser, 3)
    platforms = [i for i, trace in enumerate(traces(browser)) if trace["type"] == "mesh3d"]
    rest, moving = platforms
    numbers = analyze(posture=POSTURE)
    screw = numbers["modal_screws_C"][:, 2]
    joints = points(browser, rest)
    mass, *moments = numbers["inertia_parameters_S"][:4]
    center = 1e3 * (np.array(POSTURE.position) + POSTURE.matrix @ np.array(moments) / mass)
    expected = np.cross(screw[:3], joints - center) + 1e3 * screw[3:]
    for share in (0.0, 0.5, 2.0):
        slide(browser, share)
        shift = points(browser, moving) - joints
        largest = np.linalg.norm(shift, axis=1).max()
        assert largest == pytest.approx(share * 0.35 * 150, rel=1e-4, abs=1e-4)
        if share:
            np.testing.assert_allclose(shift / largest, expected / np.linalg.norm(expected, axis=1).max(), atol=1e-4)


@pytest.mark.slow
def test_a_mode_plays_and_pauses(page):
    browser = page("sdelta")
    select(browser, 1)
    play = browser.find_element("id", "play")
    moving = [i for i, trace in enumerate(traces(browser)) if trace["type"] == "mesh3d"][1]
    at_rest = points(browser, moving)
    play.click()
    seen = []
    for _ in range(20):
        browser.execute_async_script("const done = arguments[0]; requestAnimationFrame(() => setTimeout(done, 40));")
        seen.append(points(browser, moving))
    assert np.ptp(np.array(seen), axis=0).max() > 20
    play.click()
    assert play.text == "Play"
    np.testing.assert_allclose(points(browser, moving), at_rest)


@pytest.mark.slow
def test_keys_change_the_panel(page):
    browser = page("tba_accelerometer")
    body = browser.find_element("tag name", "body")
    body.send_keys("\ue014")  # right
    chosen = browser.find_element("css selector", "[role=tab][aria-selected=true]")
    assert chosen.text.startswith("displaced along x")
    assert browser.switch_to.active_element == chosen
    assert browser.find_element("id", "plot").get_attribute("aria-label").endswith(chosen.text)


@pytest.mark.slow
@pytest.mark.parametrize("part", ["rrr_stage", "beam_module", "tba_accelerometer"], ids=str)
def test_other_parts_are_drawn(page, part):
    assert colours(page(part)) > 10


@pytest.mark.slow
def test_a_run_is_played_under_its_cursor(browser, tmp_path, monkeypatch):
    """The place of a joint in a frame is that at rest plus its recorded displacement times the factor shown."""
    monkeypatch.chdir(tmp_path)
    assert main(["run", "sdelta_shaker", "--frequency", "20", "--stop", "0.4", "-o", "run.h5"]) == 0
    assert main(["view", "run.h5"]) == 0
    browser.get((tmp_path / "run.html").as_uri())
    keep(browser, "run", tmp_path)
    platform = next(i for i, trace in enumerate(traces(browser)) if trace["type"] == "mesh3d")
    at_rest = points(browser, platform)
    script = "const t = document.getElementById('time'); t.value = arguments[0]; t.dispatchEvent(new Event('input'));"
    browser.execute_script(script, 900)
    data = browser.execute_script("return hfsa.data.bodies[0]")
    shown = float(browser.find_element("id", "times").text)
    assert shown == pytest.approx(data["times"], rel=1e-2)
    shift = data["times"] * np.array(data["shifts"][-1][900]).T
    np.testing.assert_allclose(
        points(browser, platform) - at_rest,
        shift - data["times"] * np.array(data["shifts"][-1][0]).T,
        rtol=1e-3,
        atol=1e-3,
    )
    cursor = browser.execute_script("return document.getElementById('signals').layout.shapes[0].x0")
    assert f"{cursor:.5g}" in browser.find_element("id", "now").text
    browser.find_element("id", "play").click()
    browser.execute_async_script("const done = arguments[0]; setTimeout(done, 600);")
    assert browser.execute_script("return Number(document.getElementById('time').value)") != 900
    assert not [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]
