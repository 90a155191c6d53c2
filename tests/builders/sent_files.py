"""What a person sends to the studio: ZIP archives, and an arm's description."""

from __future__ import annotations

import io
import zipfile


def archive(files):
    """A ZIP archive of files by name."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as made:
        for name, content in files.items():
            made.writestr(name, content)
    return buffer.getvalue()


def six_axis_urdf(mesh="package://x/y.stl"):
    """A URDF of six axes, of which one link's shape is a mesh."""
    links = "".join(
        f'<link name="l{i}"><inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" '
        f'ixz="0" iyz="0"/></inertial><collision><origin xyz="0 0 .1"/><geometry>'
        + (f'<mesh filename="{mesh}"/>' if i == 3 else '<cylinder radius=".03" length=".2"/>')
        + "</geometry></collision></link>"
        for i in range(7)
    )
    joints = "".join(
        f'<joint name="j{i}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/>'
        f'<origin xyz="0 0 .2"/><axis xyz="{"0 0 1" if i % 2 else "0 1 0"}"/>'
        f'<limit lower="-2" upper="2" velocity="1.5" effort="50"/></joint>'
        for i in range(6)
    )
    return f'<robot name="six">{links}{joints}</robot>'
