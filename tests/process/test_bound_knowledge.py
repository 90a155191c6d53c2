"""Knowledge on its reference: what fits, and what is explained where it does not."""

from __future__ import annotations

import json

import numpy as np
import pytest

from builders.solids import box
from nrdf.errors import CloudError, ProcessError
from nrdf.io.cloud import PointCloud, write_cloud
from nrdf.process.bound_knowledge import checksum, read_bound_knowledge

SAND = {"kind": "sand", "stepover_mm": 15, "tool": {"radius_mm": 25}, "feed_mm_s": 100}
POINTS, NORMALS = box((0.5, 0.9, 0.6), 1500)
TOP = np.flatnonzero(NORMALS[:, 1] > 0.5)
FRONT = np.flatnonzero(NORMALS[:, 0] > 0.5)


@pytest.fixture
def bind_file(tmp_path):
    """Write a reference, whose file says `file_unit`, and knowledge; resolve it."""

    def read(regions=None, file_unit="m", scale=1.0, frame=None, embed=False, changes=(), **rest):
        cloud = PointCloud(POINTS * scale, NORMALS, file_unit, frame)
        write_cloud(tmp_path / "ref.ply", cloud)
        regions = {"top": {"indices": TOP.tolist()}} if regions is None else regions
        rows = [{"name": name, **given, "processes": [SAND]} for name, given in regions.items()]
        embedded = {"points_m": POINTS.tolist(), "normals": NORMALS.tolist()}
        reference = {**(embedded if embed else {"cloud": "ref.ply"}), **rest}
        content = {"category": "chair", "reference": reference, "regions": rows, **dict(changes)}
        (tmp_path / "k.json").write_text(json.dumps(content))
        return read_bound_knowledge(tmp_path / "k.json")

    return read


def test_a_region_may_be_given_in_every_form(bind_file, tmp_path):
    mask = np.zeros(len(POINTS), bool)
    mask[TOP] = True
    np.save(tmp_path / "mask.npy", mask)
    np.savez(tmp_path / "several.npz", top=TOP, front=FRONT)
    write_cloud(tmp_path / "top.ply", PointCloud(POINTS[TOP]))
    forms = (
        {"indices": TOP[::-1].tolist()},
        {"mask": mask.tolist()},
        {"points_m": POINTS[TOP].tolist()},
        {"file": "mask.npy"},
        {"file": "several.npz"},
        {"file": "top.ply"},
    )
    for form in forms:
        bound_knowledge = bind_file({"top": form})
        np.testing.assert_array_equal(bound_knowledge.regions["top"], TOP)


def test_the_reference_is_brought_to_metres_and_its_regions_with_it(bind_file, tmp_path):
    write_cloud(tmp_path / "same.ply", PointCloud(1000 * POINTS[TOP]))
    write_cloud(tmp_path / "other.ply", PointCloud(100 * POINTS[TOP], unit="cm"))
    regions = {"same": {"file": "same.ply"}, "metres": {"points_m": POINTS[FRONT].tolist()}}
    bound_knowledge = bind_file(regions, file_unit="mm", scale=1000, frame="cell")
    np.testing.assert_allclose(bound_knowledge.cloud.points, POINTS, atol=1e-12)
    assert (bound_knowledge.cloud.unit, bound_knowledge.cloud.frame) == ("m", "cell")
    np.testing.assert_array_equal(bound_knowledge.regions["same"], TOP)
    np.testing.assert_array_equal(bound_knowledge.regions["metres"], FRONT)
    other = bind_file({"other": {"file": "other.ply"}}, file_unit="mm", scale=1000)
    np.testing.assert_array_equal(other.regions["other"], TOP)


def test_an_embedded_reference(bind_file):
    bound_knowledge = bind_file(embed=True, frame=None)
    np.testing.assert_allclose(bound_knowledge.cloud.points, POINTS)
    np.testing.assert_allclose(bound_knowledge.cloud.normals, NORMALS)
    half = (0.5 * NORMALS).tolist()
    with pytest.raises(CloudError, match=r"reference.normals must have length 1"):
        bind_file(embed=True, normals=half)


