"""A few steps of registration from where the field maps a reference: the option `refine`.

The field's map is moved so that it and the target lie on each other, both ways, in position and
normal, while displacements stay smooth over the reference (`nrdf.shapes.registration`). It is the
only part of retrieval that optimises anything for a pair.
"""

from __future__ import annotations

import numpy as np

from nrdf.shapes.registration import (
    DisplacementInterpolator,
    RegistrationSettings,
    RegistrationTemplate,
)

_POINTS = 2048  # of the reference, registered to twice as many of the target
_SETTINGS = RegistrationSettings(
    iterations=4,
    radius_start=0.2,
    radius_end=0.1,
    normal_weight_start=0.1,
    normal_weight_end=0.1,
    match_scale=0.08,
)


class Refiner:
    """A reference, canonical: points and normals (n, 3); for any number of targets."""

    def __init__(self, points: np.ndarray, normals: np.ndarray) -> None:
        self._chosen = np.random.default_rng(0).permutation(len(points))[:_POINTS]
        self._template = RegistrationTemplate(
            points[self._chosen], normals[self._chosen], _SETTINGS
        )
        self._interpolator = DisplacementInterpolator(points[self._chosen], points)

    def displacement(
        self,
        mapped: np.ndarray,
        mapped_normals: np.ndarray,
        target: np.ndarray,
        target_normals: np.ndarray,
    ) -> np.ndarray:
        """How each mapped reference point has to move, (n, 3), canonical.

        mapped, mapped_normals: (n, 3), the reference's points where the field puts them; target,
        target_normals: (m, 3).
        """
        sample = np.random.default_rng(1).permutation(len(target))[: 2 * _POINTS]
        begin = mapped[self._chosen]
        registered = self._template.register(
            target[sample], target_normals[sample], (begin, mapped_normals[self._chosen])
        )
        return self._interpolator.interpolate(registered.points - begin)
