"""Files that are sent: whole, once a key, and not for ever."""

from __future__ import annotations

import os

import pytest

from nrdf.errors import DataError
from nrdf.serve.uploads import Uploads

NOW = 1e9


@pytest.fixture
def uploads(tmp_path):
    return Uploads(tmp_path / "uploads", 1000, 3 * 86400)


def kept(uploads, name, size, days):
    place = uploads.place(name, None)
    with uploads.receiving(place) as file:
        file.write(bytes(size))
    os.utime(place, (NOW - 86400 * days,) * 2)
    return place


def test_a_key_has_one_place_and_names_do_no_harm(uploads):
    assert uploads.place("a.ply", "k") == uploads.place("a.ply", "k")
    assert uploads.place("a.ply", None) != uploads.place("a.ply", None)
    for name in ("../../x.ply", "/etc/passwd", "a\0b.p/../ly", "." * 300):
        place = uploads.place(name, "../..")
        assert place.parent.parent == uploads.folder and "\0" not in str(place)


def test_a_file_is_there_whole_or_not_at_all(uploads):
    place = uploads.place("a.ply", "k")
    with pytest.raises(OSError), uploads.receiving(place) as file:
        file.write(b"half")
        raise OSError("gone")
    with pytest.raises(DataError, match="the body is empty"), uploads.receiving(place):
        pass
    assert not place.parent.exists()
    for content in (b"first", b"second"):
        with uploads.receiving(place) as file:
            file.write(content)
    assert place.read_bytes() == b"first" and os.listdir(place.parent) == [place.name]


def test_what_is_old_or_too_much_goes_unless_its_object_waits(uploads):
    old, waits = kept(uploads, "old.ply", 10, 4), kept(uploads, "waits.ply", 10, 5)
    first, second = kept(uploads, "1.ply", 600, 2), kept(uploads, "2.ply", 600, 1)
    young = kept(uploads, "young.ply", 600, 0)
    part = second.with_name(".part-1")
    part.touch()
    os.utime(part, (NOW - 7200,) * 2)
    assert uploads.clear({str(waits.absolute())}, NOW) == 4
    there = {place.name for place in (old, waits, first, second, young) if place.exists()}
    assert there == {"waits.ply", "young.ply"} and not part.exists()
    assert uploads.bytes() == 610 and not old.parent.exists()
