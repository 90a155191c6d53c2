"""A person's path through the studio in a real browser: from an empty page to jobs on scans that it
has never seen, with what is clicked counted and what is waited for timed.

    make studio-tour, or: python tools/studio_tour.py [CHROMIUM]

Fails where a path needs more than 25 clicks or 90 s of waiting, on an error in the browser's
console, or on a serious finding of axe-core. Leaves pictures, a film and figures in
build/studio-tour/. The scans: ../shared/scans/chair-2.off where that is, and a dense one of a chair
of an IKEA catalogue, or of a made-up chair, that lies in some pose: half a million points, in
millimetres.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from axe_playwright_python.sync_playwright import Axe
from PIL import Image
from playwright.sync_api import Page, sync_playwright
from studio_speed import lying_scan

ROOT = Path(__file__).parents[1]
SHARED = ROOT.parent / "shared"
OUT = ROOT / "build" / "studio-tour"
FLAGS = ("--no-sandbox", "--headless", "--use-gl=angle", "--use-angle=swiftshader",
         "--enable-unsafe-swiftshader", "--webgl-antialiasing-mode=none",
         "--webgl-msaa-sample-count=0")  # fmt: skip
SIZE = (1280, 720)
MOST_CLICKS, MOST_WAIT_S, MOST_S = 25, 90.0, 600.0
SEAT, BACK = (0.53, 0.61), (0.45, 0.41)  # places of the bundled chair in the first view
TABS = ("1 Reference", "2 Regions", "3 Process", "4 Targets", "5 Save", "6 Robot")
# Few frames a second: drawing without a graphics card takes what the server needs.
SELDOM = """const draw = window.requestAnimationFrame;
window.requestAnimationFrame = (frame) => setTimeout(() => draw(frame), 120);"""
WITHOUT_NOTES = ".mantine-Notifications-root { display: none !important }"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


class Tour:
    """Clicks and waits on a page, and counts them; pictures are its frames of the film."""

    def __init__(self, page: Page) -> None:
        self.page, self.clicks, self.waited_s = page, 0, 0.0
        self.errors: list[str] = []
        self.findings: list[str] = []
        self.frames: list[Path] = []
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("console", lambda said: said.type == "error" and self.errors.append(said.text))

    def press(self, name: str) -> None:
        """Click a button."""
        self.clicks += 1
        self.page.get_by_role("button", name=name, exact=True).last.click(force=True)

    def tab(self, name: str) -> None:
        """Click a tab."""
        self.clicks += 1
        self.page.get_by_role("tab", name=name).click()

    def click_object(self, place: tuple[float, float]) -> None:
        """Click a place of the view, in shares of its width and height."""
        self.clicks += 1
        box = self.page.locator("canvas").first.bounding_box()
        assert box is not None
        self.page.mouse.move(
            box["x"] + place[0] * box["width"], box["y"] + place[1] * box["height"]
        )
        self.page.mouse.down()
        time.sleep(0.05)
        self.page.mouse.up()

    def send(self, path: Path, number: int) -> None:
        """Choose a file for an upload button: a click; the dialog is the system's."""
        self.clicks += 1
        self.page.locator("input[type=file]").nth(number).set_input_files(path)

    def choose(self, label: str, value: str) -> None:
        """Choose an option: two clicks."""
        self.clicks += 2
        self.page.get_by_role("textbox", name=label, exact=True).last.click()
        self.page.get_by_role("option", name=value, exact=True).locator("visible=true").click()

    def wait_for(self, text: str | re.Pattern[str], what: str) -> None:
        """Wait until the page says something."""
        self._wait(lambda: self.page.get_by_text(text).first.wait_for(timeout=240e3), what)

    def _wait(self, work: Callable[[], object], what: str) -> None:
        begun = time.monotonic()
        work()
        took = time.monotonic() - begun
        self.waited_s += took
        print(f"{what}: {took:.1f} s", flush=True)

    def shoot(self, name: str) -> None:
        """A picture, which is a frame of the film too."""
        time.sleep(0.6)
        path = OUT / f"{len(self.frames) + 1:02}-{name}.png"
        self.page.screenshot(path=path, timeout=60e3, style=WITHOUT_NOTES)
        self.frames.append(path)

    def check_access(self, where: str) -> None:
        """What axe-core finds that is serious or critical."""
        for found in Axe().run(self.page).response["violations"]:
            if found["impact"] in ("serious", "critical"):
                places = "; ".join(node["html"][:100] for node in found["nodes"][:3])
                self.findings.append(f"{where}: {found['id']} ({found['impact']}): {places}")


def own_processes() -> dict[int, list[str]]:
    """Processes that this one and its own have started, with what the system says of them."""
    said = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            name, _, rest = stat.read_text().partition("(")[2].rpartition(")")
            said[int(stat.parent.name)] = [name, *rest.split()]
    own = {}
    for process, words in said.items():
        above = process
        while above in said and above != os.getpid():
            above = int(said[above][2])
        if above == os.getpid() != process:
            own[process] = words
    return own


