"""Pairs on disk: which of them count, and which do not."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from builders.bsrc_folder import member_clouds, write_bsrc
from nrdf.errors import OutputError
from nrdf_benchmark import metrics
from nrdf_benchmark import result_cache as module
from nrdf_benchmark.bsrc.dataset import read_bsrc
from nrdf_benchmark.bsrc.evaluate import evaluate
from nrdf_benchmark.methods.registry import MethodSpec
from nrdf_benchmark.objects.evaluate import _JOB_SOURCES
from nrdf_benchmark.result_cache import PairCache, code_checksum

SPEC = MethodSpec("copy", sha256="1")


@pytest.fixture(scope="module")
def benchmark(tmp_path_factory):
    clouds = member_clouds("chair", (0, 1, 2))
    return read_bsrc(write_bsrc(tmp_path_factory.mktemp("bsrc"), "chair", clouds), "chair")


@pytest.fixture
def folder(benchmark, tmp_path):
    evaluate(benchmark, [SPEC], cache=PairCache(tmp_path))
    return tmp_path


def test_what_was_added_is_there_again(benchmark, folder):
    cached = PairCache(folder).open(benchmark, SPEC)
    (result,) = evaluate(benchmark, [SPEC])
    for pair in result.pairs:
        found = cached.pop((pair.reference, pair.target))
        assert (found.metrics, found.points) == (pair.metrics, pair.points)
    assert not cached


def test_pairs_of_objects_that_came_or_went_are_told_apart(benchmark, folder):
    fewer = replace(benchmark, objects=benchmark.objects[:2])
    assert set(PairCache(folder).open(fewer, SPEC)) == {
        ("chair1", "chair2"), ("chair2", "chair1"),
    }  # fmt: skip


@pytest.mark.parametrize("change", ["weights", "metrics", "code", "object", "overwrite"])
def test_pairs_of_something_else_do_not_count(benchmark, folder, monkeypatch, change):
    spec, expected = SPEC, 0
    if change == "weights":
        spec = replace(SPEC, sha256="2")
    elif change == "metrics":
        monkeypatch.setattr(metrics, "VERSION", 0)
    elif change == "code":
        monkeypatch.setattr(module, "code_checksum", lambda: "other")
    elif change == "object":
        first, *others = benchmark.objects
        benchmark = replace(benchmark, objects=(replace(first, checksum="other"), *others))
        expected = 2  # the pairs without it
    assert len(PairCache(folder, change == "overwrite").open(benchmark, spec)) == expected
    # What does not count is taken out of the file.
    assert len(PairCache(folder).open(benchmark, spec)) == expected


def test_readings_and_methods_have_files_of_their_own(benchmark, folder):
    assert not PairCache(folder).open(replace(benchmark, labels="corrected"), SPEC)
    assert not PairCache(folder).open(benchmark, MethodSpec("box", sha256="1"))
    assert len(PairCache(folder).open(benchmark, SPEC)) == 6


def test_lines_that_were_cut_off_or_are_not_ours_do_not_count(benchmark, folder):
    path = folder / "pairs" / "chair-published-copy.jsonl"
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:3]) + "[1]\n{}\n" + lines[4][: len(lines[4]) // 2])
    assert len(PairCache(folder).open(benchmark, SPEC)) == 3
    (result,) = evaluate(benchmark, [SPEC], cache=PairCache(folder))
    assert len(result.pairs) == 6 and len(path.read_text().splitlines()) == 6


@pytest.mark.parametrize(
    "change",
    [
        lambda line: "[" * 100_000,
        lambda line: line.replace('"seconds": ', '"seconds": NaN, "s": '),
        lambda line: re.sub(r'("points": \{"\w+": )\d+', r"\g<1>1e999", line),
        lambda line: re.sub(r'("cd-l1": )[\d.e-]+', r"\g<1>NaN", line, count=1),
        lambda line: "\x00\xff",
    ],
)
def test_a_damaged_line_is_measured_again(benchmark, folder, change):
    path = folder / "pairs" / "chair-published-copy.jsonl"
    lines = path.read_text().splitlines()
    damaged = change(lines[2])
    assert damaged != lines[2]
    path.write_text("\n".join([*lines[:2], damaged, *lines[3:], ""]), encoding="latin-1")
    assert len(PairCache(folder).open(benchmark, SPEC)) == 5
    (result,) = evaluate(benchmark, [SPEC], cache=PairCache(folder))
    assert len(result.pairs) == 6


def test_a_folder_in_a_files_place_is_refused_and_halves_are_cleared(benchmark, folder):
    (folder / "pairs" / ".x.jsonl.0123abcd.part").write_text("half")
    cache = PairCache(folder)
    assert [p.name for p in cache.folder.iterdir()] == ["chair-published-copy.jsonl"]
    (folder / "pairs" / "chair-published-copy.jsonl").unlink()
    (folder / "pairs" / "chair-published-copy.jsonl").mkdir()
    with pytest.raises(OutputError, match="it is a folder"):
        cache.open(benchmark, SPEC)


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match=r"cannot make .*file/pairs.*another --out"):
        PairCache(tmp_path / "file")


def test_every_source_that_results_depend_on_is_read(tmp_path, monkeypatch):
    assert len(code_checksum(_JOB_SOURCES)) == 64  # would raise for one that is not there
    monkeypatch.setattr(module, "_ROOT", tmp_path)
    package = tmp_path / "package"
    package.mkdir()
    (package / "one.py").write_text("x = 1")
    (tmp_path / "single.py").write_text("y = 1")
    sources = ("package", "single.py")
    checksums = []
    for path in (package / "one.py", package / "two.py", tmp_path / "single.py"):
        code_checksum.cache_clear()
        checksums.append(code_checksum(sources))
        path.write_text("x = 2")
    code_checksum.cache_clear()
    assert len({*checksums, code_checksum(sources)}) == 4
    with pytest.raises(FileNotFoundError, match="gone"):
        code_checksum(("gone",))
