"""The content of a session.

A `Document` is never changed, only replaced, so that undo goes back to an earlier one, and work in
the background can use one while the next is made.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from nrdf.io.cloud import PointCloud
from nrdf.studio.model.placing import Placement

REFERENCE = "reference"
"""The key of the reference; targets have their names."""


@dataclass(frozen=True)
class PaintedRegion:
    """A region of the reference: mask (n,) bool; colour: red, green, blue, 0 to 255; steps: what is
    done to it, each as the mapping that a knowledge file holds, SI (it need not be right yet);
    fill_holes: as a knowledge file has it."""

    name: str
    colour: tuple[int, int, int]
    mask: np.ndarray
    steps: tuple[Mapping[str, Any], ...] = ()
    fill_holes: bool = False


@dataclass(frozen=True)
class LoadedObject:
    """An object: its name, its cloud in metres, and its file in the session's folder.

    placement: how it stands, None where that is +X forward and +Y up. scan: what it was cleaned
    out of, None where that is itself.
    """

    name: str
    cloud: PointCloud
    file: str = ""
    placement: Placement | None = None
    scan: LoadedObject | None = None


@dataclass(frozen=True)
class Target:
    """An object that the process is transferred to.

    corrected: regions painted on it by hand, name to mask (m,) bool, in place of found ones.
    """

    object: LoadedObject
    corrected: Mapping[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True)
class Document:
    """Reference, regions with their processes, and targets; the model of a knowledge file, if it
    is not the category's, whether its unusual category is meant, and its origin."""

    category: str = "chair"
    reference: LoadedObject | None = None
    regions: tuple[PaintedRegion, ...] = ()
    targets: tuple[Target, ...] = ()
    allow_overlap: bool = False
    model: str | None = None
    allow_unusual: bool = False
    origin: Mapping[str, Any] = field(default_factory=dict)

    def region(self, name: str) -> PaintedRegion | None:
        """The region of that name, or None."""
        return next((r for r in self.regions if r.name == name), None)

    def with_region(self, name: str, called: str = "", **changes: Any) -> Document:
        """The document with something of a region changed; `called`: its new name."""
        changes |= {"name": called or name}
        regions = tuple(replace(r, **changes) if r.name == name else r for r in self.regions)
        return replace(self, regions=regions)

    def with_target(self, name: str, **changes: Any) -> Document:
        """The document with something of a target changed."""
        targets = tuple(replace(t, **changes) if t.object.name == name else t for t in self.targets)
        return replace(self, targets=targets)
