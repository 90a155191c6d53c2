"""Patches that look to one side."""

from __future__ import annotations

import numpy as np

from builders.regions_of_shapes import tube
from nrdf.surface.fine_mesh import refine
from nrdf.surface.mesh_patches import Patches


def test_patches_are_small_and_of_one_side():
    fine = refine(tube().mesh.vertices, tube().mesh.faces, 0.01)
    patches = Patches.of(fine, 0.03)
    number, nearest = patches.number, patches.nearest
    assert len(nearest) == number.max() + 1 < len(fine.faces) / 3
    np.testing.assert_array_equal(number[nearest], np.arange(len(nearest)))
    assert np.abs(fine.centres - fine.centres[nearest[number]]).max() <= 0.03
    np.testing.assert_array_equal(patches.to_triangles(nearest), nearest[number])
    assert np.einsum("fa,fa->f", fine.normals, fine.normals[nearest[number]]).min() > 0.0
