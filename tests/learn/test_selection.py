"""Near-duplicates are found however they were sampled; what is held out is always the same."""

from __future__ import annotations

from dataclasses import replace

from builders.desk_lamps import lamp, sampled
from nrdf.learn.selection import find_duplicates, hold_out


def test_the_same_object_sampled_anew_is_a_duplicate_and_another_is_not():
    shapes = [sampled(lamp(0), "a", 0), sampled(lamp(1), "b", 0), sampled(lamp(0), "c", 1)]
    assert find_duplicates(shapes) == {"c": "a"}
    slightly = replace(shapes[0], name="d", surface_points=shapes[0].surface_points * [1, 1, 1.3])
    assert find_duplicates([shapes[0], slightly]) == {}


def test_one_in_five_is_held_out_and_always_the_same():
    names = [f"{n:02d}" for n in range(20)]
    held = hold_out(names)
    assert len(held) == 4 and held == hold_out(names[::-1])
    assert [len(hold_out(names[:n])) for n in (3, 5, 8)] == [1, 1, 2]
    assert len(hold_out([str(n) for n in range(200)])) == 6
