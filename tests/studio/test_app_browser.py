"""The studio in a real browser: all steps, as a person takes them by what the page says.

A screenshot of its end is left in build/studio/; `make studio-tour` makes pictures of all steps.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("viser", reason="pip install 'nrdf[studio]'")
pytest.importorskip("playwright", reason="pip install playwright")

from playwright import sync_api

import nrdf
from builders.cells import cell_of
from nrdf.bundled import bundled_chair
from nrdf.cell.file import write_cell
from nrdf.process.bound_knowledge import read_bound_knowledge
from nrdf.studio.app import Studio
from nrdf.studio.model.computing import ChildProcessComputing
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.session import Session
from nrdf.studio.mouse import camera_of
from nrdf.studio.serving import open_server
from nrdf.toolpath.file import read_toolpaths

SHOTS = Path(__file__).parents[2] / "build" / "studio"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    "--no-sandbox", "--headless", "--use-gl=angle", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--no-first-run",
    "--webgl-antialiasing-mode=none", "--webgl-msaa-sample-count=0",
)  # fmt: skip
PATIENCE_S = 60.0
SELDOM = """
const draw = window.requestAnimationFrame;
window.requestAnimationFrame = (frame) => setTimeout(() => draw(frame), 80);
window.cancelAnimationFrame = (waiting) => clearTimeout(waiting);
"""
"""Few frames a second: drawing without a graphics card is most of this test's processor time."""


def browser_path() -> str:
    """The browser of this machine, or a skip."""
    known = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, BROWSERS)), None)
    if known is None:
        pytest.skip("no browser: apt-get install chromium, or CHROMIUM=/path/to/chromium")
    return known


def until(condition, what: str, seconds: float = PATIENCE_S) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"{what} did not happen in {seconds} s"
        time.sleep(0.02)


class Person:
    """Does what the page says, by labels; `studio` is only looked at."""

    def __init__(self, page, studio: Studio) -> None:
        self.page, self.studio = page, studio
        self.notes: list[tuple[str, str]] = []
        notify = studio.notify

        def heard(title: str, body: str, bad: bool = True) -> None:
            self.notes.append((title, body))
            notify(title, body, bad)

        studio.notify = heard

    def step(self, name: str) -> None:
        self.page.get_by_role("tab", name=name).click()

    def press(self, name: str) -> None:
        self.page.get_by_role("button", name=name, exact=True).last.click()

    def take(self, tool: str) -> None:
        """Another tool; the page says when it is in the hand."""
        self.press(tool)
        self.reads(f"Mouse tool {tool}:")

    def field(self, label: str):
        shown = "input[not(@type='hidden')]"
        return self.page.locator(
            f"xpath=((//label[.='{label}'])[1]/ancestor::*[.//{shown}][1]//{shown})[last()]"
        )

    def write(self, label: str, value: str) -> None:
        self.field(label).fill(value)
        self.field(label).press("Enter")

    def choose(self, label: str, value: str) -> None:
        self.field(label).click()
        option = self.page.get_by_role("option", name=value, exact=True)
        option.locator("visible=true").click()

    def place_of(self, key: str, index: int) -> tuple[float, float]:
        """Where a shown point of an object is on the screen."""
        client = next(iter(self.studio.server.get_clients().values()))
        object_view = self.studio.scene.objects[key]
        place = object_view.camera(camera_of(client)).project(
            object_view.paintable.points[[index]]
        )[0][0]
        box = self.page.locator("canvas").first.bounding_box()
        return box["x"] + place[0] * box["width"], box["y"] + place[1] * box["height"]

    def click_on(self, key: str, index: int, done) -> None:
        """Click a point of an object until it is `done`."""

        def click() -> None:
            self.page.mouse.move(*self.place_of(key, index))
            self.page.mouse.down()
            time.sleep(0.05)
            self.page.mouse.up()

        self._until_done(click, done, f"clicking {key}")

    def drag_on(self, key: str, first: int, last: int, done) -> None:
        """Drag from a point of an object to another one until it is `done`."""

        def drag() -> None:
            start, stop = np.array([self.place_of(key, i) for i in (first, last)])
            self.page.mouse.move(*start)
            self.page.mouse.down()
            for share in (0.3, 0.65, 1.0):
                self.page.mouse.move(*(start + share * (stop - start)))
            self.page.mouse.up()

        self._until_done(drag, done, f"dragging on {key}")

    def _until_done(self, act, done, what: str) -> None:
        """Do it again: a busy browser may miss what the mouse does."""
        for _ in range(5):
            act()
            end = time.monotonic() + 0.2 * PATIENCE_S
            while time.monotonic() < end:
                if done():
                    return
                time.sleep(0.02)
        raise AssertionError(f"{what} did nothing; said: {self.notes}")

    def new_region(self, name: str) -> None:
        count = len(self.studio.editor.document.regions)
        self.press("New region")
        until(lambda: len(self.studio.editor.document.regions) > count, "the region")
        sync_api.expect(self.field("Name")).to_have_value("region-1")
        self.write("Name", name)
        until(lambda: self.studio.region == name, "the name")

    def reads(self, text: str) -> None:
        self.page.get_by_text(text).first.wait_for(timeout=1e3 * PATIENCE_S)

    def close_notes(self) -> None:
        """Close the notifications, which lie over the objects."""
        notes = self.page.locator(".mantine-Notification-closeButton")
        until(lambda: notes.count() > 0, "a notification")
        while notes.count():
            with contextlib.suppress(sync_api.Error):
                notes.first.click(timeout=5e3)

    def planned(self, region: str) -> bool:
        painted = self.studio.editor.document.region(region)
        plan = None if painted is None else self.studio.results.plan(painted, 0)
        return plan is not None and plan.checked is not None and not plan.fault


