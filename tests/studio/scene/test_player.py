"""A player plays, pauses and ends."""

from __future__ import annotations

import threading

from nrdf.studio.scene.player import Player


def test_a_player_plays_pauses_and_ends_by_itself():
    times, enough, ended = [], threading.Event(), threading.Event()

    def advance(seconds):
        times.append(seconds)
        enough.set()
        if len(times) > 3:
            ended.set()
        return len(times) <= 3

    player = Player(advance)
    player.speed = 10.0
    player.play()
    assert enough.wait(5) and ended.wait(5)
    while player.playing:
        threading.Event().wait(0.01)
    count = len(times)
    assert min(times) > 0.3, "ten times as fast"
    player.play()
    player.pause()
    threading.Event().wait(0.15)
    assert len(times) <= count + 1 and not player.playing
    player.stop()
