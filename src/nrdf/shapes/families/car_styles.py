"""Body styles of cars: typical measures, and random cars between and around them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

_HEADER = """
length width height ride wheel front_axle rear_axle bonnet_edge screen_base screen_top roof_end
window_base boot_edge nose_y bonnet_y screen_y roof_drop boot_y tail_y tumblehome round
"""
"""Stations (the axles to `boot_edge`) are measured from the nose; `_y` are heights at stations;
`wheel` is a radius, `ride` the ground clearance, `tumblehome` the slope of the side windows."""

_STYLES = """
sedan      470 182 145 16 33 190 790 45 285 455 700 855 975 66  78 100 6 106 100 33 50
saloon     490 186 148 17 34 180 790 40 290 450 680 830 975 68  82 100 5 103  98 33 50
box-sedan  455 172 142 17 31 180 760 25 320 440 680 780 985 70  84  95 4  96  92 26 20
hatchback  405 175 148 16 32 200 830 50 270 470 870 955 985 66  80 100 9 102  92 33 60
city       350 164 150 16 29 200 860 55 220 420 890 970 990 68  82  99 6 100  90 28 60
micro      270 158 154 17 29 190 870 70 220 460 870 960 985 70  84 102 8 102  90 26 70
liftback   465 184 142 15 33 200 800 45 280 470 680 930 980 62  76  98 5 104  96 36 60
estate     475 182 148 16 33 190 780 45 280 450 900 965 985 66  80 100 5 102  90 32 40
box-estate 465 174 147 17 32 180 760 25 310 440 930 965 985 70  84  96 3  98  88 24 20
coupe      450 184 133 13 33 200 790 45 310 480 620 850 975 58  72  92 4 100  94 42 60
fastback   445 186 128 12 34 200 780 45 320 490 600 920 980 56  72  90 3  94  88 42 70
sports     440 190 116 11 33 220 820 50 270 450 570 800 975 50  64  82 2  92  88 50 70
racer      460 198 110  8 33 210 810 45 250 430 550 780 980 42  60  76 2  88  84 52 60
roadster   410 178 124 12 31 190 800 50 370 480 620 740 975 56  72  88 3  92  86 42 70
muscle     480 190 136 14 34 200 780 20 370 500 680 830 985 70  84  96 4 100  94 36 30
suv        465 188 172 22 37 190 800 35 260 420 880 955 985 82 100 116 6 118 102 28 50
crossover  435 184 160 19 35 200 820 40 265 450 860 950 985 74  92 110 9 114 100 32 60
coupe-suv  475 196 166 21 38 190 800 35 275 450 700 930 975 80  98 114 4 122 108 34 60
off-roader 430 182 186 26 40 170 800 12 300 380 950 972 988 90 108 116 3 114  96 12 15
mpv        460 182 166 17 33 190 820 45 190 400 910 968 987 70  86 104 6 106  92 26 50
van        470 186 192 18 34 180 820 35 150 310 950 980 990 76  96 114 3 116  96 14 30
delivery   430 180 182 18 32 190 820 40 220 370 950 975 988 70  90 108 3 110  92 12 30
pickup     520 188 176 24 38 170 790 20 270 380 560 590 988 90 108 118 5 114 112 24 30
beetle     410 168 150 17 32 190 790 60 310 420 620 850 965 58  80 100 5 102  72 30 90
"""
"""In cm, stations in thousandths of the length, tumblehome and roundness in per cent."""

_UNIT = np.array([0.01] * 5 + [0.001] * 8 + [0.01] * 8)
_COLUMNS = _HEADER.split()
_NAMES = [row.split()[0] for row in _STYLES.strip().splitlines()]
_TABLE = _UNIT * [[float(x) for x in row.split()[1:]] for row in _STYLES.strip().splitlines()]
_UPRIGHT = {"suv", "off-roader", "pickup", "crossover", "coupe-suv", "estate", "mpv", "van"}
_SPREAD = {
    "length": 0.05, "width": 0.03, "height": 0.04, "ride": 0.15, "wheel": 0.04,
    "bonnet_edge": 0.3, "screen_base": 0.05, "roof_drop": 0.4, "tumblehome": 0.2,
}  # fmt: skip
"""Standard deviation of the logarithm."""


def random_style(rng: np.random.Generator) -> Mapping[str, float]:
    """Measures by column name (m, and fractions of the length): two styles blended, jittered.

    `upright` is 1 for styles that may have roof rails.
    """
    first, second = rng.choice(len(_TABLE), 2)
    mix = 0.0 if rng.random() < 0.3 else 0.6 * rng.beta(1, 1.6)
    row = (1 - mix) * _TABLE[first] + mix * _TABLE[second]
    d = dict(zip(_COLUMNS, row.tolist(), strict=True))
    height = d["height"]

    def normal() -> float:
        return float(np.clip(rng.normal(), -2, 2))

    for key, spread in _SPREAD.items():
        d[key] *= np.exp(spread * normal())
    for key in ("nose_y", "bonnet_y", "screen_y", "boot_y", "tail_y"):
        d[key] *= d["height"] / height * np.exp(0.03 * normal())
    for key in ("screen_top", "roof_end", "front_axle", "rear_axle"):
        d[key] += 0.012 * normal()
    d["width"] = max(d["width"], 0.38 * d["length"])
    overhang = 1.22 * d["wheel"] / d["length"] + 0.01
    d["front_axle"] = max(d["front_axle"], overhang)
    d["rear_axle"] = min(d["rear_axle"], 1 - overhang)
    d["bonnet_y"] = min(d["bonnet_y"], d["screen_y"] - 0.04)
    d["boot_y"] = min(d["boot_y"], d["height"] - d["roof_drop"] - 0.12)
    d["tail_y"] = min(d["tail_y"], d["boot_y"] + 0.02)
    for ahead, behind in (("window_base", "boot_edge"), ("roof_end", "window_base")):
        d[ahead] = min(d[ahead], d[behind] - 0.008)
    d["round"] = float(np.clip(d["round"] + 0.2 * rng.normal(), 0.05, 1))
    d["upright"] = float(_NAMES[first] in _UPRIGHT)
    return d
