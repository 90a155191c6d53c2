"""`nrdf model scan`: depth cameras simulated around a mesh, with the truth beside what they saw."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional

from nrdf.commands.console import command_line, console
from nrdf.commands.options import Axis, File, Metavar, Unit
from nrdf.io.bounds import Bounds, NonNegative, Positive, Seed


def scan(
    mesh: Positional[File],
    out: File | None = None,
    views: Annotated[int, Bounds(1, 1000)] = 3,
    noise: NonNegative = 0.0,
    quantisation: NonNegative = 0.0,
    grazing: Annotated[float, Bounds(0.0, 90.0), Metavar("DEG")] = 15.0,
    distance: Positive = 2.0,
    pixels: Annotated[int, Bounds(1, 4096)] = 240,
    floor: bool = False,
    up: Axis = "z",
    yaw: Annotated[float, Metavar("DEG")] | None = None,
    scale: Positive = 1.0,
    offset: Annotated[tuple[float, float, float], Metavar("X Y Z")] = (0.0, 0.0, 0.0),
    unit: Unit | None = None,
    normals: bool = False,
    seed: Seed = 0,
) -> None:
    """Simulate depth cameras around a mesh.

    Writes the points as PLY, with the cameras' places as comments, and what is true of them (pose,
    scale, cameras) as JSON beside it, under the same name.

    Example: nrdf model scan chair.ply --views 3 --noise 0.001 --floor --out scan.ply

    Args:
        mesh: Mesh of the object: +X forward, +Y up.
        out: PLY file to write; scan-NAME.ply unless given.
        views: Cameras, spread around the object.
        noise: Standard deviation of depth at the object's middle, in the mesh's unit; it grows with
            depth squared.
        quantisation: Step of depth there, in the mesh's unit; it grows likewise.
        grazing: Angle in degrees between ray and surface below which points drop out.
        distance: From the cameras to the object's middle, in its longest sides.
        pixels: Rows and columns of each image, which the object fills.
        floor: Put a floor under the object.
        up: Axis of the scan that points up.
        yaw: Turn of the object about its up axis, in degrees; random unless given.
        scale: Length of the scan for a length 1 of the mesh.
        offset: Where the mesh's origin lies in the scan.
        unit: Unit of the scan's coordinates, to be noted in the file.
        normals: Write the true normals too.
        seed: Of everything that is random.
    """
    from dataclasses import replace

    import numpy as np

    from nrdf.errors import DataError
    from nrdf.geometry.canonical import rotation_about_up
    from nrdf.geometry.similarity import Similarity, up_axis, upright
    from nrdf.io.atomic import write_json
    from nrdf.io.cloud import write_cloud
    from nrdf.io.formats.mesh_file import load_mesh
    from nrdf.io.output import output_files
    from nrdf.scans.simulate import ScanSettings, simulate_scan

    out = out or Path(f"scan-{mesh.stem}.ply")
    beside = out.with_suffix(".json")
    if out.suffix.lower() != ".ply":
        raise DataError(f"--out {out} must end in .ply")
    with output_files(out, beside, [mesh]) as folder:
        rng = np.random.default_rng(seed)
        turn = rng.uniform(0, 2 * np.pi) if yaw is None else np.radians(yaw)
        pose = Similarity(upright(up_axis(up)) @ rotation_about_up(turn), np.array(offset), scale)
        settings = ScanSettings(
            views=views,
            noise=noise,
            quantisation=quantisation,
            grazing=float(np.radians(grazing)),
            distance=distance,
            pixels=pixels,
            floor=floor,
        )
        scanned = simulate_scan(*load_mesh(mesh), settings, rng, pose, unit)
        cloud = replace(scanned.cloud, normals=scanned.normals) if normals else scanned.cloud
        truth = {
            "command": command_line(),
            "mesh": str(mesh),
            "up": up,
            "yaw_degrees": float(np.degrees(turn)),
            "scale": scale,
            "T_scan_mesh": pose.T_scan_canonical,
            "sensors": scanned.cloud.sensors,
            "points": len(cloud),
            "points_of_floor": int((scanned.face < 0).sum()),
            "unit": unit,
        }
        write_cloud(folder / out.name, cloud, scalars={"view": scanned.view, "face": scanned.face})
        write_json(folder / beside.name, truth)
    of_floor = f", {truth['points_of_floor']} of them of the floor" if floor else ""
    console.print(f"{len(cloud)} points{of_floor} in {out}; the truth in {beside}")
