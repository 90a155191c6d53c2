"""What computes in a process of its own: it answers, is given up, dies, and is started again."""

from __future__ import annotations

import os
import signal
import time
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("viser", reason="pip install 'nrdf[studio]'")

import nrdf
from builders.studio_page import small_box
from builders.taught_box import faces
from nrdf.errors import CloudError
from nrdf.io.cloud import write_cloud
from nrdf.studio.app import Studio
from nrdf.studio.model.computing import ChildProcessComputing, LocalComputing
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.editor import Editor
from nrdf.studio.model.result_cache import ResultCache
from nrdf.studio.model.session import Session
from nrdf.studio.model.worker import Cancelled
from nrdf.studio.serving import open_server


def load(weights, deadly, category):
    """The model of a category; ends the process instead as long as there is a file `deadly`."""
    if deadly.exists():
        os.kill(os.getpid(), signal.SIGSEGV)
    return nrdf.load_model(weights)


def silent(done, total):
    """Progress that nobody looks at."""


def painted_editor(folder):
    editor = Editor(Session(folder))
    editor.open_reference("box.ply", small_box(), "chair")
    editor.add_region("top")
    mask = np.zeros(len(small_box()), bool)
    mask[faces(small_box())["top"]] = True
    editor.paint(REFERENCE, "top", mask)
    editor.add_target("new.ply", small_box(1.1, seed=1))
    return editor


@pytest.fixture
def deadly(tmp_path):
    return tmp_path / "deadly"


@pytest.fixture
def separate(untrained, deadly):
    made = ChildProcessComputing(partial(load, untrained, deadly))
    yield made
    made.end()


def test_a_process_answers_what_is_answered_here(tmp_path, untrained, separate):
    """One process for all that it does: starting it takes seconds."""
    editor = painted_editor(tmp_path / "s")
    here = ResultCache(editor, LocalComputing(lambda category: nrdf.load_model(untrained)))
    there = ResultCache(editor, separate)
    document, shares = editor.document, []
    for results in (here, there):
        results.make_plans(document, silent)
        results.transfer(document, lambda done, total: shares.append(done / total))
    (region,) = document.regions
    one, other = here.plan(region, 0), there.plan(region, 0)
    assert other.checked.metrics == one.checked.metrics and not other.fault
    one, other = (results.by_target["new"].transfer_result for results in (here, there))
    assert [p.metrics for p in other.paths] == [p.metrics for p in one.paths]
    assert there.is_current("new") and max(shares) > 0.0
    one, other = (
        results.correspondence_features(document, silent).distances(17) for results in (here, there)
    )
    np.testing.assert_allclose(other["new"], one["new"], atol=1e-6)
    editor.change_numbers("top", 0, {"stepover_mm": 35.0})
    assert not there.is_current("new")

    def give_up(done, total):
        raise Cancelled

    with pytest.raises(Cancelled):
        there.transfer(editor.document, give_up)
    editor.change_numbers("top", 0, {"stepover_mm": 20.0})
    there.transfer(editor.document, silent)
    process = (
        there.by_target["new"].transfer_result.bound_knowledge.knowledge.regions[0].processes[0]
    )
    assert process.stepover_m == 0.02, "what was changed after it was cancelled"

    write_cloud(tmp_path / "box.ply", small_box())
    content = (tmp_path / "box.ply").read_bytes()
    read = there.read("box.ply", content, "chair", None, silent)
    np.testing.assert_allclose(read.points, small_box().points)
    with pytest.raises(CloudError, match=r"^box\.ply: "):
        there.read("box.ply", content[:-100], "chair", None, silent)


def test_a_studio_outlives_what_computes_and_opens_again(tmp_path, separate, deadly):
    painted_editor(tmp_path / "s")
    deadly.touch()
    server = open_server("127.0.0.1", 8490)
    studio = Studio(Session(tmp_path / "s"), server, separate, ["chair"], {})
    try:
        time.sleep(0.5)
        assert separate._child is None and not studio.worker.busy, "it plans nothing by itself"
        with studio.reporting_errors():
            studio.plan(0.0)
            studio.transfer()
        assert studio.worker.wait(120)
        died = "has ended by itself (signal 11, Segmentation fault)"
        until(lambda: died in studio.panel.error.content)
        time.sleep(0.5)
        assert not studio.worker.busy, "it does not try again by itself"
        assert studio.results.plan(studio.editor.document.regions[0], 0).lines, "planned before"
        assert Session(tmp_path / "s").document.regions, "nothing is lost"
        deadly.unlink()
        with studio.reporting_errors():
            studio.panel.targets._load(
                SimpleNamespace(name="more.xyz", content=b"1 2 3\n" * 9),  # refused, in the process
            )
        assert studio.worker.wait(120)
        until(lambda: "more.xyz" in studio.panel.error.content)
        with studio.reporting_errors():
            studio.transfer()
        assert studio.worker.wait(120)
        assert studio.results.is_current("new")
    finally:
        studio.stop()
        server.stop()


def until(condition):
    for _ in range(500):
        if condition():
            return
        time.sleep(0.02)
    raise AssertionError("it did not come")
