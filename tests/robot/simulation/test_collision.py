from __future__ import annotations

from dataclasses import replace

import numpy as np

from nrdf.robot.simulation.collision import clearances, find_collisions


def test_an_execution_that_keeps_clear_has_no_collision(plate):
    path = plate.paths[0]
    for log in path.logs:
        assert not find_collisions(path.cell, "top", path.path.groups, log)


def test_a_raised_object_is_touched_where_and_when_it_is(plate):
    path = plate.paths[0]
    raised = path.cell.shifted(np.array([0.0, 0.06, 0.0]))
    log = next(log for log in path.logs if log.action.kind == "process")
    (found,) = find_collisions(raised, "top", path.path.groups, log)
    assert found.collision.what == "object" and found.collision.kind == "process"
    assert found.collision.line == path.path.groups[log.action.group].process.line
    assert 0.0 < found.collision.depth_m < 0.1
    assert len(found.steps) == len(log.joints) and found.steps.any()


def test_while_the_turntable_turns_the_object_is_where_it_has_turned_to(plate):
    path = plate.paths[0]
    log = path.logs[0]
    count = len(log.joints)
    turning = replace(log.action, kind="turntable", angles_rad=np.linspace(0.0, np.pi, count))
    assert not find_collisions(path.cell, "top", path.path.groups, replace(log, action=turning))


def test_clearances_tell_object_floor_and_arm_apart(plate):
    cell = plate.paths[0].cell
    joints = np.concatenate([log.joints[-1:] for log in plate.paths[0].logs])
    found = clearances(cell, joints, np.zeros(len(joints), int))
    assert set(found) == {"object", "floor", "keep-out box", "itself"}
    both = np.minimum(found["object"], found["floor"])
    least = cell.clearance(cell.chain.frames(joints), np.zeros(len(joints), int)).least
    np.testing.assert_allclose(both, least)
