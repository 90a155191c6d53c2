"""What the page says to what cannot be right; a person's acts are called without a browser."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("viser", reason="pip install 'nrdf[studio]'")

import nrdf
from builders.taught_box import SIZE, cloud, faces
from nrdf.errors import ModelError
from nrdf.studio.app import Studio
from nrdf.studio.model import simulation_process, uploads
from nrdf.studio.model.computing import LocalComputing
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.session import Session
from nrdf.studio.model.uploads import BUNDLED
from nrdf.studio.panels.targets import ALL
from nrdf.studio.serving import open_server


class Page:
    """A studio, and what it has said on its pages."""

    def __init__(self, folder, weights):
        self.weights, self.said = weights, []
        self.server = open_server("127.0.0.1", 8460)
        self.studio = Studio(Session(folder), self.server, LocalComputing(self.load), ["chair"], {})
        notify = self.studio.notify

        def heard(title, body, bad=True):
            self.said.append(body)
            notify(title, body, bad)

        self.studio.notify = heard
        self.editor = self.studio.editor
        self.editor.open_reference("box.ply", cloud(), "chair")
        for name in ("top", "front"):
            self.editor.add_region(name)
            self.paint(name, faces(cloud())[name])
        self.editor.add_target("new.ply", cloud(1.1 * SIZE, seed=1))
        self.studio.sync()
        self.studio.region = "top"

    def load(self, category):
        if self.weights is None:
            raise ModelError(f"no model for '{category}'; known: plane")
        return nrdf.load_model(self.weights)

    def paint(self, name, indices):
        mask = np.zeros(len(cloud()), bool)
        mask[indices] = True
        self.editor.paint(REFERENCE, name, mask)

    def does(self, act, *words):
        """What the page says to an act, all of it."""
        self.said.clear()
        with self.studio.reporting_errors():
            act(*words)
        assert self.studio.worker.wait(60)
        return " ".join(self.said)

    def bring(self):
        return self.does(self.studio.panel.targets._transfer)

    def change(self, **numbers):
        self.editor.change_numbers("top", 0, numbers)
        self.does(self.studio.plan, 0.0)
        return self.studio.panel.process.status.content


@pytest.fixture
def page(tmp_path, untrained):
    made = Page(tmp_path / "session", untrained)
    yield made
    made.studio.stop()
    made.server.stop()


def test_files_that_cannot_be_read(page, monkeypatch):
    load = page.studio.panel.reference._load

    def said(name, content):
        return page.does(load, SimpleNamespace(name=name, content=content))

    assert "notes.docx is no point cloud or mesh" in said("notes.docx", b"PK")
    assert "chair.ply: not a point cloud that can be read" in said("chair.ply", bytes(range(256)))
    monkeypatch.setattr(uploads, "LARGEST_UPLOAD", 1 << 20)
    assert "big.ply has 2 MiB; at most 1 MiB" in said("big.ply", bytes(1 << 21))
    assert page.editor.document.reference.name == "box.ply", "what was open stays"


def test_regions_that_cannot_be(page):
    assert "'front' already" in page.does(page.studio.panel.regions._rename, "front")
    page.paint("front", faces(cloud())["top"])
    assert "tick 'Regions may overlap'" in page.bring()
    page.paint("front", [])
    said = page.bring()
    assert "front: no points yet" in said and page.studio.results.is_current("new")
    page.paint("top", [])
    assert "no region is painted yet: paint one in step 2" in page.bring()


def test_numbers_that_cannot_be_are_named_as_on_the_page(page):
    told = page.change(feed_mm_s=0.0)
    assert told.startswith("⚠ region 'top'")
    assert "feed_m_s (*Feed, mm/s*): must be above 0.0, not 0.0" in told
    assert "feed_m_s: must be above 0.0" in page.bring()
    told = page.change(feed_mm_s=100.0, stepover_mm=2000.0)
    assert "stepover_m (*Stepover, mm*) is 2 (2000 mm), above what is plausible" in told


def test_without_a_model_or_a_result(page):
    assert "nothing is transferred to a target" in page.does(
        page.studio.arm_simulation.start, "new"
    )
    page.weights = None
    assert "no model for 'chair'" in page.bring()
    assert "no model for 'chair'" in page.studio.panel.error.content, "until the next act"
    page.does(page.studio.panel.regions.undo)
    assert not page.studio.panel.error.visible


def test_without_mujoco_the_button_says_what_to_install(page, monkeypatch):
    page.bring()
    monkeypatch.setattr(simulation_process, "find_spec", lambda name: None)
    assert "pip install 'nrdf[robot]'" in page.does(page.studio.arm_simulation.start, "new")
    assert "press 'Simulate on the arm' first" in page.does(page.studio.arm_simulation.play)
    assert "press 'Simulate on the arm' first" in page.does(page.studio.arm_simulation.save, None)


def test_several_targets_stand_side_by_side(page):
    page.does(page.studio.panel.targets._add, ALL)
    keys = [REFERENCE, "new", *BUNDLED[1:]]
    assert page.studio.visible_objects() == keys == list(page.studio.scene.objects)
    spans = [object_view.corners[:, 2] for object_view in page.studio.scene.objects.values()]
    assert all(a.min() > b.max() for a, b in pairwise(spans)), "none overlap"
    page.does(page.studio.panel.targets._show, "rocker")
    assert page.studio.visible_objects() == [REFERENCE, "rocker"]


def test_similarity_follows_the_picked_point(page):
    studio = page.studio
    page.bring()
    assert "pick a point of the reference" in page.does(studio.compare, "new", 3)
    page.does(studio.compare, REFERENCE, 3)
    first = studio.descriptor_distances("new")
    assert studio.colouring == "similarity" and studio.descriptor_distances(REFERENCE).argmin() == 3
    with studio.reporting_errors():
        studio.compare(REFERENCE, 700)
    assert not studio.worker.busy, "at once"
    assert studio.descriptor_distances(REFERENCE).argmin() == 700
    assert (studio.descriptor_distances("new") != first).any()
    page.does(studio.panel.targets._add, "rocker")
    page.bring()
    page.does(studio.compare, REFERENCE, 3)
    assert studio.descriptor_distances("rocker") is not None, "what came later too"


def test_a_drag_goes_on_while_work_ends(page, monkeypatch):
    """Taking callbacks away would end the drag that is under way, and orbit the camera."""
    taken_away = []
    ground = page.studio.scene.objects[REFERENCE].drag_box
    take_away = type(ground).remove_drag_callback

    def remove_drag_callback(handle, *words):
        taken_away.append(handle)
        take_away(handle, *words)

    monkeypatch.setattr(type(ground), "remove_drag_callback", remove_drag_callback)
    page.does(page.studio.mouse.select_tool, "Brush")
    assert ground.visible
    page.does(page.studio.sync)
    page.does(page.studio.mouse.select_tool, "Direction")
    assert not taken_away
    page.does(page.studio.mouse.select_tool, "Orbit")
    assert ground in taken_away and not ground.visible


def test_tool_clearance(page):
    tab = page.studio.panel.process
    page.does(tab.refresh)
    assert tab.tool_clearance.value == 20.0
    tab.tool_clearance.value = 35.0
    page.does(tab._set_tool)
    assert page.editor.document.region("top").steps[0]["tool"]["clearance_m"] == 0.035
    tab.tool_clearance.value = -1.0
    page.does(tab._set_tool)
    page.does(tab.refresh)
    assert "clearance_m" in tab.status.content and "-0.001" in tab.status.content
