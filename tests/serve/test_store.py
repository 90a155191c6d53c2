"""The store: one row an object, one outcome a row."""

from __future__ import annotations

import threading

import pytest

from nrdf.errors import OutputError
from nrdf.serve.store import Store, safe_name


@pytest.fixture
def store(tmp_path):
    made = Store(tmp_path)
    yield made
    made.close()


def test_a_file_has_one_row_and_a_changed_one_another(store):
    assert store.add("/in/a.ply", 10, 1, "a.ply", set()) == 1
    assert store.add("/in/a.ply", 10, 1, "a.ply", set()) is None
    assert store.add("/in/a.ply", 10, 2, "a.ply", set()) == 2
    assert store.add("/in/A.obj", 10, 1, "sub/A.obj", {"a-3"}) == 3
    assert [row.name for row in store.rows()] == ["A-4", "a-2", "a"]
    assert store.find("/in/a.ply", 10, 2).id == 2 and store.find("/in/a.ply", 11, 2) is None


def test_an_outcome_is_final(store):
    store.add("/in/a", 1, 1, "a", set())
    row = store.claim()
    assert row.state == "running" and row.attempts == 1 and store.claim() is None
    store.finish(row.id, "done", "", {"paths": 3})
    store.finish(row.id, "refused", "late", {})
    store.wait_again(row.id, "late")
    ended = store.row(row.id)
    assert (ended.state, ended.figures) == ("done", {"paths": 3}) and ended.seconds >= 0
    assert store.counts() == {"waiting": 0, "running": 0, "done": 1, "look-at": 0, "refused": 0}


def test_what_failed_waits_behind_what_never_ran_and_knows_its_place(store):
    for name in "abc":
        store.add(f"/in/{name}", 1, 1, name, set())
    first = store.claim()
    store.wait_again(first.id, "died")
    assert store.place(store.row(first.id)) == 2
    assert [store.claim().name for _ in range(3)] == ["b", "c", "a"]
    store.wait_again(first.id, "full disk", counts=False)
    assert store.row(first.id).attempts == 1


def test_two_threads_never_claim_the_same_object(store):
    for number in range(60):
        store.add(f"/in/{number}", 1, 1, str(number), set())
    claimed = []

    def claim():
        while (row := store.claim()) is not None:
            claimed.append(row.id)

    threads = [threading.Thread(target=claim) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(claimed) == list(range(1, 61))


def test_a_store_that_cannot_be_written_says_so(tmp_path):
    (tmp_path / "line.sqlite").write_bytes(b"no database at all" * 100)
    with pytest.raises(OutputError, match="cannot use the store"):
        Store(tmp_path)


@pytest.mark.parametrize(
    ("label", "name"),
    [("a/b.ply", "b"), ("../..", "object"), ("...ply", "object"), ("nul.ply", "nul_"),
     ("x y;$(z).ply", "x_y_z"), ("C:\\q\\w.ply", "w"), ("Stühle.ply", "Stühle"),
     ("n" * 300 + ".ply", "n" * 80)],
)  # fmt: skip
def test_names_of_folders_are_safe(label, name):
    assert safe_name(label) == name
