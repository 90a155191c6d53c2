"""The checks that every commit passes: style, format, types, and what the package promises."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.metadata import requires
from pathlib import Path

import pytest

import nrdf

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("command", ["ruff check", "ruff format --check", "mypy"])
def test_tool_has_no_complaints(command):
    words = [sys.executable, "-m", *command.split()]
    if "ruff" in command:
        words.append(".")
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_public_names_are_there_and_importing_them_is_cheap():
    for name in nrdf.__all__:
        assert getattr(nrdf, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'load_modle'"):
        nrdf.load_modle  # noqa: B018
    code = "import sys, nrdf; print({'torch', 'numpy'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"
    # Retrieval in the same frame starts without what only scans and meshes need.
    code = (
        "import sys, nrdf.regions.reference as _; "
        "print({'trimesh', 'igl', 'scipy.interpolate', 'nrdf.shapes.families'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


def test_every_dependency_is_pinned():
    pinned = {
        re.split(r"[=;]", line)[0].strip().lower()
        for line in (ROOT / "constraints.txt").read_text().splitlines()
        if "==" in line
    }
    for requirement in requires("nrdf") or []:
        name = re.split(r"[\[<>=;! ]", requirement)[0].lower()
        assert name in pinned or name == "nrdf", f"{name} is missing in constraints.txt"


def test_version_is_the_same_everywhere():
    version = nrdf.__version__
    assert f'version = "{version}"' in (ROOT / "pyproject.toml").read_text()
    assert f"version: {version}" in (ROOT / "CITATION.cff").read_text()
    assert f"## {version}" in (ROOT / "CHANGELOG.md").read_text()


def test_no_machine_paths_in_tracked_text():
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("not a git checkout")
    home = re.compile(r"(?<![\w.])/(work|home|root|Users)/")
    for name in listed.stdout.split():
        path = ROOT / name
        if path.suffix in (".py", ".md", ".toml", ".yaml", ".cff", ".txt") and path.is_file():
            assert not home.search(path.read_text(encoding="utf-8")), f"{name} has a machine path"
