"""Draw docs/images/studio.png, the studio with the bundled chair's processes transferred to another
chair, and docs/images/studio-arm.png, the same on the arm in simulation.

    python tools/studio_picture.py CHROMIUM

CHROMIUM: path of a Chromium browser. Needs `pip install -e '.[dev]'`.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

import nrdf
from nrdf.bundled import KNOWLEDGE, REFERENCE, TARGETS
from nrdf.process.bound_knowledge import read_bound_knowledge
from nrdf.studio.app import Studio
from nrdf.studio.model.computing import LocalComputing
from nrdf.studio.model.session import Session
from nrdf.studio.model.uploads import bundled
from nrdf.studio.serving import open_server

DOCS = Path(__file__).parents[1] / "docs" / "images"
FLAGS = ("--no-sandbox", "--headless", "--use-gl=angle", "--use-angle=swiftshader",
         "--enable-unsafe-swiftshader")  # fmt: skip
SIZE = {"width": 1500, "height": 900}


def main() -> None:
    """Set the studio up, open it and take the pictures."""
    server = open_server("127.0.0.1", 8490)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        studio = Studio(Session(folder), server, LocalComputing(nrdf.load_model), ["chair"], {})
        studio.editor.open_knowledge(REFERENCE, read_bound_knowledge(KNOWLEDGE))
        studio.editor.add_target(TARGETS[0], bundled(TARGETS[0]))
        studio.restore()
        studio.worker.wait(300)
        browser = playwright.chromium.launch(executable_path=sys.argv[1], args=list(FLAGS))
        page = browser.new_page(viewport=SIZE)
        page.set_default_timeout(120e3)
        page.goto(f"http://127.0.0.1:{server.get_port()}")
        page.get_by_role("tab", name="4 Targets").click()
        page.get_by_text("Software WebGL").wait_for()
        for close in page.locator(".mantine-Notification-closeButton").all():
            close.click()
        studio.arrange()
        time.sleep(5)
        page.screenshot(path=DOCS / "studio.png")
        page.get_by_role("tab", name="6 Robot").click()
        studio.arm_simulation.start(TARGETS[0])
        studio.arm_simulation.worker.wait(900)
        playback = studio.arm_simulation.playback
        assert playback is not None, "the simulation failed"
        at_work = playback.times[playback.motion == "process"]
        studio.arm_simulation.seek(float(at_work[len(at_work) // 3]))
        studio.panel.refresh()
        time.sleep(5)
        page.screenshot(path=DOCS / "studio-arm.png")
        browser.close()
        studio.stop()
    server.stop()


if __name__ == "__main__":
    main()
