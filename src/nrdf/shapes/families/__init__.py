"""Parametric families of watertight shapes with exact dense correspondence.

`get_family("chair").member(seed)` is a shape with exact occupancy; surface coordinates taken from
one member are found on any other. To write a family: `sections` (curves, cross-sections), `base`
(parts), `member` (members, the `Family` base class).
"""

from __future__ import annotations

from importlib import import_module

from nrdf.errors import DataError, unknown_name
from nrdf.shapes.families.base import Located, SurfaceCoordinates, SurfaceSample
from nrdf.shapes.families.member import Family, Member

__all__ = [
    "FAMILY_NAMES",
    "Family",
    "Located",
    "Member",
    "SurfaceCoordinates",
    "SurfaceSample",
    "get_family",
]

FAMILY_NAMES = ("chair", "car", "plane", "table")
"""Each is a module of this package that defines `FAMILY`."""


def get_family(name: str) -> Family:
    """The family with that name; `DataError` lists the known ones."""
    if name not in FAMILY_NAMES:
        raise DataError(unknown_name("family", name, FAMILY_NAMES))
    family: Family = import_module(f"{__name__}.{name}").FAMILY
    return family