def calm() -> None:
    """Give the browser's processes, of which the one that draws begins with more weight, as much
    as the studio has, where the system lets us."""
    for process in own_processes():
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, process, 0)


def processor_time() -> dict[str, float]:
    """What studio and browser have taken of the processor so far, s: on a busy machine, what was
    waited for says little."""
    spent = {"studio": 0.0, "browser": 0.0}
    for name, *words in own_processes().values():
        what = "studio" if "python" in name or "nrdf" in name else "browser"
        spent[what] += (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")
    return {what: round(seconds, 1) for what, seconds in spent.items()}


def teach(tour: Tour) -> None:
    """From an empty page to two regions on the bundled chair."""
    tour.wait_for("Next:", "opening the page")
    tour.press("Open the bundled chair")
    tour.wait_for("8192 points", "opening the chair")
    tour.shoot("reference")
    tour.tab("2 Regions")
    tour.press("New region")
    tour.wait_for("where region-1 is", "the region")
    tour.click_object(SEAT)
    tour.wait_for("% of the object", "the seat")
    tour.press("New region")
    tour.wait_for("where region-2 is", "the region")
    tour.click_object(BACK)
    tour.wait_for("click on to enlarge region-2", "the backrest")
    tour.shoot("regions")


def bring_to(tour: Tour, scan: Path, name: str) -> None:
    """From a file to a job in the browser's downloads."""
    tour.tab("4 Targets")
    tour.send(scan, 2)
    tour.wait_for(f"{name} stands as it is shown", f"reading {scan.name}")
    tour.shoot(f"{name}-pose")
    tour.press("It stands like this")
    tour.press("Transfer the process")
    tour.wait_for(re.compile(rf"{name}: [1-9]\d* tool path"), f"regions and tool paths on {name}")
    tour.shoot(f"{name}-paths")
    tour.tab("5 Save")
    with tour.page.expect_download(timeout=240e3) as sent:
        tour.press("Job of this target")
        tour._wait(lambda: sent.value.path(), f"the job of {name}")


def film(frames: list[Path]) -> None:
    """The pictures one after another, as a film that every browser shows."""
    pictures = [Image.open(path).convert("RGB").resize((960, 540)) for path in frames]
    pictures[0].save(
        OUT / "studio-tour.webp", save_all=True, append_images=pictures[1:], duration=1500, loop=0,
        quality=70,
    )  # fmt: skip


def main() -> int:
    """Walk the path; 0 where every figure holds."""
    begun = time.monotonic()
    shutil.rmtree(OUT, ignore_errors=True)
    OUT.mkdir(parents=True)
    browser_path = next(filter(None, [*sys.argv[1:], os.environ.get("CHROMIUM"),
                                      *map(shutil.which, BROWSERS)]), None)  # fmt: skip
    if browser_path is None:
        print("no browser: apt-get install chromium, or name one", file=sys.stderr)
        return 1
    with tempfile.TemporaryDirectory() as kept, sync_playwright() as playwright:
        folder = Path(kept)
        scans = [("dense-chair", lying_scan(folder))]
        real = SHARED / "scans" / "chair-2.off"
        scans = [("chair-2", real), *scans] if real.is_file() else scans
        studio = subprocess.Popen(
            [sys.executable, "-m", "nrdf.cli", "studio", "--no-browser", "--port", "8700",
             "--session", str(folder / "session")], stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert studio.stdout is not None
        try:
            address = next(line for line in studio.stdout if line.startswith("http")).strip()
            browser = playwright.chromium.launch(executable_path=browser_path, args=list(FLAGS))
            page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
            page.set_default_timeout(120e3)
            page.add_init_script(SELDOM)
            calm()
            page.goto(address)
            tour = Tour(page)
            teach(tour)
            taught = tour.clicks, tour.waited_s
            paths = {}
            for name, scan in scans:
                tour.clicks, tour.waited_s = taught
                bring_to(tour, scan, name)
                paths[name] = {"clicks": tour.clicks, "waited_s": round(tour.waited_s, 1)}
            for tab in TABS:
                page.get_by_role("tab", name=tab).click()
                time.sleep(0.5)
                tour.check_access(tab)
            tour.shoot("robot")
            spent = processor_time()
            browser.close()
        finally:
            studio.terminate()
            studio.wait(20)
    film(tour.frames)
    figures = {
        "paths": paths, "processor_s": spent, "took_s": round(time.monotonic() - begun),
        "console_errors": tour.errors, "axe_serious": tour.findings,
    }  # fmt: skip
    (OUT / "figures.json").write_text(json.dumps(figures, indent=1) + "\n")
    print(json.dumps(figures, indent=1))
    good = not tour.errors and not tour.findings and figures["took_s"] <= MOST_S
    for path in paths.values():
        good &= path["clicks"] <= MOST_CLICKS and path["waited_s"] <= MOST_WAIT_S
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
