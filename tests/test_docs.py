"""The documentation: the site builds, links lead somewhere, and its code and commands are right."""

from __future__ import annotations

import importlib
import os
import re
import subprocess
import sys
from importlib.metadata import metadata
from pathlib import Path

import pytest

import nrdf

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
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
