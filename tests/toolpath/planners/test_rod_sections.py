import numpy as np

from builders.regions_of_shapes import bend, flipped, tube
from nrdf.surface.fine_mesh import refine
from nrdf.toolpath.planners.rod_sections import RodFrame, sections, straightened, untorn


def fine(region):
    return refine(region.mesh.vertices, region.mesh.faces, 0.009)


def test_the_frame_of_a_bend_follows_it_and_stations_are_its_arc_length():
    angle = np.linspace(0.0, np.pi / 2, 60)
    axis = 0.2 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    frame = RodFrame.of(axis, 0.04)
    asked = 0.21 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    at = frame.station(asked)
    np.testing.assert_allclose(np.diff(at), 0.2 * np.diff(angle), rtol=0.1)
    up = np.abs(frame.right[:, 2]) + np.abs(frame.up[:, 2])
    np.testing.assert_allclose(up, up[0], atol=1e-6)  # it does not turn about the axis


def test_sections_of_a_tube_are_circles_counterclockwise():
    mesh = fine(flipped(tube()))  # its outer side outward
    frame = RodFrame.of(np.array([[0.0, 0, 0], [0.4, 0, 0]]), 0.06)
    low = float(frame.station(np.zeros((1, 3)))[0])
    for section in sections(mesh, frame, low + np.array([0.1, 0.3])):
        assert section is not None and section.gap_m == 0.0
        assert abs(section.length_m - 2 * np.pi * 0.03) < 0.002
        x, y = section.flat.T
        assert 0.5 * (x[:-1] * np.diff(y) - y[:-1] * np.diff(x)).sum() > 0.0
    assert sections(mesh, frame, np.array([low + 0.45])) == [None]


def test_a_slot_is_a_gap():
    mesh = fine(tube())
    cut = mesh.part((mesh.centres[:, 1] < 0.02) | (np.abs(mesh.centres[:, 0] - 0.2) > 0.05))
    frame = RodFrame.of(np.array([[0.0, 0, 0], [0.4, 0, 0]]), 0.06)
    low = float(frame.station(np.zeros((1, 3)))[0])
    whole, slotted = sections(cut, frame, low + np.array([0.1, 0.2]))
    assert whole is not None and whole.gap_m == 0.0
    assert slotted is not None and 0.02 < slotted.gap_m < 0.07


def test_an_axis_that_is_off_is_brought_to_the_middle():
    off = np.array([[0.03, 0.01, 0.0], [0.2, 0.0, 0.01], [0.37, -0.01, 0.0]])
    frame = straightened(fine(tube()), off, 0.06)
    inside = (frame.points[:, 0] > 0.02) & (frame.points[:, 0] < 0.38)
    assert np.abs(frame.points[inside, 1:]).max() < 0.003


def test_a_ring_is_torn_at_its_seam_only():
    mesh = fine(bend(turn=2 * np.pi))
    angle = np.linspace(0.1, 2 * np.pi - 0.1, 200)
    axis = 0.2 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    frame = RodFrame.of(axis, 0.04)
    kept = untorn(mesh, frame, 0.04)
    assert 0.9 < kept.areas.sum() / mesh.areas.sum() < 1.0
    assert np.ptp(frame.station(kept.vertices)) > 1.15
