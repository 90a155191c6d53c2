"""The session's file: damaged ones are kept aside, newer ones are refused."""

from __future__ import annotations

import json
import re

import pytest

from builders.studio_page import small_box
from nrdf.errors import OutputError, ProcessError
from nrdf.studio.model.session import Session
from nrdf.studio.model.session_file import FILE


def again(editor):
    """The session as the program finds it when it is started again."""
    return Session(editor.session.folder)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: {**c, "colour": 1}, "unknown key 'colour'"),
        (lambda c: {**c, "reference": {"name": "x", "file": "../../secret.ply"}}, "reference.file"),
        (lambda c: {**c, "reference": {"name": "x", "file": "cloud-9.ply"}}, "no file|cannot read"),
        (lambda c: {**c, "regions": [{**c["regions"][0], "indices": [10**6]}]}, "does not have"),
        (lambda c: {**c, "regions": [{**c["regions"][0], "colour": [300, 0, 0]}]}, "255"),
        (lambda c: {**c, "regions": [{**c["regions"][0], "steps": []}]}, "regions.0.steps"),
        (lambda c: {**c, "regions": [{**c["regions"][0], "name": "../x"}]}, "regions.0.name"),
        (lambda c: {**c, "regions": [*c["regions"], *c["regions"]]}, "twice"),
        (lambda c: {**c, "targets": [{**c["targets"][0], "name": ".."}]}, "targets.0.name"),
        (lambda c: {**c, "targets": [{**c["targets"][0], "name": "a/b"}]}, "targets.0.name"),
        (lambda c: {**c, "targets": [{**c["targets"][0], "name": "reference"}]}, "no name"),
        (lambda c: {**c, "version": 0}, "version"),
        (lambda c: [], "must be a mapping"),
    ],
)
def test_a_session_that_is_damaged_is_kept_aside_whole(painted, change, message):
    painted.add_target("other.ply", small_box(seed=1))
    folder = painted.session.folder
    path = folder / FILE
    path.write_text(json.dumps(change(json.loads(path.read_text()))))
    before = {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    fresh = again(painted)
    assert re.search(message, fresh.damage) and "damaged-1" in fresh.damage
    assert fresh.document.reference is None and not fresh.restored
    aside = folder / "damaged-1"
    after = {p.relative_to(aside): p.read_bytes() for p in aside.rglob("*") if p.is_file()}
    assert after == before
    assert again(painted).damage == "", "the new one is whole"


def test_a_session_of_a_newer_version_is_left_alone(painted):
    path = painted.session.folder / FILE
    content = {**json.loads(path.read_text()), "version": 9, "arms": []}
    path.write_text(json.dumps(content))
    with pytest.raises(ProcessError, match=r"from a newer nrdf.*--session"):
        again(painted)
    assert json.loads(path.read_text()) == content


def test_a_session_file_that_is_no_file_is_said(painted):
    path = painted.session.folder / FILE
    path.unlink()
    path.mkdir()
    with pytest.raises(OutputError, match="--session"):
        again(painted)
