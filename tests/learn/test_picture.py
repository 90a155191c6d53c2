"""Pictures of what was learned."""

from __future__ import annotations

import numpy as np

from builders.desk_lamps import lamp, sampled
from nrdf.learn.picture import draw_held_out, draw_objects, some_regions
from nrdf.regions.model import load_model


def test_regions_cut_all_of_a_shape_into_parts():
    regions = some_regions(sampled(lamp(0), "a", 0))
    assert len(regions) == 6
    every = np.concatenate(list(regions.values()))
    assert np.array_equal(np.sort(every), np.arange(8192))


def test_pictures_are_written(tmp_path):
    shapes = [sampled(lamp(n), f"lamp{n}", n) for n in range(2)]
    draw_objects(shapes, tmp_path / "objects.png")
    models = {"registration": load_model("registration")}
    draw_held_out(models, shapes[0], shapes[1:], tmp_path / "held-out.png")
    for name in ("objects.png", "held-out.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")
