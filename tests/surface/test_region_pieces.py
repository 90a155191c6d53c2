"""Specks and holes of regions."""

import numpy as np
import pytest

from builders.regions_of_shapes import plate
from nrdf.surface.fine_mesh import FineMesh, refine
from nrdf.surface.region_pieces import Pieces


@pytest.fixture(scope="module")
def sheet() -> FineMesh:
    """0.4 m by 0.2 m."""
    mesh = plate().mesh
    return refine(mesh.vertices, mesh.faces, 0.006)


def near(sheet: FineMesh, x: float, y: float, radius: float) -> np.ndarray:
    return np.linalg.norm(sheet.centres[:, :2] - [x, y], axis=1) < radius


def test_specks_go(sheet):
    large, speck = near(sheet, 0.1, 0.1, 0.08), near(sheet, 0.3, 0.1, 0.02)
    kept, removed = Pieces(sheet).without_specks(large | speck, 0.002)
    assert (kept == large).all()
    assert removed == pytest.approx([sheet.areas[speck].sum()])


def test_holes_are_filled_unless_they_are_large_taken_or_open(sheet):
    small, large = near(sheet, 0.08, 0.1, 0.02), near(sheet, 0.2, 0.1, 0.04)
    taken, notch = near(sheet, 0.32, 0.1, 0.02), near(sheet, 0.08, 0.0, 0.02)
    inside = ~(small | large | taken | notch)
    whole, filled, kept = Pieces(sheet).without_holes(inside, taken, 0.002)
    assert (whole == inside | small).all()
    assert filled == pytest.approx([sheet.areas[small].sum()])
    assert kept == pytest.approx([sheet.areas[large].sum()])
    assert (Pieces(sheet).without_holes(inside, taken, np.inf)[0] == ~(taken | notch)).all()


def test_known_regions_change_nothing(sheet):
    large, speck = near(sheet, 0.1, 0.1, 0.08), near(sheet, 0.3, 0.1, 0.02)
    hole = near(sheet, 0.1, 0.1, 0.02)
    inside = (large & ~hole) | speck
    known = Pieces(sheet, np.stack([inside, hole]))
    for asked in (known, Pieces(sheet)):
        kept, removed = asked.without_specks(inside, 0.002)
        whole, filled, _ = asked.without_holes(kept, np.zeros(len(inside), bool), 0.002)
        assert (whole == large).all()
        assert removed == pytest.approx([sheet.areas[speck].sum()])
        assert filled == pytest.approx([sheet.areas[hole].sum()])