def test_a_unit_that_is_not_said_is_given_or_guessed_and_said(bind_file, caplog):
    bound_knowledge = bind_file(file_unit=None, scale=1000, unit="mm")
    np.testing.assert_allclose(bound_knowledge.cloud.points, POINTS, atol=1e-12)
    assert not caplog.records
    bound_knowledge = bind_file(file_unit=None, scale=1000)
    np.testing.assert_allclose(bound_knowledge.cloud.points, POINTS, atol=1e-12)
    assert "does not say its unit; taken to be mm, because its longest side is 900" in caplog.text
    with pytest.raises(ProcessError, match=r"give reference.unit \(m, cm, mm, in\)"):
        bind_file(file_unit=None, scale=7)


def test_a_wrong_unit_is_noticed(bind_file, caplog):
    with pytest.raises(ProcessError, match=r"reference.unit is mm, but the file says m"):
        bind_file(unit="mm")
    bind_file(scale=1000)
    assert "is 900 m long (a chair is usually 0.4 to 1.6 m long): is its unit, m," in caplog.text


def test_a_checksum_that_does_not_match_is_refused(bind_file, tmp_path):
    bind_file()
    right = checksum(tmp_path / "ref.ply")
    bind_file(sha256=right)
    with pytest.raises(ProcessError) as caught:
        bind_file(scale=1.001, sha256=right)
    assert f"reference.sha256 is {right[:12]}…, but that of" in str(caught.value)
    assert checksum(tmp_path / "ref.ply") in str(caught.value)


def test_a_frame_comes_from_the_file_or_from_the_knowledge(bind_file):
    base = {"reference": {"cloud": "ref.ply", "frame": "base"}}
    assert bind_file(frame="cell").cloud.frame == "cell"
    assert bind_file(changes=base).cloud.frame == "base"
    with pytest.raises(ProcessError, match=r"reference.frame is base, but .* says cell"):
        bind_file(frame="cell", changes=base)


def test_overlapping_regions_are_refused_unless_wanted(bind_file):
    both = np.union1d(TOP[:100], FRONT)
    regions = {"top": {"indices": TOP.tolist()}, "front": {"indices": both.tolist()}}
    with pytest.raises(ProcessError) as caught:
        bind_file(regions)
    said = f"they share 100 of their {len(TOP)} and {len(both)} points"
    assert "regions 'top' and 'front' overlap: " + said in str(caught.value)
    bound_knowledge = bind_file(regions, changes={"allow_overlap": True})
    np.testing.assert_array_equal(bound_knowledge.regions["front"], both)
    # A border's few points may be in both.
    few = np.union1d(TOP[:2], FRONT)
    bind_file({"top": {"indices": TOP.tolist()}, "front": {"indices": few.tolist()}})


def test_every_wrong_region_is_listed(bind_file, tmp_path):
    np.savez(tmp_path / "several.npz", a=TOP, b=FRONT)
    regions = {
        "far": {"points_m": (POINTS[:9] + 1).tolist()},
        "off": {"indices": [0, 1500]},
        "mask": {"mask": [True]},
        "none": {"file": "none.ply"},
        "seat": {"file": "several.npz"},
    }
    with pytest.raises(ProcessError) as caught:
        bind_file(regions)
    said = str(caught.value)
    for part in (
        "5 faults",
        "region 'far': 9 of the region's 9 points are not on the reference",
        "region 'off': a region's indices must lie in 0 to 1499",
        "region 'mask': a region's mask must have one value",
        "region 'none': cannot read",
        "region 'seat': several.npz has no region of that name; it has: a, b",
    ):
        assert part in said


def test_a_reference_that_is_not_there(bind_file):
    with pytest.raises(CloudError, match=r"cannot read .*gone.ply"):
        bind_file(changes={"reference": {"cloud": "gone.ply"}})
