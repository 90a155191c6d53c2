"""How far apart neighbouring lines of a tool path are, along the surface that they are on."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from nrdf.geometry.frames import unit_vectors
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.sampled_path import SampledPath

_REACH = 2.5  # stepovers within which a line is beside another one
_PARALLEL = float(np.cos(np.pi / 6))  # lines beside each other run the same way, or back
_FACING = 0.05  # cosine between the tool's axes on neighbouring lines
_CLOSE, _LOOKS = 1.02, (0.2, 0.35, 0.5, 0.65, 0.8)
# Stepovers from which it matters whether the region goes on in between, and where it is asked.
_GONE = 0.1  # stepovers that a place between two lines may be beside the region
_NEXT = 12  # samples of which one is next to a place, on its side


def line_spacing(region: TargetMesh, sampled: SampledPath, stepover_m: float) -> np.ndarray:
    """Distances (k,), m, along the surface from places of lines to the lines beside them.

    Square to the travel: the next line to either side counts if it runs about the same way and the
    region, a mesh of its own faces, goes on all the way to it. Where another line comes nearer to
    the middle of the way than either (round a corner, past a short break), twice its distance from
    there counts: the width of the largest disc between lines. A chord's arc is told from the tool's
    axes at its ends.
    """
    i, j, share = _crossings(sampled, stepover_m)
    if not len(i):
        return np.zeros(0)
    places, outward = sampled.places, -sampled.axes
    beside = places[j] + share[:, None] * (places[j + 1] - places[j])
    chord = np.linalg.norm(beside - places[i], axis=1)
    turned = np.clip(np.einsum("pa,pa->p", outward[i], outward[j]), 0.0, 1.0)
    half = 0.5 * np.arccos(turned)
    arc = chord / np.sinc(half / np.pi)
    wide = np.flatnonzero(arc > _CLOSE * stepover_m)
    ends = places[i[wide]], beside[wide], outward[i[wide]], outward[j[wide]]
    whole = np.ones(len(i), bool)
    whole[wide] = _goes_on(region, *ends, chord[wide] * np.tan(0.5 * half[wide]), stepover_m)
    arc[wide] *= np.minimum(1.0, 2.0 * _nearest_to_middle(sampled, *ends) / chord[wide])
    return np.asarray(arc[whole])


def _crossings(
    sampled: SampledPath, stepover_m: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Samples i (k,), and the step from sample j (k,) on, at its share (k,), that lies beside each:
    the nearest on either side that crosses the square to the travel at i."""
    places, travel, walked = sampled.places, sampled.travel, sampled.arc_length
    reach = _REACH * stepover_m
    tree = cKDTree(places)
    pairs = tree.sparse_distance_matrix(tree, reach + sampled.step, output_type="ndarray")
    i, j = pairs["i"], pairs["j"]
    going_on = np.append(np.diff(walked) < 2.0 * sampled.step, False)
    kept = going_on[j]
    i, j = i[kept], j[kept]
    # A step that crosses the square begins no farther from it than steps are long.
    ahead = np.einsum("pa,pa->p", places[j] - places[i], travel[i])
    farthest = 2.0 * sampled.step * np.linalg.norm(travel, axis=1)
    kept = np.abs(ahead) <= farthest[i]
    i, j, before = i[kept], j[kept], ahead[kept]
    one, other = places[j] - places[i], places[np.minimum(j + 1, len(places) - 1)] - places[i]
    after = np.einsum("pa,pa->p", other, travel[i])
    kept = (before * after <= 0.0) & (before != after)
    i, j, one, other, before, after = (v[kept] for v in (i, j, one, other, before, after))
    share = before / (before - after)
    crossing = one + share[:, None] * (other - one)
    away = np.linalg.norm(crossing, axis=1)
    side = np.einsum("pa,pa->p", np.cross(-sampled.axes[i], travel[i]), crossing)
    kept = (np.einsum("pa,pa->p", sampled.axes[i], sampled.axes[j]) > _FACING) & (away < reach)
    # A line's own samples around, and those across a turn, are not beside it.
    kept &= np.abs(walked[i] - walked[j]) > np.clip(3.0 * away, 2.0 * sampled.step, reach)
    i, j, share, side, away = (v[kept] for v in (i, j, share, side, away))
    key = 2 * i + (side > 0.0)
    order = np.lexsort((away, key))
    _, first = np.unique(key[order], return_index=True)
    i, j, share = (v[order][first] for v in (i, j, share))
    along = np.einsum("pa,pa->p", unit_vectors(travel[i]), unit_vectors(travel[j]))
    parallel = np.abs(along) > _PARALLEL
    return i[parallel], j[parallel], share[parallel]


def _goes_on(
    region: TargetMesh,
    starts: np.ndarray,
    ends: np.ndarray,
    outward: np.ndarray,
    outward_there: np.ndarray,
    rise: np.ndarray,
    stepover_m: float,
) -> np.ndarray:
    """Whether (k,) a region goes on between starts (k, 3) and ends (k, 3); rise (k,): of the arc
    over the middle of the chord, m."""
    whole = np.ones(len(starts), bool)
    # An arc over the chord where the surface bulges, under it where it is hollow.
    bulge = np.einsum("ka,ka->k", outward_there - outward, ends - starts) > 0.0
    height = 0.5 * np.where(bulge, rise, -rise)
    for part in _LOOKS:
        asked = np.flatnonzero(whole)
        if not len(asked):
            break
        normal = unit_vectors((1.0 - part) * outward[asked] + part * outward_there[asked])
        middle = unit_vectors(outward[asked] + outward_there[asked])
        place = starts[asked] + part * (ends[asked] - starts[asked])
        place = place + (4.0 * part * (1.0 - part) * height[asked])[:, None] * middle
        off = region.nearest(place, normal).points - place
        sideways = off - np.einsum("ka,ka->k", off, normal)[:, None] * normal
        whole[asked] = np.linalg.norm(sideways, axis=1) < _GONE * stepover_m
    return whole


def _nearest_to_middle(
    sampled: SampledPath,
    starts: np.ndarray,
    ends: np.ndarray,
    outward: np.ndarray,
    outward_there: np.ndarray,
) -> np.ndarray:
    """Distance (k,), m, of the nearest sample of its side from the middle of each way."""
    count = np.arange(1, min(_NEXT, len(sampled.places)) + 1)
    away, near = cKDTree(sampled.places).query(0.5 * (starts + ends), count)
    middle = unit_vectors(outward + outward_there)
    facing = -np.einsum("kna,ka->kn", sampled.axes[near], middle) > _FACING
    return np.asarray(np.where(facing, away, np.inf).min(axis=1, initial=np.inf))
