"""Changes of a session: names, corrections, process steps."""

from __future__ import annotations

import pytest

from builders.studio_page import face, small_box
from nrdf.errors import ProcessError, RegionError
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.teaching import bound_knowledge_of, process_of


def test_names_of_regions(painted):
    painted.add_region("front")
    with pytest.raises(RegionError, match="'top' already"):
        painted.rename_region("front", "top")
    for name in ("", "../x", "a/b", "a" * 101):
        with pytest.raises(RegionError, match="no name for a region"):
            painted.rename_region("front", name)
    painted.rename_region("front", " left side ")
    assert [r.name for r in painted.document.regions] == ["top", "left side"]
    assert painted.add_region("top") == "top-2" and painted.add_region() == "region-1"


def test_corrections_follow_their_region(painted):
    painted.add_target("other.ply", small_box(seed=1))
    painted.paint("other", "top", face(painted.paintable("other").cloud, "top"))
    painted.rename_region("top", "lid")
    assert list(painted.target("other").corrected) == ["lid"]
    painted.discard_corrections("other")
    assert not painted.target("other").corrected
    painted.paint("other", "lid", face(painted.paintable("other").cloud, "top"))
    painted.remove_region("lid")
    assert not painted.target("other").corrected


def test_names_of_targets_are_no_paths_and_differ(painted):
    names = [painted.add_target("../../etc/passwd.ply", small_box(seed=1)) for _ in range(2)]
    assert names == ["passwd", "passwd-2"]
    files = sorted(p.name for p in (painted.session.folder / "clouds").iterdir())
    assert files == ["cloud-1.ply", "cloud-2.ply", "cloud-3.ply"]
    painted.remove_target("passwd")
    assert painted.object_keys() == [REFERENCE, "passwd-2"]


def test_overlaps_are_reported(painted):
    painted.add_region("front")
    painted.paint(REFERENCE, "front", painted.document.region("top").mask)
    assert "top" in painted.overlaps()[0] and "front" in painted.overlaps()[0]
    with pytest.raises(ProcessError, match="overlap"):
        bound_knowledge_of(painted.session.clouds, painted.document)
    painted.allow_overlap(True)
    assert len(bound_knowledge_of(painted.session.clouds, painted.document).regions) == 2


def test_steps(painted):
    assert painted.add_step("top", "oil") == 1
    painted.change_step("top", 1, trajectory="spiral", direction=[1.0, 0.0, 0.0])
    painted.change_step("top", 1, direction=None)
    oil = process_of(painted.document.region("top"), 1)
    assert (oil.kind, oil.trajectory, oil.direction) == ("oil", "spiral", None)
    painted.restart_step("top", 0, "paint")
    assert process_of(painted.document.region("top"), 0).standoff_m == pytest.approx(0.2)
    painted.remove_step("top", 0)
    with pytest.raises(RegionError, match="at least one process"):
        painted.remove_step("top", 0)
