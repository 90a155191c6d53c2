"""Training shapes as depth cameras see them, and the split of a small network's shapes."""

from __future__ import annotations

import pytest
import torch

from builders.step_shape import step_shape
from nrdf.errors import DataError
from nrdf.training.camera_views import CAMERAS, draw_seen, join, load_views, split, views_of
from nrdf.training.provenance import Entry, list_shapes


def test_the_test_split_and_every_tenth_shape_are_left_out(folder):
    kept, held = split(list_shapes([folder]))
    assert [e.path.stem for e in held] == ["step-09"]
    assert len(kept) == 10 and all(e.split == "train" for e in kept)
    rows = [Entry(folder / "a.npz", "s", split, "") for split in ("val", "test", "train")]
    assert [[e.split for e in part] for part in split(rows)] == [["train"], ["val"]]


def test_cameras_see_what_faces_them():
    shape = step_shape("", 0)
    views = views_of([(shape.surface_points, shape.surface_normals)])
    assert len(views) == 1 and len(CAMERAS) < 63
    bits, normals = views.bits[0], views.normals[0]
    assert (bits[normals[:, 1] < -0.9] == 0).all(), "no camera sees the underside"
    assert (bits[normals[:, 1] > 0.9] != 0).float().mean() > 0.8
    assert len(join([views, views])) == 2


def test_a_drawn_cloud_has_the_points_that_were_asked_for(folder):
    views = load_views(list_shapes([folder])[:2], "step")
    generator = torch.Generator().manual_seed(0)
    points, normals = draw_seen(views, torch.tensor([0, 1, 1]), 100, 0.01, generator)
    assert points.shape == normals.shape == (3, 100, 3) and points.isfinite().all()
    assert torch.allclose(normals.norm(dim=-1), torch.ones(3, 100), atol=1e-5)
    with pytest.raises(DataError, match="of the category 'step', not 'chair'"):
        load_views(list_shapes([folder])[:1], "chair")
