from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from nrdf.geometry.mesh import Mesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.mesh_projection import project_to_mesh
from nrdf.toolpath.types import Segment

STANDOFF = 0.05
DOWN = Rotation.from_euler("x", 90, degrees=True).as_quat()  # tool z along -y


@pytest.fixture(scope="module")
def plate() -> TargetMesh:
    """A plate of 1 m by 1 m and 10 mm, its top at y = 0."""
    box = trimesh.creation.box((1.0, 0.01, 1.0)).apply_translation((0.0, -0.005, 0.0))
    return TargetMesh.from_mesh(Mesh(np.array(box.vertices), np.array(box.faces)))


def path(heights) -> list[Segment]:
    """Approach, process and retract over the plate; the contacts are at heights (n,)."""
    heights = np.asarray(heights, dtype=float)
    x = np.linspace(-0.2, 0.2, len(heights))
    line = np.stack([x, heights + STANDOFF, np.zeros(len(x))], axis=1)
    away = np.array([0.0, 0.1, 0.0])
    held = np.tile(DOWN, (len(x), 1))
    return [
        Segment("approach", 0, np.stack([line[0] + away, line[0]]), held[:2], 0.2),
        Segment("process", 0, line, held, 0.1, 10.0),
        Segment("retract", 0, np.stack([line[-1], line[-1] + away]), held[:2], 0.2),
    ]


def test_contacts_come_to_lie_on_the_side_that_the_tool_is_on(plate):
    # The lowest contact is nearer to the plate's underside than to its top.
    segments = project_to_mesh(path([0.004, -0.003, -0.008]), plate, STANDOFF, 0.02)
    np.testing.assert_allclose(segments[1].positions[:, 1], STANDOFF, atol=1e-9)


def test_approach_and_retract_still_end_at_the_line(plate):
    approach, process, retract = project_to_mesh(path([0.004, 0.0, -0.003]), plate, STANDOFF, 0.02)
    np.testing.assert_allclose(approach.positions[-1], process.positions[0])
    np.testing.assert_allclose(retract.positions[0], process.positions[-1])
    np.testing.assert_allclose(approach.positions[0] - approach.positions[1], [0.0, 0.1, 0.0])


def test_a_contact_without_surface_nearby_stays(plate):
    before = path([0.0, 0.05, 0.0])
    after = project_to_mesh(before, plate, STANDOFF, 0.02)
    np.testing.assert_allclose(after[1].positions[1], before[1].positions[1])
