"""One page at a time changes the session."""

from __future__ import annotations

from nrdf.studio.pen import Pen


def test_the_first_page_has_the_pen_until_another_one_takes_it_or_it_closes():
    pen = Pen()
    assert pen.may_change(3), "nobody else is there"
    pen.opened(1)
    pen.opened(2)
    assert pen.may_change(1) and not pen.may_change(2)
    pen.take(2)
    assert pen.may_change(2) and not pen.may_change(1)
    pen.closed(2)
    assert pen.may_change(1)
    pen.take(2)
    assert pen.may_change(1), "one that has gone gets nothing"


def test_a_phone_never_gets_it():
    pen = Pen()
    pen.opened(1)
    pen.only_look(1)
    assert not pen.may_change(1)
    pen.opened(2)
    pen.take(1)
    assert pen.may_change(2) and not pen.may_change(1)
    pen.closed(2)
    assert not pen.may_change(1)
