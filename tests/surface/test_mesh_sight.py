"""What can be seen of a mesh from outside."""

import numpy as np
import trimesh

from nrdf.surface.mesh_sight import Seen

INNER = np.arange(12)


def nested() -> tuple[np.ndarray, np.ndarray]:
    """A box within a box."""
    both = trimesh.util.concatenate(
        [trimesh.creation.box((0.5, 0.5, 0.5)), trimesh.creation.box((1.0, 1.0, 1.0))]
    )
    return np.asarray(both.vertices), np.asarray(both.faces)


def test_only_the_outer_one_of_two_nested_boxes_is_seen_on_all_sides():
    vertices, faces = nested()
    seen = Seen.of(vertices, faces, np.random.default_rng(0))
    assert set(seen.faces) == set(range(12, 24))
    assert np.abs(np.abs(seen.points).max(axis=1) - 0.5).max() < 1e-6  # rays have single precision


def test_a_missing_side_is_lost_and_a_missing_inside_is_not():
    vertices, faces = nested()
    seen = Seen.of(vertices, faces, np.random.default_rng(0))
    assert not seen.lost(vertices, faces[12:]).any()
    assert 0.1 < seen.lost(vertices, faces[14:]).mean() < 0.25
    assert seen.lost(vertices, faces[:12]).all()
