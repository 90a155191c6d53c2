"""The best constant stepover on a plate."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.process_model.plate_theory import best_stepover, strip_of, variation
from nrdf.process_model.removal import Pad
from nrdf.process_model.spray_profile import SprayProfile

GUN = SprayProfile(0.1, 0.05, 1e-6, 0.2)


def test_gaussian_passes_are_as_even_as_their_first_harmonic_says():
    gun = SprayProfile(0.03, 0.03, 1e-6, 0.2, "gaussian")
    stepover = 0.07
    wave = 2.0 * np.exp(-2.0 * (np.pi * 0.03 / stepover) ** 2) / np.sqrt(2.0)
    assert variation(gun, stepover) == pytest.approx(wave, rel=0.05)


@pytest.mark.parametrize(
    "tool", [GUN, Pad(0.05, 2e7, 5e-9, 20.0, 1000.0, 0.0025), Pad(0.05, 2e7, 5e-9, 20.0, 300.0)]
)
def test_the_best_stepover_is_even_and_a_wider_one_is_not(tool):
    best = best_stepover(tool)
    enough = 0.01 if tool is GUN else 0.04
    for share in (0.5, 0.8, 1.0):
        assert variation(tool, share * best) <= enough
    assert variation(tool, 1.04 * best) > 0.95 * enough
    assert strip_of(tool, np.array([0.2])) == pytest.approx(0.0)


def test_the_overlap_that_is_most_even_is_the_published_one():
    """Of "Coating uniformity with a uniform robotic spray gun velocity": passes with a parabolic
    section vary least, by a variance of about 0.0025, where 0.29 to 0.31 of them overlap."""
    parabola = SprayProfile(0.05, 0.05, 1e-6, 0.2, across_exponent=1.5)  # of the pass: half less
    overlaps = np.linspace(0.2, 0.4, 81)
    variances = [variation(parabola, 0.1 * (1.0 - overlap)) ** 2 for overlap in overlaps]
    assert 0.29 <= overlaps[int(np.argmin(variances))] <= 0.31
    assert min(variances) == pytest.approx(0.0025, abs=0.0004)
