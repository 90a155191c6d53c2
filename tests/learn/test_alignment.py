"""Objects in any heading come into one frame, and other objects among them are told."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from builders.desk_lamps import write_lamps
from nrdf.geometry.similarity import up_axis, upright
from nrdf.learn.alignment import (
    AlignedObject,
    AlignedObjects,
    align_objects,
    better_axis,
    find_prototype,
)
from nrdf.learn.objects import find_files, read_objects, turned


@pytest.fixture(scope="module")
def shapes(tmp_path_factory):
    """Six lamps, the fourth turned by 100°, and a ball."""
    folder = tmp_path_factory.mktemp("lamps")
    write_lamps(folder, 6, {3: np.radians(100)})
    trimesh.creation.icosphere().export(folder / "ball.ply")
    files = find_files(folder)
    return read_objects(files, folder, "lamp", "y", folder.parent / "read").shapes


def test_a_turned_object_is_turned_back_and_a_strange_one_left_out(shapes):
    told = []
    found = align_objects(shapes, progress=lambda *n: told.append(n))
    assert [one.shape.name for one in found.odd] == ["ball.ply"]
    assert found.as_given and found.prototype != "ball.ply"
    yaws = {one.shape.name: np.degrees(one.yaw) for one in found.objects}
    assert all(yaws[f"lamp{n}.ply"] == 0 for n in (0, 1, 2, 4, 5))
    assert abs(abs(yaws["lamp3.ply"]) - 100) < 6
    for one in found.objects:  # the post is at the rear end, upright in the middle
        points = one.shape.surface_points
        middle = points[np.abs(points[:, 1]) < 0.1]
        assert middle[:, 0].mean() < -0.1 and abs(middle[:, 2].mean()) < 0.05
    assert not any(one.mirrored for one in found.objects)
    assert told[-1] == (14, 14)


def test_the_named_file_gives_the_heading(shapes):
    found = align_objects([s for s in shapes if s.name != "ball.ply"], forward="lamp3.ply")
    yaws = {one.shape.name: np.degrees(one.yaw) for one in found.objects}
    assert yaws["lamp3.ply"] == 0
    assert all(abs(abs(yaws[f"lamp{n}.ply"]) - 100) < 6 for n in (0, 1, 2, 4, 5))


def test_the_prototype_is_like_most_whatever_the_headings(shapes):
    turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    spun = [turned(shape, turn) if n % 2 else shape for n, shape in enumerate(shapes)]
    assert shapes[find_prototype(shapes)].name == spun[find_prototype(spun)].name != "ball.ply"


def test_the_axis_about_which_objects_fit_better_is_found(shapes):
    lamps = [shape for shape in shapes if shape.name != "ball.ply"][:3]
    lying = [turned(shape, upright(up_axis("z")).T) for shape in lamps]
    badly = [AlignedObject(shape, 0.0, False, 1.3) for shape in lying]
    assert better_axis(lying, AlignedObjects(badly, [], "lamp0.ply", True)) in ("x", "z")
    well = [AlignedObject(shape, 0.0, False, 0.5) for shape in lamps]
    assert better_axis(lamps, AlignedObjects(well, [], "lamp0.ply", True)) == ""
