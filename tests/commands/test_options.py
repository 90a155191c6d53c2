"""What `--help` calls the values of options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import pytest

from nrdf.commands.options import File, Metavar, Sensors, Unit, metavar_of
from nrdf.io.bounds import Bounds


@pytest.mark.parametrize(
    ("name", "hint", "metavar"),
    [
        ("cloud", File, "FILE"),
        ("cloud", File | None, "FILE"),
        ("region", tuple[File, ...], "FILE ..."),
        ("data", Path, "PATH"),
        ("unit", Unit | None, "{m,cm,mm,in}"),
        ("skip", tuple[Literal["a", "b"], ...], "{a,b} ..."),
        ("sensor", Sensors, "X Y Z ..."),
        ("max_step_mm", Annotated[float, Bounds(0.0)] | None, "MM"),
        ("angle_deg", float, "DEG"),
        ("time_s", float, "SECONDS"),
        ("count", int, "N"),
        ("scale", float, "NUMBER"),
        ("templates_from", str, "FROM"),
        ("offset", tuple[float, float], "NUMBER NUMBER"),
        ("yaw", Annotated[float, Bounds(0.0), Metavar("DEG")] | None, "DEG"),
    ],
)
def test_metavars_name_files_units_and_choices(name, hint, metavar):
    assert metavar_of(name, hint) == metavar
