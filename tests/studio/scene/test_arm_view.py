"""An arm in the scene works on the object as in the simulation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation


def test_the_pad_is_on_the_object_in_the_scene_too(playback, scene_view, plate_cloud):
    from nrdf.studio.scene.arm_view import ArmView

    plate = plate_cloud
    object_view = scene_view.add("plate", plate)
    scene_view.arrange(["plate"])
    stood, scale = object_view.offset, scene_view.units_per_m
    arm_view = ArmView(object_view, playback)
    pad = next(s for s in playback.shapes if s.path == 0 and s.colour[0] > 2 * s.colour[2])
    frames = {handle.name: handle for handle in (arm_view._root, *arm_view._bodies.values())}

    def placed(name, points):
        frame = frames[name]
        turn = Rotation.from_quat(np.roll(frame.wxyz, -1))
        return turn.apply(points) + frame.position

    for at in np.flatnonzero(playback.motion == "process")[20::40]:
        arm_view.show(int(at))
        active = arm_view._active_line.points / scale
        pad_at = playback.lines[0][int(playback.line[at])][0]
        assert abs(active.reshape(-1, 3).mean(axis=0) - pad_at.mean(axis=0)).max() < 0.02
        scene = placed(
            "/arm", placed(f"/arm/body{pad.body}", pad.vertices * scene_view.units_per_m)
        )
        down = np.array([0.0, -1.0, 0.0])
        met = scene_view.hit(scene.mean(axis=0) - down, down)
        assert met is not None, "the object is below the pad, turned as the turntable is"
        turned = Rotation.from_quat(np.roll(object_view.frame.wxyz, -1))
        assert turned.magnitude() == pytest.approx(playback.turntable_rad[at])
        point = (
            turned.apply(plate.points[met[1]] * scene_view.units_per_m) + object_view.frame.position
        )
        assert scene[:, 1].min() == pytest.approx(point[1], abs=0.006 * scale)
    between = int(np.flatnonzero(playback.line < 0)[0])
    arm_view.show(between)
    assert arm_view._active_line is None, "between lines none is worked on"
    seen = arm_view.occupied_points
    assert len(seen) and seen[:, 1].min() < 0.0, "the column's foot is below the raised object"
    arm_view.remove()
    np.testing.assert_allclose(object_view.offset, stood, atol=1e-12)
    assert object_view.frame.wxyz[0] == pytest.approx(1.0)
