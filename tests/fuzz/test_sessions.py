"""Sessions of the studio, altered: opened, or kept aside with a reason; the page can show each."""

from __future__ import annotations

import copy
import json
import shutil

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from builders.fuzzing import altered, damaged, outcome_of, tries
from builders.taught_box import SIZE, cloud, faces
from nrdf.errors import NrdfError
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.editor import Editor
from nrdf.studio.model.session import Session
from nrdf.studio.model.session_file import FILE
from nrdf.studio.model.teaching import bound_knowledge_of, process_of, shown_numbers
from nrdf.studio.scene.colours import painted_colours


@pytest.fixture(scope="module")
def valid(tmp_path_factory):
    """A session's folder, and what its file holds."""
    folder = tmp_path_factory.mktemp("valid") / "session"
    editor = Editor(Session(folder))
    editor.open_reference("box.ply", cloud(count=400), "chair")
    for name, kind in (("top", "sand"), ("front", "paint")):
        editor.add_region(name)
        mask = np.zeros(400, bool)
        mask[faces(cloud(count=400))[name][:20]] = True
        editor.paint(REFERENCE, name, mask)
        editor.restart_step(name, 0, kind)
    editor.add_target("new.ply", cloud(1.1 * SIZE, 300, 1))
    editor.paint("new", "top", np.arange(300) < 12)
    return folder, json.loads((folder / FILE).read_text())


def opened(valid, folder, text):
    """The altered session as the page shows it, or an NrdfError."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(valid, folder)
    (folder / FILE).write_bytes(text)
    session = outcome_of(lambda: Session(folder))
    if isinstance(session, NrdfError):
        assert (folder / FILE).read_bytes() == text
        return
    if session.damage:
        assert (folder / "damaged-1" / FILE).read_bytes() == text
        assert len(list((folder / "damaged-1" / "clouds").iterdir())) == 2
        return
    editor = Editor(session)
    for key in editor.object_keys():
        body = editor.paintable(key)
        painted = [(r.colour, np.flatnonzero(editor.mask(key, r.name)), None)
                   for r in editor.document.regions]  # fmt: skip
        painted_colours(len(body.points), painted)
    for region in editor.document.regions:
        for number, step in enumerate(region.steps):
            assert np.isfinite(list(shown_numbers(step).values())).all()
            float(step["tool"].get("radius_m", 0.0))
            outcome_of(lambda r=region, n=number: process_of(r, n))
    outcome_of(lambda: bound_knowledge_of(session.clouds, editor.document))
    session.save()
    assert not Session(folder).damage, "what was opened can be opened again"


@tries(60)
@given(st.data())
def test_altered_sessions(valid, tmp_path_factory, data):
    folder, content = valid
    text = json.dumps(data.draw(altered(copy.deepcopy(content)))).encode()
    opened(folder, tmp_path_factory.getbasetemp() / "altered", text)


@tries(40)
@given(st.data())
def test_damaged_sessions(valid, tmp_path_factory, data):
    folder, content = valid
    text = data.draw(damaged(json.dumps(content).encode()))
    opened(folder, tmp_path_factory.getbasetemp() / "damaged", text)
