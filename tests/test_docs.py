"""The documentation: the site builds, links lead somewhere, and its code and commands are right."""

from __future__ import annotations

import functools
import importlib
import os
import re
import shlex
import subprocess
import sys
from importlib.metadata import metadata
from pathlib import Path

import numpy as np
import pytest

import nrdf
from nrdf import cli
from nrdf.bundled import KNOWLEDGE, bundled_chair
from nrdf.process.bound_knowledge import resolve
from nrdf.process.knowledge_file import read_knowledge

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(page: Path, *languages: str) -> list[str]:
    """The page's fenced blocks of some languages."""
    found = FENCE.findall(page.read_text(encoding="utf-8"))
    return [text for language, text in found if language in languages]


def commands(page: Path) -> list[str]:
    """The lines of a page's blocks that call nrdf, without their comments."""
    lines = "".join(blocks(page, "", "sh", "bash")).replace("\\\n", " ").splitlines()
    return [line for line in lines if line.startswith("nrdf ")]


def named(page: Path) -> str:
    return str(page.relative_to(ROOT))


WITH_CODE = [page for page in PAGES if blocks(page, "python")]
WITH_COMMANDS = [page for page in PAGES if commands(page)]


def test_the_site_builds_and_all_its_links_lead_somewhere(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", tmp_path],
        cwd=ROOT,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1", "COLUMNS": "100"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    commands = (tmp_path / "reference" / "commands.html").read_text(encoding="utf-8")
    assert "nrdf transfer" in commands and "nrdf eval bsrc" in commands
    python = (tmp_path / "reference" / "python.html").read_text(encoding="utf-8")
    assert all(name in python for name in nrdf.__all__ if not name.startswith("__"))


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_links_to_files_and_headings_lead_somewhere(page):
    # mkdocs checks the links within docs/; this also checks README.md and links between the two.
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        path, _, anchor = target.partition("#")
        if path.startswith("http") or path.endswith(("commands.md", "configs.md")):
            continue
        there = page if not path else (page.parent / path)
        assert there.exists(), f"{named(page)} links to {target}"
        if anchor and there.suffix == ".md":
            assert anchor in headings(there), f"{named(page)} links to {target}"


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_modules_and_names_that_pages_mention_exist(page):
    for name in re.findall(r"`(nrdf(?:_benchmark)?(?:\.\w+)+)", page.read_text(encoding="utf-8")):
        assert resolves(name), f"{named(page)} mentions {name}"


def resolves(name: str) -> bool:
    """Whether a dotted name is a module, or something in one."""
    parts = name.split(".")
    for size in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:size]))
        except ModuleNotFoundError:
            continue
        for attribute in parts[size:]:
            if attribute in getattr(found, "model_fields", ()):
                return True
            if not hasattr(found, attribute):
                return False
            found = getattr(found, attribute)
        return True
    return False


def headings(page: Path) -> set[str]:
    """The anchors of a page's headings, as mkdocs and GitHub make them of plain ones."""
    lines = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    plain = [re.sub(r"[^\w\s-]", "", line.lower()) for line in lines]
    return {re.sub(r"\s+", "-", line.strip()) for line in plain}


def small_process() -> nrdf.ProcessTransfer:
    """What is done to the bundled chair's seat alone, in few lines."""
    knowledge = read_knowledge(KNOWLEDGE)
    (seat,) = (region for region in knowledge.regions if region.name == "seat")
    wide = {"stepover_m": 0.1, "overlap": None, "trajectory": "raster"}
    seat = seat.model_copy(update={"processes": [seat.processes[0].model_copy(update=wide)]})
    few = knowledge.model_copy(update={"regions": [seat]})
    return nrdf.ProcessTransfer(resolve(few, KNOWLEDGE.parent), nrdf.load_model("chair"))


@pytest.fixture(scope="module")
def workplace(tmp_path_factory):
    """A folder with the files that the pages name: ref.ply, seat.ply, new.ply, scan.ply, ..."""
    folder = tmp_path_factory.mktemp("docs")
    reference, regions = bundled_chair("reference")
    nrdf.write_cloud(folder / "ref.ply", reference)
    for name, region in (("seat.ply", "seat"), ("back.ply", "back-front")):
        mask = regions[region]
        part = nrdf.PointCloud(reference.points[mask], unit="m")
        nrdf.write_cloud(folder / name, part)
    target, _ = bundled_chair("rocker")
    nrdf.write_cloud(folder / "new.ply", target)
    # As a scanner would have it: z up.
    turned = target.points @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    nrdf.write_cloud(folder / "scan.ply", nrdf.PointCloud(turned, unit="m"))
    nrdf.write_job(folder / "job", small_process().transfer(target))
    for path in KNOWLEDGE.parent.iterdir():
        if path.suffix in (".yaml", ".npz", ".ply"):
            (folder / path.name).write_bytes(path.read_bytes())
    return folder


@pytest.mark.parametrize("page", WITH_CODE, ids=named)
def test_python_runs_as_it_stands(page, workplace, monkeypatch, capsys):
    monkeypatch.chdir(workplace)
    code = "\n".join(blocks(page, "python"))
    exec(compile(code, named(page), "exec"), {"__name__": "__main__"})


@pytest.mark.parametrize("page", WITH_COMMANDS, ids=named)
def test_commands_are_ones_that_exist(page, monkeypatch):
    called = []

    def harmless(verb):
        @functools.wraps(verb)
        def nothing(*given, **named):
            called.append(verb)
            return 0

        return nothing

    def group(verb):
        members = {name: harmless(inner) for name, inner in verb().items()}
        return functools.wraps(verb)(lambda: members)

    known = {
        name: group(verb) if name in cli.GROUPS else harmless(verb)
        for name, verb in cli.verbs().items()
    }
    monkeypatch.setattr(cli, "verbs", lambda: known)
    for line in commands(page):
        words = shlex.split(line.replace("…", "0.5"), comments=True)
        if len(words) > 1 and words[-1] not in ("--help", "--version"):
            assert cli.run(words[1:]) == 0, line
            assert called, line
            called.clear()


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_extras_that_are_named_exist(page):
    extras = set(metadata("nrdf").get_all("Provides-Extra") or [])
    for group in re.findall(r"(?:nrdf|\.)\[([a-z,]+)\]", page.read_text(encoding="utf-8")):
        assert set(group.split(",")) <= extras, f"{named(page)} names the extra [{group}]"


def test_the_readme_is_short():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.split()) <= 800
    (code,) = blocks(ROOT / "README.md", "python")
    assert len(code.splitlines()) <= 9  # an empty line among them
