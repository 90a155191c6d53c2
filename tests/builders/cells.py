"""Cell files that several tests read."""

from __future__ import annotations

from typing import Any

from nrdf.cell.file import CELL_FILE
from nrdf.cell.work_cell import WorkCell

BASE = {
    "name": "cell 3",
    "object": {"T_base_object": [[0, -1, 0, 0.8], [1, 0, 0, -0.1], [0, 0, 1, 0.3], [0, 0, 0, 1]]},
    "tools": [
        {
            "name": "disc 125",
            "tcp_mm": [0, 0, 180],
            "mass_kg": 1.4,
            "controller_name": "tSander",
            "switches": [
                {
                    "outputs": {"urscript": "3", "rapid": "doSpindle", "krl": "17"},
                    "on": {"gcode": ["S{rpm} M3"], "apt": ["INSERT/SPIN {rpm}"]},
                    "off": {"gcode": ["M5"], "apt": ["INSERT/STOP"]},
                    "wait_on_s": 1.5,
                }
            ],
        },
        {"name": "camera", "tcp_m": [0, 0, 0.1], "number": 7},
        {
            "name": "gun",
            "tcp_m": [0, 0, 0.25],
            "switches": [
                {
                    "during": "line",
                    "kinds": ["paint"],
                    "outputs": {"urscript": "2", "rapid": "doGun", "krl": "18"},
                },
                {
                    "during": "contact",
                    "on": {"krl": ["FORCE_ON({force_n})"]},
                    "off": {"krl": ["FORCE_OFF()"]},
                },
            ],
        },
    ],
}


def cell_content(**changes: Any) -> dict[str, Any]:
    """A cell file's content, with other values for some keys."""
    return {**BASE, **changes}


def cell_of(**changes: Any) -> WorkCell:
    """A cell."""
    return CELL_FILE.validated(cell_content(**changes), "cell.yaml")
