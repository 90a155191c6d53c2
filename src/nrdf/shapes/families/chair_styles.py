"""Kinds of chairs: their proportions (m, degrees), supports and arms, as ranges to draw from."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Style:
    """Ranges (low, high) of one kind of chair."""

    weight: float
    seat_height: tuple[float, float]
    half_width: tuple[float, float]
    half_depth: tuple[float, float]
    seat_thickness: tuple[float, float]
    back_height: tuple[float, float]
    back_thickness: tuple[float, float]
    recline: tuple[float, float]  # degrees
    wrap: tuple[float, float]  # how far (in half-depths) the back's edges come forward
    pierced: float  # probability of windows in the back
    supports: dict[str, float]
    arms: dict[str, float]


_LEGS = {"four": 6.0, "sled": 0.7, "cantilever": 0.3, "scissor": 0.3, "rocker": 0.2}
STYLES = {
    "dining": Style(
        0.36, (0.42, 0.48), (0.19, 0.25), (0.19, 0.25), (0.014, 0.07), (0.33, 0.68),
        (0.016, 0.045), (0, 14), (0, 0.3), 0.72, _LEGS, {"none": 5, "bar": 2, "panel": 0.3},
    ),
    "lounge": Style(
        0.12, (0.30, 0.43), (0.25, 0.36), (0.25, 0.34), (0.03, 0.16), (0.38, 0.75),
        (0.03, 0.12), (8, 28), (0, 0.45), 0.3,
        {"four": 4, "sled": 1, "cantilever": 0.6, "scissor": 0.3, "pedestal": 1.2, "rocker": 0.6},
        {"none": 2, "bar": 4, "panel": 1},
    ),
    "upholstered": Style(
        0.16, (0.36, 0.46), (0.25, 0.36), (0.26, 0.38), (0.14, 0.32), (0.42, 0.8),
        (0.09, 0.24), (2, 16), (0, 0.4), 0.0, {"short": 5, "plinth": 2, "pedestal": 0.7},
        {"sofa": 6, "none": 0.6},
    ),
    "office": Style(
        0.12, (0.42, 0.52), (0.22, 0.29), (0.21, 0.28), (0.03, 0.11), (0.35, 0.8),
        (0.02, 0.1), (2, 14), (0, 0.5), 0.15, {"office": 5, "pedestal": 1},
        {"none": 2, "bar": 4, "loop": 1},
    ),
    "shell": Style(
        0.12, (0.40, 0.47), (0.21, 0.27), (0.2, 0.26), (0.012, 0.035), (0.28, 0.55),
        (0.012, 0.03), (6, 24), (0.1, 0.6), 0.12,
        {"four": 4, "sled": 1.2, "cantilever": 0.8, "pedestal": 1.5, "office": 0.7},
        {"none": 4, "bar": 1, "panel": 0.3},
    ),
    "tub": Style(
        0.07, (0.38, 0.46), (0.26, 0.36), (0.24, 0.33), (0.05, 0.2), (0.22, 0.6),
        (0.03, 0.1), (0, 12), (1.0, 2.0), 0.12, {"four": 3, "short": 3, "pedestal": 2},
        {"none": 1},
    ),
    "bar": Style(
        0.05, (0.58, 0.78), (0.18, 0.23), (0.17, 0.22), (0.02, 0.09), (0.15, 0.45),
        (0.015, 0.05), (0, 12), (0, 0.5), 0.5, {"four": 4, "sled": 1, "pedestal": 2},
        {"none": 6, "bar": 1},
    ),
}  # fmt: skip
