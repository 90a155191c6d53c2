"""A large cloud is shown by fewer points, and painted whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import trimesh

from builders.taught_box import SIZE, cloud
from nrdf.geometry.mesh import Mesh
from nrdf.studio.model.paintable_cloud import PaintableCloud


def test_a_large_target_is_shown_thinned_and_painted_whole(results):
    editor = results.editor
    editor.add_target("large.ply", cloud(SIZE, 20_000, seed=2))
    body = editor.paintable("large")
    assert len(body.points) < len(body.cloud)
    mask = body.points[:, 1] > body.high[1] - 1e-6
    whole = body.to_all(mask)
    truth = body.cloud.points[:, 1] > body.high[1] - 1e-6
    assert (whole == truth).mean() > 0.98 and (body.to_shown(whole) == mask).all()


def test_a_mesh_is_shown_with_at_most_so_many_triangles(monkeypatch):
    ball = trimesh.creation.icosphere(4, 0.3)
    whole = replace(cloud(SIZE, 600, 0), mesh=Mesh(np.array(ball.vertices), np.array(ball.faces)))
    assert PaintableCloud(whole).mesh.faces.shape == ball.faces.shape
    monkeypatch.setattr("nrdf.studio.model.paintable_cloud.SHOWN_FACES", 500)
    assert 100 < len(PaintableCloud(whole).mesh.faces) <= 500
    assert PaintableCloud(cloud(SIZE, 600, 0)).mesh is None


def test_a_region_is_cut_out_of_the_surface_once():
    body = PaintableCloud(cloud(0.5 * SIZE, 1500, 0))
    top = body.points[:, 1] > body.high[1] - 1e-6
    region = body.region(top, 0.025)
    assert body.region(top.copy(), 0.025) is region
    assert body.region(top & (body.points[:, 0] > 0.0), 0.025) is not region
    assert body.surface_for() is region.parent
