"""Chord error: more waypoints where the straight way between two of them leaves the surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.polylines import step_lengths
from nrdf.toolpath.modifiers.join import Project
from nrdf.toolpath.surface_path import SurfacePath

_ON_SURFACE_M = 1e-4
_ROUNDS = 6  # halvings: 1/64 of a spacing


def chord_error(
    paths: Sequence[SurfacePath], project: Project, largest_m: float
) -> list[SurfacePath]:
    """Paths with points added halfway, on the surface, wherever the middle of a step is farther
    than `largest_m` from it; 0 adds none. Points that there are stay.
    """
    if largest_m <= 0.0:
        return list(paths)
    return [_refined(path, project, largest_m) for path in paths]


def largest_step(
    paths: Sequence[SurfacePath], project: Project, height_m: float, largest_m: float
) -> list[SurfacePath]:
    """Paths with points added halfway wherever a tool centre point `height_m` over the surface goes
    farther than `largest_m` from one point to the next, as around a bend that is tighter than the
    tool is high. Added points lie on the surface where both of their neighbours do."""
    if height_m <= 0.0:
        return list(paths)
    return [_finer(path, project, height_m, largest_m) for path in paths]


def _finer(path: SurfacePath, project: Project, height_m: float, largest_m: float) -> SurfacePath:
    contacts, normals = path.contacts, path.normals
    for _ in range(_ROUNDS):
        at = np.flatnonzero(step_lengths(contacts + height_m * normals) > largest_m)
        if not len(at):
            break
        middles = 0.5 * (contacts[at] + contacts[at + 1])
        outward = unit_vectors(normals[at] + normals[at + 1])
        places, _, there = project(middles, outward)
        step = np.linalg.norm(contacts[at + 1] - contacts[at], axis=1)
        there = there & (np.linalg.norm(places - middles, axis=1) < 0.5 * step)
        for end in (at, at + 1):  # neither of which runs off
            on = project(contacts[end], normals[end])[0]
            there &= np.linalg.norm(on - contacts[end], axis=1) < _ON_SURFACE_M
        places = np.where(there[:, None], places, middles)
        contacts = np.insert(contacts, at + 1, places, axis=0)
        normals = np.insert(normals, at + 1, outward, axis=0)
    return replace(path, contacts=contacts, normals=normals)


def _refined(path: SurfacePath, project: Project, largest_m: float) -> SurfacePath:
    contacts, normals = path.contacts, path.normals
    coarse = np.ones(len(contacts) - 1, bool)
    for _ in range(_ROUNDS):
        at = np.flatnonzero(coarse)
        if not len(at):
            break
        middles = 0.5 * (contacts[at] + contacts[at + 1])
        outward = unit_vectors(normals[at] + normals[at + 1])
        places, smooth, there = project(middles, outward)
        far = there & (np.linalg.norm(places - middles, axis=1) > largest_m)
        # A place nearer to an end than to the middle is another part of the surface.
        step = np.linalg.norm(contacts[at + 1] - contacts[at], axis=1)
        far &= np.linalg.norm(places - middles, axis=1) < 0.5 * step
        if not far.any():
            break
        where = at[far] + 1
        contacts = np.insert(contacts, where, places[far], axis=0)
        normals = np.insert(normals, where, smooth[far], axis=0)
        added = where + np.arange(len(where))
        coarse = np.zeros(len(contacts) - 1, bool)
        coarse[added] = coarse[added - 1] = True
    return replace(path, contacts=contacts, normals=normals)