@pytest.fixture
def studio(tmp_path):
    server = open_server("127.0.0.1", 8480)
    computing = ChildProcessComputing(nrdf.load_model)
    computing.start()
    made = Studio(Session(tmp_path / "session"), server, computing, ["chair"], {})
    yield made
    made.stop()
    server.stop()


@pytest.fixture
def person(studio):
    SHOTS.mkdir(parents=True, exist_ok=True)
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path(), args=list(FLAGS))
        page = browser.new_page(viewport={"width": 900, "height": 520}, accept_downloads=True)
        page.set_default_timeout(1e3 * PATIENCE_S)
        page.add_init_script(SELDOM)
        page.goto(f"http://127.0.0.1:{studio.server.get_port()}")
        person = Person(page, studio)
        yield person
        page.screenshot(path=SHOTS / "last.png")
        browser.close()


def middle_of(name: str, region: str) -> int:
    """The point in the middle of a bundled chair's region."""
    cloud, regions = bundled_chair(name)
    points = cloud.points[regions[region]]
    nearest = np.argmin(np.linalg.norm(points - points.mean(axis=0), axis=1))
    return int(np.flatnonzero(regions[region])[nearest])


def test_all_steps(person, studio, tmp_path):
    editor, page = studio.editor, person.page

    # 1: a bundled chair; a file that is none is answered on the page.
    person.step("1 Reference")
    bad = tmp_path / "notes.ply"
    bad.write_bytes(b"ply\nformat ascii 1.0\nend_header\n")
    page.locator("input[type=file]").first.set_input_files(bad)
    person.reads("notes.ply")
    person.close_notes()
    person.press("Open the bundled chair")
    person.reads("8192 points")

    # 2: two regions; the second by brush as well.
    seat, back = (middle_of("reference", name) for name in ("seat", "back-front"))
    person.step("2 Regions")
    person.new_region("seat")
    person.click_on(REFERENCE, seat, lambda: editor.document.region("seat").mask.any())
    small = editor.document.region("seat").mask.sum()
    person.write("Radius, mm", "190")
    until(lambda: editor.document.region("seat").mask.sum() > 2 * small, "a wider patch")
    truth = bundled_chair("reference")[1]
    assert truth["seat"][editor.document.region("seat").mask].mean() > 0.9
    person.new_region("back")
    person.write("Radius, mm", "120")
    until(lambda: studio.radius_m == 0.12, "the radius")
    person.click_on(REFERENCE, back, lambda: editor.document.region("back").mask.any())
    assert truth["back-front"][editor.document.region("back").mask].mean() > 0.9, "it went through"
    person.take("Brush")

    def size() -> int:
        return int(editor.document.region("back").mask.sum())

    grown = size()
    points = editor.paintable(REFERENCE).points
    offset = points - points[back] - [-0.02, 0.15, 0]
    above = int(np.argmin(np.linalg.norm(offset, axis=1)))
    person.drag_on(REFERENCE, back, above, lambda: size() > grown)
    brushed = size()
    person.press("Undo")
    until(lambda: size() < brushed, "undoing")
    person.press("Redo")
    until(lambda: size() >= brushed, "redoing")

    # 3: another process on each, drawn at once; a wrong value is answered by field and value.
    person.step("3 Process")
    person.choose("Process", "polish")
    person.choose("Pattern", "spiral")
    until(lambda: person.planned("back") and person.planned("seat"), "the plans")
    person.write("Tool radius, mm", "-5")
    person.reads("radius_m")
    person.reads("-0.005")
    person.write("Tool radius, mm", "25")
    person.choose("Region", "seat")
    # A number that is dragged has a first look, and the plan follows.
    looks = []
    look = studio.results.look
    studio.results.look = lambda *asked: (looks.append(asked), look(*asked))
    slider = page.get_by_role("slider", name="Stepover, mm")
    slider.focus()
    for _ in range(4):
        slider.press("ArrowLeft")
    until(lambda: looks and person.planned("seat"), "a first look, and the plan after it")
    person.take("Direction")
    behind = editor.paintable(REFERENCE).points[seat] + [-0.12, 0.0, 0.0]
    behind = int(np.argmin(np.linalg.norm(editor.paintable(REFERENCE).points - behind, axis=1)))

    def along() -> float:
        return editor.document.region("seat").steps[0].get("direction", [0.0])[0]

    person.drag_on(REFERENCE, behind, seat, lambda: along() > 0.9)
    until(lambda: person.planned("back") and person.planned("seat"), "the plans")
    person.reads("% missed")

    # 4: both on another chair; similarity; a uncertain region is painted by hand.
    person.step("4 Targets")
    person.press("Add the bundled chair")
    until(lambda: "ladder-back" in studio.scene.objects, "the target")
    person.press("Transfer the process")
    until(lambda: studio.results.is_current("ladder-back"), "the transfer")
    found = studio.results.by_target["ladder-back"].transfer_result
    there = bundled_chair("ladder-back")[1]
    assert there["seat"][found.regions["seat"].match.indices].mean() > 0.8
    assert all(step.path is not None for step in found.paths)
    person.reads("2 tool paths")
    person.take("Similarity")
    person.click_on(REFERENCE, seat, lambda: studio.colouring == "similarity")
    before = studio.descriptor_distances("ladder-back")
    person.drag_on(
        REFERENCE, seat, back, lambda: (studio.descriptor_distances("ladder-back") != before).any()
    )
    sync_api.expect(person.field("Colours")).to_have_value("similarity")
    person.take("Grow")
    there = middle_of("ladder-back", "seat")
    person.click_on("ladder-back", there, lambda: editor.target("ladder-back").corrected)
    until(lambda: studio.results.is_current("ladder-back"), "the new tool path")
    assert (
        studio.results.by_target["ladder-back"].transfer_result.regions["seat"].match.score == 1.0
    )
    person.choose("Colours", "confidence")
    until(lambda: studio.colouring == "confidence", "the colours")

    # 5: what is saved is what the command line reads.
    person.step("5 Save")
    with page.expect_download() as knowledge:
        person.press("Knowledge file, with the reference")
    assert knowledge.value.suggested_filename == "knowledge.zip"
    bound_knowledge = read_bound_knowledge(
        editor.session.folder / "saved" / "knowledge" / "chair.yaml"
    )
    assert list(bound_knowledge.regions) == ["seat", "back"]
    with page.expect_download() as report:
        person.press("HTML report of this target")
    assert b"<table>" in Path(report.value.path()).read_bytes()
    job = read_toolpaths(editor.session.folder / "saved" / "ladder-back" / "job")
    assert {path.process for path in job.paths} == {"sand", "polish"}

    # 6: what is left of it, on an arm: simulated beside the page, played, moved by hand, put away.
    if find_spec("mujoco") is not None:
        person.choose("Region", "back")
        person.step("2 Regions")
        person.press("Delete")
        until(lambda: editor.document.region("back") is None, "the deletion")
        person.step("4 Targets")
        person.press("Transfer the process")
        until(lambda: studio.results.is_current("ladder-back"), "the transfer")
        person.step("6 Robot")
        person.press("Simulate on the arm")
        person.reads("simulating the arm on ladder-back")
        until(lambda: studio.arm_simulation.playback is not None, "the simulation", 4 * PATIENCE_S)
        person.reads("waypoints reached")
        # Slowly: what has ended by itself would begin anew by the button that paused it.
        person.choose("Playback speed", "1 ×")
        person.press("Play")
        until(lambda: studio.arm_simulation.time_s > 0, "playing")
        person.press("Pause")
        until(lambda: not studio.arm_simulation.player.playing, "pausing")
        work = studio.arm_simulation.playback.times[
            studio.arm_simulation.playback.motion == "process"
        ]
        person.write("Time, s", f"{work[len(work) // 2]:.1f}")
        until(
            lambda: abs(studio.arm_simulation.time_s - work[len(work) // 2]) < 0.2, "moving by hand"
        )
        person.reads("· process · line")
        person.press("Simulate on the arm")
        person.press("Cancel")
        until(lambda: not studio.arm_simulation.worker.busy, "cancelling")
        assert studio.arm_simulation.playback is not None, "the one before is kept"
        person.field("Show the arm").click()
        until(
            lambda: studio.visible_objects() == [REFERENCE, "ladder-back"], "putting the arm away"
        )
        write_cell(tmp_path / "cell.yaml", cell_of())
        page.locator("input[type=file]").last.set_input_files(tmp_path / "cell.yaml")
        person.reads("the cell cell 3")

    # Nothing is lost: the page, and the program, begun again.
    page.reload()
    person.reads("Your session is here") if editor.session.restored else person.reads("Next:")
    kept = Session(editor.session.folder)
    assert kept.restored and kept.document.regions[0].name == "seat"
    assert (kept.document.region("seat").mask == editor.document.region("seat").mask).all()
