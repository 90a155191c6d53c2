"""Inside and outside; no cloud and no mesh ends the process, so all is asked in another one."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from builders.awkward import SCALES, clouds
from builders.solids import box
from nrdf.errors import CloudError, DataError
from nrdf.geometry.winding import WindingNumber, mesh_winding_numbers

BOX = np.array([0.4, 0.6, 1.0])


@pytest.fixture(scope="module")
def elsewhere():
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        yield lambda *call: pool.submit(*call).result(timeout=120)


def wound(points, normals, places):
    return WindingNumber(points, normals)(places)


def cube_mesh():
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return corners - 0.5, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


@given(clouds())
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_no_cloud_ends_the_process(elsewhere, cloud):
    points, normals = cloud
    with np.errstate(over="ignore"):
        places = np.concatenate([points[:20], 1.5 * points[:20] + points[:1], np.zeros((1, 3))])
    places = places[np.isfinite(places).all(axis=1)]
    assert np.isfinite(elsewhere(wound, points, normals, places)).all()


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("repeated", [0, 1, 500, 4000])
def test_inside_is_told_with_repeated_points_at_every_scale(elsewhere, scale, repeated):
    points, normals = box(BOX, 2000)
    again = np.random.default_rng(1).integers(0, len(points), repeated)
    points, normals = np.concatenate([points, points[again]]), np.r_[normals, normals[again]]
    places = np.array([[0.0, 0, 0], [0.15, 0.2, 0.4], [0.3, 0, 0], [0, 0.5, 0], [9.0, 9, 9]])
    found = elsewhere(wound, points * scale, normals, places * scale)
    assert np.abs(found - [1, 1, 0, 0, 0]).max() < 0.15


def test_a_few_repeated_points_change_nothing():
    points, normals = box(BOX, 2000)
    places = np.random.default_rng(0).uniform(-0.5, 0.5, (200, 3))
    alone = WindingNumber(points, normals)(places)
    twice = WindingNumber(np.r_[points, points[:50]], np.r_[normals, normals[:50]])(places)
    assert np.abs(alone - twice).max() < 1e-9


def test_the_two_sides_of_a_sheet_without_thickness_enclose_nothing():
    rng = np.random.default_rng(0)
    sheet = np.c_[rng.uniform(-0.5, 0.5, (1000, 2)), np.zeros(1000)]
    up = np.tile([0.0, 0.0, 1.0], (1000, 1))
    found = WindingNumber(np.r_[sheet, sheet], np.r_[up, -up])(rng.uniform(-0.5, 0.5, (200, 3)))
    assert np.abs(found).max() < 1e-9


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("what", ["points", "normals", "places"])
def test_what_is_not_finite_is_refused(what, wrong):
    given = {"points": np.eye(3), "normals": np.eye(3), "places": np.eye(3)}
    given[what][1, 1] = wrong
    with pytest.raises(CloudError, match="finite"):
        WindingNumber(given["points"], given["normals"])(given["places"])


def test_normals_that_do_not_fit_are_refused():
    with pytest.raises(CloudError, match="as many"):
        WindingNumber(np.eye(3), np.eye(3)[:2])
    with pytest.raises(CloudError, match="as many"):
        WindingNumber(np.zeros((0, 3)), np.zeros((0, 3)))


def damaged(name):
    vertices, faces = cube_mesh()
    if name == "no faces":
        return vertices, faces[:0]
    if name == "nothing":
        return vertices[:0], faces[:0]
    if name == "face beyond":
        faces[3, 1] = 10**6
    if name == "negative face":
        faces[3, 1] = -(10**7)
    if name == "all NaN":
        vertices[:] = np.nan
    if name == "one NaN":
        vertices[2, 0] = np.nan
    return vertices, faces


@pytest.mark.parametrize(
    "name", ["no faces", "nothing", "face beyond", "negative face", "all NaN", "one NaN"]
)
def test_a_damaged_mesh_is_refused(elsewhere, name):
    with pytest.raises(DataError):
        elsewhere(mesh_winding_numbers, *damaged(name), np.zeros((5, 3)))


@pytest.mark.parametrize("scale", SCALES)
def test_a_mesh_of_any_scale_tells_inside(elsewhere, scale):
    vertices, faces = cube_mesh()
    places = np.array([[0.0, 0, 0], [0.4, 0.4, 0.4], [0.6, 0, 0], [3.0, 3, 3]])
    found = elsewhere(mesh_winding_numbers, vertices * scale, faces, places * scale)
    assert np.abs(np.abs(found) - [1, 1, 0, 0]).max() < 0.01


@given(st.integers(0, 2**32 - 1), clouds(least=3, most=60))
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_no_mesh_ends_the_process(elsewhere, seed, cloud):
    vertices = cloud[0]
    faces = np.random.default_rng(seed).integers(0, len(vertices), (2 * len(vertices), 3))
    found = elsewhere(mesh_winding_numbers, vertices, faces, vertices[:20])
    assert found.shape == (min(len(vertices), 20),)
