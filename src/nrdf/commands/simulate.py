"""`nrdf simulate`: a job on an arm, before anything moves."""

from __future__ import annotations

from typing import Annotated, Any

from tyro.conf import Positional

from nrdf.commands.console import command_line, console, errors, progress_bar, show, table, versions
from nrdf.commands.options import Axis, File, Folder, Metavar
from nrdf.io.bounds import FINITE, Count, NonNegative, Seed


def simulate(
    job: Positional[Folder],
    out: Folder | None = None,
    cell: File | None = None,
    robot: File | None = None,
    tool_frame: Annotated[str, Metavar("NAME")] | None = None,
    base: Annotated[tuple[str, ...], Metavar("auto|X Y Z")] = ("auto",),
    stand: Annotated[NonNegative, Metavar("M")] = 0.0,
    turns: Count | None = None,
    mesh: File | None = None,
    up: Axis | None = None,
    shift_mm: Annotated[tuple[float, float, float], Metavar("X Y Z")] = (0.0, 0.0, 0.0),
    no_pictures: bool = False,
    seed: Seed = 0,
    overwrite: bool = False,
) -> None:
    """Drive a job on a robot arm in simulation.

    Reach, collisions, contact force and the coverage really achieved, on the bundled six-axis arm
    (a UR10e's kinematics) or any URDF or MJCF of six or seven axes. The object stands on a
    turntable before the arm. Writes joint trajectories (CSV, ROS 2 bag, URScript), report.json,
    report.html, pictures and a film.

    Example: nrdf simulate job-new/

    Args:
        job: Folder that `nrdf transfer` wrote.
        out: Folder to write; JOB/simulation unless given.
        cell: Cell file, as `nrdf cell new` begins it: its robot, where it stands objects, its tools
            and its keep-out boxes, instead of --robot, --tool-frame, --base, --stand, --turns and
            --up.
        robot: URDF or MJCF file; the bundled arm unless given.
        tool_frame: Body or site of the robot that the tool is mounted on.
        base: Place of the arm's base in metres: x y z from the floor under the middle of the
            object, x the object's own x, z up; or auto, to search for the one that reaches most.
        stand: Height of the object above the floor, where the base is given.
        turns: Turns of the turntable to choose from (12); 1 for an object that stays as it is, as
            it does unless given where the base is given.
        mesh: Mesh of the object in metres, in the job's frame, which the arm meets; the job's own
            mesh unless given, or one of all its points.
        up: Direction in the job's frame that points up; as the job says unless given.
        shift_mm: Put the object off its place by x y z in millimetres, in its own frame, to try the
            force control.
        no_pictures: Leave out the pictures and the film.
        seed: Of the random searches.
        overwrite: Replace an earlier result in the output folder.
    """
    from nrdf.cell.file import read_cell
    from nrdf.errors import ConfigError
    from nrdf.io.output import output_folder
    from nrdf.robot.model.arm import load_arm
    from nrdf.robot.model.signed_distance import distance_field_from_file
    from nrdf.robot.report.folder import write_simulation
    from nrdf.robot.simulation.described_cell import place_in_cell
    from nrdf.robot.simulation.job import read_simulation_job
    from nrdf.robot.simulation.simulate import object_distance_field
    from nrdf.robot.simulation.simulate import simulate as run

    described = None
    if cell is not None:
        usual = robot is tool_frame is turns is up is None and base == ("auto",) and not stand
        if not usual:
            raise ConfigError(
                "the cell file says robot, tool frame, base, stand, turns and up: leave --robot, "
                "--tool-frame, --base, --stand, --turns and --up out"
            )
        described = read_cell(cell)
        model, tool_frame = described.robot.model, described.robot.tool_frame
        robot = cell.parent / model if model else None
    out = out or (job if job.is_dir() else job.parent) / "simulation"
    with output_folder(out, overwrite, [job, cell, robot, mesh]) as folder:
        work = read_simulation_job(job, up)
        arm = load_arm(robot, tool_frame)
        for line in arm.checked:
            console.print(line, style="dim")
        given, count = _placement(base, stand, turns)
        distance_field = None
        if mesh is not None:
            distance_field = distance_field_from_file(mesh, work.points)
            work = work.with_mesh(mesh)
        if described is not None:
            with errors.status("shape of the object"):
                distance_field = distance_field or object_distance_field(work)
            work, given = place_in_cell(described, work, distance_field)
            count = 1
        with errors.status("simulation") as status:
            shift = tuple(x / 1e3 for x in shift_mm)
            done = run(work, arm, distance_field, given, count, shift, seed, status.update)
        origin = {"command": command_line(), "job": str(job), "versions": versions()}
        drawn = not no_pictures
        with progress_bar("pictures") as progress:
            report = write_simulation(
                folder, done, job.resolve().name, origin, drawn, drawn, progress
            )
    show_simulation(report)
    console.print(f"all in {out}; {out}/report.html shows it")


def _placement(base: tuple[str, ...], stand: float, turns: int | None) -> tuple[Any, int]:
    """The placement that is given, None for a search, and the number of turns."""
    import numpy as np

    from nrdf.errors import RobotError
    from nrdf.robot.model.cell import Placement

    if base == ("auto",):
        return None, turns or 12
    try:
        x, y, z = (float(value) for value in base)
        for value in (x, y, z):
            FINITE.check("--base", value)
    except ValueError:
        raise RobotError(
            f"--base is '{' '.join(base)}'; give auto, or three numbers: x y z in metres"
        ) from None
    count = turns or 1
    angles = tuple((2.0 * np.pi * np.arange(count) / count).tolist())
    # The base's x looks at the object.
    return Placement((x, y, z), float(np.arctan2(-y, -x)), stand, angles), count


def show_simulation(report: dict[str, Any]) -> None:
    """A table of a simulation's tool paths, what to look at, and the whole."""
    from nrdf.robot.report.content import COLUMNS, metrics_row

    shown = table("", "region", "process", *COLUMNS, texts=2)
    for path in report["paths"]:
        shown.add_row(path["region"], path["process"], *metrics_row(path))
    show(shown)
    for warning in report["warnings"]:
        errors.print(warning, style="yellow")
    total, speed, place = report["total"], report["speed"], report["placement"]
    within = total["force_within"]
    force = "" if within is None else f", force within ±20 % for {within:.1%} of the contact"
    minutes, seconds = divmod(round(total["time_s"]), 60)
    console.print(
        f"{total['reached_share']:.1%} of {total['waypoints']} waypoints reached, "
        f"{total['collisions']} moves with a collision{force}; {minutes} min {seconds} s\n"
        f"base at {' '.join(f'{x:.2f}' for x in place['base_m'])} m, object "
        f"{place['stand_m']:.2f} m above the floor, {len(place['turntable_used_rad'])} turns; "
        f"{speed['ik_ms_per_waypoint']:.1f} ms a waypoint, simulation "
        f"{speed['times_real_time']:.0f} times faster than real time"
    )
