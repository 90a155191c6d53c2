import numpy as np
import pytest

from builders.regions_of_shapes import bend, box, cap, cushion, plate, ring, tube
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.planners.field_lines import parts_of
from nrdf.toolpath.planners.sheets import ends_of, is_band, is_round_rod, sheets_of, width
from nrdf.toolpath.strategy import Strategy

STRATEGY = Strategy(stepover_m=0.02, spacing_m=0.01, tool_radius_m=0.02)


def cut(region):
    (part,) = parts_of(region, STRATEGY)
    return sheets_of(region, part, STRATEGY)


def test_a_box_is_cut_into_its_six_sides():
    sheets = cut(box())
    areas = [float(sheet.mesh.areas.sum()) for sheet in sheets]
    np.testing.assert_allclose(areas, [0.08, 0.08, 0.012, 0.012, 0.006, 0.006], rtol=1e-6)
    for sheet in sheets:
        assert abs(sheet.outward).max() == pytest.approx(1.0)


@pytest.mark.parametrize("shape", [plate, cap, tube, bend, ring])
def test_what_has_no_crease_stays_whole(shape):
    assert len(cut(shape())) == 1


def test_a_cushion_is_cut_by_the_way_that_it_faces():
    top, other, *edges = cut(cushion())
    assert {np.sign(top.outward[2]), np.sign(other.outward[2])} == {-1.0, 1.0}
    assert min(abs(top.outward[2]), abs(other.outward[2])) > 0.95
    assert all(abs(edge.outward[2]) < 0.5 for edge in edges)


def test_faces_without_area_are_no_sheets():
    region = box()
    thin = np.array([[0.1, 0.2, 0.3], [0.1, 0.2, 0.3], [0.1, 0.2, 0.4]])
    mesh = region.mesh
    vertices = np.concatenate([mesh.vertices, thin])
    faces = np.concatenate([mesh.faces, [[8, 9, 10]]])
    whole = TargetMesh(vertices, faces, ())
    degenerate = RegionMesh.from_faces(whole, np.ones(len(faces), bool))
    part = parts_of(degenerate, STRATEGY)[0]
    assert len(sheets_of(degenerate, part, STRATEGY)) == 6


def test_rods_and_bands_are_told_apart():
    def kinds(region):
        (sheet,) = cut(region)
        return is_band(sheet, STRATEGY), is_round_rod(sheet)

    assert kinds(ring())[0] and not kinds(plate())[0]
    assert kinds(tube()) == (False, True) and kinds(bend()) == (False, True)
    assert kinds(plate()) == (False, False)


def test_ends_and_width_of_a_plate():
    (part,) = parts_of(plate(0.4, 0.04), STRATEGY)
    ends = ends_of(part.mesh)
    assert ends.length_m == pytest.approx(0.4, rel=0.06)
    away = part.mesh.vertices[ends.first, 0].mean() - part.mesh.vertices[ends.last, 0].mean()
    assert abs(away) > 0.37
    assert width(part.mesh) == pytest.approx(0.036, rel=0.02)


def test_a_short_wide_cone_is_worked_around_and_a_long_one_along():
    def kinds(length):
        around = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
        rings = [
            np.column_stack([r * np.cos(around), r * np.sin(around), np.full(48, z)])
            for r, z in ((0.06, 0.0), (0.035, length))
        ]
        k = np.arange(48)
        faces = np.concatenate(
            [
                np.column_stack([k, (k + 1) % 48, 48 + k]),
                np.column_stack([(k + 1) % 48, 48 + (k + 1) % 48, 48 + k]),
            ]
        )
        whole = TargetMesh(np.concatenate(rings), faces, ())
        (sheet,) = cut(RegionMesh.from_faces(whole, np.ones(len(faces), bool)))
        return is_band(sheet, STRATEGY), is_round_rod(sheet)

    assert kinds(0.2)[0] and kinds(1.0) == (False, True)
