"""Patches of a target that nothing on the reference explains: to which region do they belong?

A spoiler, a canard, a rail between two legs: the reference has no such place, so its nearest mapped
points say little about it. What surrounds it says more: a rail ends in legs on both sides and is
part of them; a canard grows out of a fuselage's side and roof and is part of neither.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

# How far a target point may be from the mapped reference and still have a counterpart on it:
# canonical length, and multiple of the error that the field expects there.
_SLACK = 0.02
_REACH = 1.25
# Points are neighbours up to this multiple of the median distance to the 7th nearest.
_NEIGHBOURHOOD = 1.5
_NEAREST = 7


def explained_by(distance: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Which target points (n,) have a counterpart on the reference.

    distance: (n, k) to the mapped points that vote on each (`association.alike_voters`); error:
    (n, k) that the field expects of these. A field that predicts no error explains all points.
    """
    expected = error.mean(axis=1)
    return (distance.mean(axis=1) <= _SLACK + _REACH * expected) | (expected == 0)


@dataclass(frozen=True)
class Patches:
    """Connected patches of unexplained points on a target of n points.

    explained: (n,) bool. label: (n,) number of each unexplained point's patch. border: (b, 2)
    pairs of a patch's number and an explained point next to it.
    """

    explained: np.ndarray
    label: np.ndarray
    border: np.ndarray

    def joined(self, voted: np.ndarray) -> np.ndarray:
        """A region (n,) bool from the points (n,) that voted for it: the explained ones, and those
        of every patch that more than half of its surroundings claim and that is no larger than the
        region itself.
        """
        found = voted & self.explained
        patch, beside = self.border.T
        count = len(self.label)
        around = np.bincount(patch, minlength=count)
        inside = np.bincount(patch, found[beside], minlength=count)
        wanted = voted & ~self.explained
        size = np.bincount(self.label[wanted], minlength=count)
        belongs = (inside > 0.5 * around) & (size <= found.sum())
        return found | (wanted & belongs[self.label])


def find_patches(points: np.ndarray, explained: np.ndarray) -> Patches:
    """The patches of a target's points (n, 3) of which those in `explained` (n,) bool are."""
    count = len(points)
    label = np.arange(count)
    nobody = np.empty((0, 2), dtype=np.int64)
    if explained.all():
        return Patches(explained, label, nobody)
    tree = cKDTree(points)
    nearest = tree.query(points, [min(_NEAREST + 1, count)])[0]
    unexplained = np.flatnonzero(~explained)
    # Only what is near unexplained points is looked for; they are few as a rule.
    pairs = cKDTree(points[unexplained]).sparse_distance_matrix(
        tree, _NEIGHBOURHOOD * float(np.median(nearest)), output_type="ndarray"
    )
    first, second = unexplained[pairs["i"]], pairs["j"]
    within = ~explained[second]
    ones = np.ones(int(within.sum()))
    graph = coo_matrix((ones, (first[within], second[within])), shape=(count, count))
    label = connected_components(graph, directed=False)[1]
    patch, beside = first[~within], second[~within]
    return Patches(explained, label, np.stack([label[patch], beside], axis=1))
