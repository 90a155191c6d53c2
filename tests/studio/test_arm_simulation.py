"""Starting a simulation without what it needs."""

from __future__ import annotations

from types import SimpleNamespace

from nrdf.studio.model import simulation_process
from nrdf.studio.model.document import REFERENCE


def test_without_mujoco_the_button_says_what_to_install(page, monkeypatch):
    page.transfer()
    monkeypatch.setattr(simulation_process, "find_spec", lambda name: None)
    assert "pip install 'nrdf[robot]'" in page.does(page.studio.arm_simulation.start, "new")
    assert "press 'Simulate on the arm' first" in page.does(page.studio.arm_simulation.play)
    assert "press 'Simulate on the arm' first" in page.does(page.studio.arm_simulation.save, None)


def test_a_simulation_is_shown_played_and_put_away_with_its_object(page, playback):
    studio, simulation = page.studio, page.studio.arm_simulation
    page.transfer()
    process = SimpleNamespace(end=lambda: None)
    result = studio.results.by_target["new"]
    simulation._show_new("new", result, page.editor.session.folder, playback, process)
    assert studio.visible_objects() == ["new"] and simulation.is_current
    assert len(simulation.occupied_points) > 8
    page.does(simulation.seek, 0.5 * playback.seconds)
    assert studio.panel.robot.time.disabled is False
    page.does(studio.panel.robot.refresh)
    assert "top, sand" in studio.panel.robot.now.content
    assert simulation._advance(0.1) and simulation.time_s > 0.5 * playback.seconds
    assert not simulation._advance(playback.seconds), "the end"
    page.does(studio.panel.robot._play)  # Pause, pressed as the end came
    assert not simulation.player.playing and simulation.time_s == playback.seconds
    simulation._ended_at -= 60.0
    page.does(studio.panel.robot._play)
    assert simulation.player.playing and simulation.time_s < playback.seconds
    page.does(studio.panel.robot._play)
    assert not simulation.player.playing
    page.does(simulation.show, False)
    assert studio.visible_objects() == [REFERENCE, "new"] and simulation.occupied_points is None
    page.editor.change_numbers("top", 0, {"stepover_mm": 15.0})
    assert not simulation.is_current
    assert "before your last change" in page.does(simulation.save, None)
    page.editor.remove_target("new")
    page.does(studio.sync)
    assert simulation.playback is None and simulation.key == ""
