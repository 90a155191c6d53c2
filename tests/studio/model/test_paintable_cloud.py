"""A large cloud is shown by fewer points, and painted whole."""

from __future__ import annotations

from builders.taught_box import SIZE, cloud


def test_a_large_target_is_shown_thinned_and_painted_whole(results):
    editor = results.editor
    editor.add_target("large.ply", cloud(SIZE, 20_000, seed=2))
    body = editor.paintable("large")
    assert len(body.points) < len(body.cloud)
    mask = body.points[:, 1] > body.high[1] - 1e-6
    whole = body.to_all(mask)
    truth = body.cloud.points[:, 1] > body.high[1] - 1e-6
    assert (whole == truth).mean() > 0.98 and (body.to_shown(whole) == mask).all()
