import numpy as np

from builders.regions_of_shapes import bend, plate, sheet, tube
from nrdf.geometry.polylines import total_length
from nrdf.surface.fine_mesh import FineMesh, refine
from nrdf.toolpath.planners.reeb_graph import touching_faces
from nrdf.toolpath.planners.rod_skeleton import split_at_branches

NONE = np.zeros((0, 2), int)


def fine(region) -> FineMesh:
    return refine(region.mesh.vertices, region.mesh.faces, 0.009)


def test_a_tube_and_a_bend_have_one_axis_in_their_middle():
    for region, far in ((tube(), None), (bend(), 0.2)):
        (axis,), number = split_at_branches(fine(region), NONE, 1e-3)
        assert not number.any()
        middle = axis.points[len(axis.points) // 4 : -len(axis.points) // 4]
        away = np.linalg.norm(middle[:, 1:] if far is None else middle, axis=1)
        np.testing.assert_allclose(away, far or 0.0, atol=0.004)
    assert np.isclose(
        split_at_branches(fine(tube()), NONE, 1e-3)[0][0].thickness_m, 0.06, rtol=0.15
    )


def test_a_plate_has_no_axis_that_is_longer_than_it_is_wide():
    axes, number = split_at_branches(fine(plate(0.2, 0.2)), NONE, 0.1)
    assert axes == [] and (number == -1).all()


def test_a_sharp_bend_is_two_rods():
    def place(u, v):
        # A square tube, first along x, then along y, mitred.
        side = 0.015 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1]])
        at = np.minimum(u * 4, 3.999).astype(int)
        share = (u * 4 - at)[:, None]
        cut = (1 - share) * side[at] + share * side[at + 1]
        along = 0.5 * np.abs(v - 0.5)
        first = np.stack([-along + cut[:, 0], cut[:, 0], cut[:, 1]], axis=1)
        second = np.stack([cut[:, 0], -along + cut[:, 0], cut[:, 1]], axis=1)
        return np.where((v < 0.5)[:, None], first, second)

    mesh = fine(sheet(place, 2, 4))
    axes, number = split_at_branches(mesh, NONE, 1e-3)
    assert len(axes) == 2
    main = [np.abs(np.diff(axis.points[[0, -1]], axis=0))[0].argmax() for axis in axes]
    assert sorted(main) == [0, 1]
    for k, axis in zip(main, range(2), strict=True):
        assert mesh.centres[number == axis, k].min() < -0.2


def test_a_tube_cut_along_itself_is_still_one_rod():
    mesh = fine(tube())
    upper = mesh.centres[:, 2] > 0
    parts = [mesh.part(upper), mesh.part(~upper)]
    shift = len(parts[0].vertices)
    apart = FineMesh(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([parts[0].faces, parts[1].faces + shift]),
        np.arange(len(mesh.faces)),
        mesh.edge_m,
    )
    touching = touching_faces(apart)
    assert len(touching) and len(split_at_branches(apart, touching, 1e-3)[0]) == 1
    (axis,), _ = split_at_branches(apart, touching, 1e-3)
    assert total_length(axis.points) > 0.3 and abs(axis.thickness_m - 0.06) < 0.01
