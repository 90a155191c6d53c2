"""The joint trajectories as files: CSV, a ROS 2 bag of trajectory_msgs, URScript."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from nrdf.errors import RobotError
from nrdf.export.names import identifier
from nrdf.io.atomic import output_errors, write_atomically
from nrdf.io.file_names import spreadsheet_text
from nrdf.robot.planning.timing import STEP_S
from nrdf.robot.simulation.execute import ExecutionLog
from nrdf.robot.simulation.simulate import SimulationResult

CSV, BAG, SCRIPT = "joints.csv", "joints.bag", "joints.script"
EVERY = 10  # steps of the simulation between rows
_TYPE = "trajectory_msgs/msg/JointTrajectory"


def written_steps(log: ExecutionLog) -> np.ndarray:
    """Steps of an action that are written: every tenth, and the last."""
    return np.unique(np.append(np.arange(0, len(log.joints), EVERY), len(log.joints) - 1))


def write_csv(folder: Path, result: SimulationResult) -> None:
    """Time, action, turntable angle, joints (rad) and force (N), a row every 40 ms."""
    names = ",".join(map(_quoted, result.arm.joint_names))
    lines = [f"time_s,region,process,action,line,turntable_rad,{names},force_n"]
    clock = 0.0
    for simulated in result.paths:
        label = f"{_quoted(simulated.path.region)},{_quoted(simulated.path.process)}"
        for log in simulated.logs:
            action = log.action
            line = "" if action.group < 0 else simulated.line(log)
            angle = simulated.cell.turntable_rad[action.turntable_index]
            for i in written_steps(log):
                joints = ",".join(f"{x:.6f}" for x in log.joints[i])
                when = clock + i * STEP_S
                lines.append(
                    f"{when:.3f},{label},{action.kind},{line},{angle:.6f},{joints},"
                    f"{log.force_n[i]:.3f}"
                )
            clock += len(log.joints) * STEP_S
    write_atomically(folder / CSV, ["\n".join([*lines, ""]).encode()])


def _quoted(name: str) -> str:
    name = spreadsheet_text(name)
    return '"' + name.replace('"', '""') + '"' if any(c in name for c in ',"\r\n') else name


def write_bag(folder: Path, result: SimulationResult) -> bool:
    """A JointTrajectory for each move, on a topic a tool path; False where rosbags is missing."""
    try:
        from rosbags.rosbag2 import Writer
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        return False
    store = get_typestore(Stores.ROS2_HUMBLE)
    types: Any = store.types
    names = list(result.arm.joint_names)

    def seconds(kind: str, value: float) -> Any:
        whole, rest = divmod(round(value * 1e9), 1_000_000_000)
        return types[kind](whole, rest)

    with output_errors(folder / BAG), Writer(folder / BAG, version=8) as writer:
        clock = 0.0
        for number, simulated in enumerate(result.paths, 1):
            topic = f"/nrdf/{identifier(f'p{number} {simulated.path.region}', 48)}/joint_trajectory"
            connection = writer.add_connection(topic, _TYPE, typestore=store)
            for log in simulated.logs:
                none = np.zeros(0)
                points = [
                    types["trajectory_msgs/msg/JointTrajectoryPoint"](
                        log.joints[i].copy(), none, none, none,
                        seconds("builtin_interfaces/msg/Duration", i * STEP_S),
                    )
                    for i in written_steps(log)
                ]  # fmt: skip
                stamp = seconds("builtin_interfaces/msg/Time", clock)
                header = types["std_msgs/msg/Header"](stamp, "base")
                message = types[_TYPE](header, names, points)
                writer.write(connection, round(clock * 1e9), store.serialize_cdr(message, _TYPE))
                clock += len(log.joints) * STEP_S
    return True


def write_script(folder: Path, result: SimulationResult) -> None:
    """servoj for every row; stops where the turntable must be turned or the tool changed.

    Raises RobotError for an arm of other than six axes, which no UR is.
    """
    if len(result.arm.joint_names) != 6:
        raise RobotError("URScript is for arms of six axes")
    step = EVERY * STEP_S
    lines = [
        f"# Joint trajectories that nrdf simulated for {result.arm.name}.",
        "# Contact force is not commanded here: nrdf export --format urscript has force_mode.",
        "# Before use: the base stands as the report says, and nothing else is in reach.",
        "def nrdf_joints():",
    ]
    tool = None
    for simulated in result.paths:
        if simulated.path.tool != tool:
            tool = simulated.path.tool
            lines.append(f'  popup("Mount: {_plain(tool)}", title="nrdf", blocking=True)')
        for log in simulated.logs:
            if log.action.kind == "turntable":
                degrees = np.degrees(simulated.cell.turntable_rad[log.action.turntable_index])
                lines.append(
                    f'  popup("Turn the object to {degrees:.1f} degrees", title="nrdf",'
                    " blocking=True)"
                )
                lines.append(f"  movej({_joints(log.joints[-1])}, a=0.5, v=0.3)")
                continue
            lines += [
                f"  servoj({_joints(log.joints[i])}, t={step:.3f}, lookahead_time=0.1, gain=300)"
                for i in written_steps(log)
            ]
            lines.append("  stopj(2.0)")
    write_atomically(folder / SCRIPT, ["\n".join([*lines, "end", ""]).encode()])


def _joints(values: np.ndarray) -> str:
    return "[" + ", ".join(f"{x:.6f}" for x in values) + "]"


def _plain(name: str) -> str:
    return "".join(c for c in name if c.isascii() and c.isprintable() and c not in '"\\')
