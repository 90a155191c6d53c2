"""Check of the kind of object: of the category, upright, facing forward? Before any region.

A network of the category tells (`nrdf.field.kind_network`). A category without one is checked by
how well known objects explain the target (`nrdf.scans.pose_scorer`), which says less.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nrdf.field.cloud_encoder import CloudEncoder
from nrdf.field.encoded_cloud import EncodedCloud
from nrdf.field.kind_network import ASKEW, ORIENTATIONS, OTHER, TILTED, KindNetwork, up_of
from nrdf.geometry.similarity import AXES, up_axis
from nrdf.io.cloud import PointCloud
from nrdf.scans.objects import count_objects
from nrdf.scans.pose_scorer import COST_MARGIN, LARGEST_Z_SCORE, USUAL_COST, PoseScorer

MINIMUM_PROBABILITY = 0.3
"""Probability that an object stands upright and faces forward, below which there is a warning."""
_COUNTED = 2048  # points in which objects are counted
FITS = "upright and facing forward"
CONFIRMED = "in the pose that a person confirmed"
_SOMETHING_ELSE = "something else"
_OBJECTS = " objects"


@dataclass(frozen=True)
class KindCheck:
    """What a target looks like.

    taken_for: in words; probability: that it is of the category, upright and facing forward, None
    where nothing tells (a category without a network). warnings: whole sentences for people; none
    where it fits.
    """

    category: str
    taken_for: str
    probability: float | None = None
    warnings: tuple[str, ...] = ()

    @property
    def fits(self) -> bool:
        """Whether nothing speaks against the target."""
        return not self.warnings

    @property
    def of_confirmed_pose(self) -> KindCheck:
        """What is left of it once a person has confirmed the pose: whether it is of another kind,
        or several objects."""
        if self.fits or self.taken_for.endswith(_OBJECTS):
            return self
        if self.taken_for == _SOMETHING_ELSE:
            other = f"the target may be no {self.category}, or a part of one; check that it is one"
            return replace(self, warnings=(other,))
        return replace(self, taken_for=CONFIRMED, warnings=())

    def describe(self) -> dict[str, Any]:
        """What a report says of it."""
        likely = None if self.probability is None else round(self.probability, 4)
        return {
            "category": self.category,
            "fits": self.fits,
            "taken_for": self.taken_for,
            "probability": likely,
            "warnings": list(self.warnings),
        }


def check_kind(
    model: CloudEncoder, target: EncodedCloud, scorer: Callable[[], PoseScorer]
) -> KindCheck:
    """Check a target that is encoded in the pose in which its regions are to be found.

    scorer: gives the category's pose scorer; called only where there is no network.
    """
    network = model.kind_network
    if network is None:
        given = scorer()
        turn = given.better_turn(target)
        if turn is not None:
            return _turned(given.name, target.pose.rotation, turn)
        return check_by_scorer(given, given.cost_of(target), target.points)
    return check_points(network, model.category, target.points, target.pose.rotation)


def _turned(category: str, rotation: np.ndarray, turn: np.ndarray) -> KindCheck:
    """A target that looks like its kind in another orientation: turned by `turn` (3, 3) in the
    canonical frame, which `rotation` (3, 3) takes to that of the file."""
    forward, upward = (rotation @ turn[:, axis] for axis in (0, 1))
    looks, up = f"facing {_axis(forward)}", _letter(upward)
    if turn[1, 1] < 0.5:
        looks = f"standing with {_axis(upward)} up"
    warning = (
        f"the target does not look like a {category} facing {_axis(rotation[:, 0])}: it looks more "
        f"like one that is {looks}; give --up {up} to have it aligned"
    )
    return KindCheck(category, looks, None, (warning,))


def check_points(
    network: KindNetwork, category: str, points: np.ndarray, rotation: np.ndarray
) -> KindCheck:
    """Count the objects in canonical points (n, 3), and classify them by a category's network.

    rotation: (3, 3) from canonical coordinates to those of the target's file, in which directions
    are named.
    """
    few = points[np.random.default_rng(0).permutation(len(points))[:_COUNTED]]
    count = count_objects(PointCloud(few), up_axis("y"))
    if count == 1:
        return check_by_network(network, category, points, rotation)
    warning = (
        f"the target holds {count} objects of comparable size; give a cloud of one {category}, or "
        f"--up {_letter(rotation[:, 1])} to have the largest taken"
    )
    return KindCheck(category, f"{count}{_OBJECTS}", 0.0, (warning,))


def check_by_network(
    network: KindNetwork, category: str, points: np.ndarray, rotation: np.ndarray
) -> KindCheck:
    """Classify by a category's network the canonical points (n, 3) of one object; rotation: as of
    `check_points`."""
    order = np.random.default_rng(0).permutation(len(points))
    likely = network.probabilities(points[order])
    sure = float(likely[0])
    if sure >= MINIMUM_PROBABILITY:
        return KindCheck(category, FITS, sure)
    answer = int(likely[1:].argmax()) + 1
    # Many answers share what an object of the category may be; together they may outweigh "other".
    if likely[OTHER] > 0.5:
        answer = OTHER
    elif answer == OTHER:
        answer = int(likely[1:OTHER].argmax()) + 1
    looks = _in_words(answer, rotation)
    warning = _warning(category, answer, looks, rotation)
    return KindCheck(category, looks, sure, (warning,))


def _in_words(answer: int, rotation: np.ndarray) -> str:
    if answer == OTHER:
        return _SOMETHING_ELSE
    if answer == TILTED:
        return "tilted"
    up = up_of(answer)
    assert up is not None
    if answer < ASKEW:
        forward, _, right = ORIENTATIONS[answer].T
        if up[1] > 0.5:
            return f"facing {_axis(rotation @ forward)}"
        if up[1] < -0.5:
            return "upside down"
        if abs(forward[1]) > 0.5:
            return "lying on its back" if forward[1] > 0 else "lying on its front"
        return "lying on its left side" if right[1] > 0 else "lying on its right side"
    if up[1] > 0.5:
        return "turned by an odd angle"
    return "upside down" if up[1] < -0.5 else "lying"


def _warning(category: str, answer: int, looks: str, rotation: np.ndarray) -> str:
    """A sentence that says what is seen, and what to do about it."""
    aligned = not np.allclose(rotation, np.eye(3))
    not_like = f"the target does not look like a {category}"
    if answer == OTHER:
        return (
            f"{not_like}: it looks like another kind of object, or like a part of one; give a "
            f"whole {category}, or, if it is one in another pose, --up auto to have it aligned"
        )
    standing = f"{not_like} standing upright and facing {_axis(rotation[:, 0])}: it looks like one"
    up = up_of(answer)
    if up is None:
        return f"{standing} that is {looks}; give the direction that points up, as --up x y z"
    name = _letter(rotation @ up)
    if up[1] > 0.5 and aligned:
        return f"{standing} {looks}; look at the picture, or scan more sides"
    return f"{standing} {looks}; give --up {name} to have it aligned"


def _axis(direction: np.ndarray) -> str:
    """The axis nearest to a direction (3,), such as +X."""
    name = max(AXES, key=lambda axis: float(up_axis(axis) @ direction)).upper()
    return name if name.startswith("-") else f"+{name}"


def _letter(direction: np.ndarray) -> str:
    """The axis nearest to a direction (3,), as --up takes it, such as -x."""
    return _axis(direction).lstrip("+").lower()


def check_by_scorer(scorer: PoseScorer, cost: float, points: np.ndarray) -> KindCheck:
    """Check canonical points (n, 3) against a few known objects of the category.

    cost: at which those explain the points (`PoseScorer.fine`).
    """
    category, z_score = scorer.name, scorer.proportion_z_score(points)
    if cost < USUAL_COST + COST_MARGIN and z_score < LARGEST_Z_SCORE:
        return KindCheck(category, "like what is known of its kind")
    warning = (
        f"the target does not look like a {category} standing upright and facing +X: what is known "
        f"explains it at a cost of {cost:.2f}, {USUAL_COST:.2f} is usual, and its "
        f"proportions are {z_score:.1f} standard deviations off; check that it is one, and "
        "give --up with the direction that points up if it is in another pose"
    )
    return KindCheck(category, _SOMETHING_ELSE, None, (warning,))
