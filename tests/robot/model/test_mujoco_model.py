from __future__ import annotations

import pytest

from nrdf.errors import RobotError
from nrdf.robot.model.arm import BUNDLED, load_arm
from nrdf.robot.model.mujoco_model import compile_arm, delete_scene_parts, read_arm_file


def test_a_missing_robot_file():
    with pytest.raises(RobotError, match=r"no robot file nowhere\.urdf; give a URDF or MJCF file"):
        load_arm("nowhere.urdf")


def test_a_robot_file_that_does_not_load(tmp_path):
    file = tmp_path / "arm.xml"
    file.write_text("<mujoco><worldbody><body>")
    with pytest.raises(RobotError, match="does not load as URDF or MJCF"):
        load_arm(file)


def test_a_floor_and_lights_are_no_part_of_an_arm(tmp_path):
    file = tmp_path / "scene.xml"
    text = BUNDLED.read_text()
    scene = '<worldbody><light pos="0 0 1"/><geom name="floor" type="plane" size="1 1 1"/>'
    file.write_text(text.replace("<worldbody>", scene, 1))
    spec, told = read_arm_file(file)
    assert told == [] and compile_arm(spec.copy(), file).nlight == 1
    delete_scene_parts(spec)
    model = compile_arm(spec, file)
    assert model.nlight == 0
    assert "floor" not in [model.geom(i).name for i in range(model.ngeom)]
