from __future__ import annotations

import numpy as np

from nrdf.process.transfer_result import MIN_CONFIDENCE, reason_to_skip
from nrdf.regions.match import FOUND, Match
from nrdf.regions.presence import ABSENT, Presence


def match(confidence, method="mask", presence=FOUND):
    confidence = np.array(confidence)
    return Match(np.arange(len(confidence)), np.zeros((9, 3)), confidence, method, presence)


def test_a_region_that_was_found_is_not_skipped():
    assert reason_to_skip(match([0.3, 0.4]), MIN_CONFIDENCE) == ""


def test_why_a_region_is_skipped():
    absent = Presence(ABSENT, 0.93, 0.0, 0.0)
    for found, reason in (
        (match([], presence=absent), f"{ABSENT} (confidence 0.93)"),
        (match([]), "found nowhere on the target"),
        (match([], method="marked"), "marked as not there"),
        (match([0.1, 0.3]), "confidence 0.20, below 0.25"),
    ):
        assert reason_to_skip(found, 0.25) == reason
