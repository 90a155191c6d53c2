"""The order of the house: what may import what, how long modules are, where their tests stand."""

from __future__ import annotations

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import nrdf

ROOT = Path(__file__).parents[1]
SOURCE, TESTS = ROOT / "src", ROOT / "tests"
FEWEST_LINES, MOST_LINES, MOST_TEST_LINES = 40, 350, 500
MOST_PUBLIC_NAMES = 30

LAYERS = (
    *(
        "errors",
        "tasks",
        "geometry",
        "io",
        "viz",
        "bundled",
        "shapes",
        "field",
        "training",
        "scans",
    ),
    *(
        "regions",
        "learn",
        "surface",
        "toolpath",
        "process_model",
        "process",
        "reports",
        "cell",
        "export",
    ),
    *("robot.model", "robot.planning", "robot.simulation", "robot.report", "serve"),
    *("studio", "nrdf", "commands", "cli"),
)
"""From the lowest to the highest; data flow down, so nothing imports what stands after it.

"nrdf" is the package's own `__init__`, what users import.
"""
CROSSING = ("fuzz", "builders", "studio/test_app_browser.py")
"""Tests below a folder that are of more than one module."""


def modules() -> dict[str, Path]:
    """Dotted name to file, of every module of both packages."""
    found = {}
    for path in sorted(SOURCE.rglob("*.py")):
        parts = path.relative_to(SOURCE).with_suffix("").parts
        found[".".join(part for part in parts if part != "__init__")] = path
    return found


def imports(path: Path, known: dict[str, Path]) -> set[str]:
    """The modules that a module imports: anywhere, for type checkers too."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {name.name for name in node.names if name.name in known}
        elif isinstance(node, ast.ImportFrom) and node.module in known:
            for name in node.names:
                inner = f"{node.module}.{name.name}"
                if inner in known:
                    found.add(inner)
                elif (node.module, name.name) != ("nrdf", "__version__"):
                    found.add(node.module)
    return found


MODULES = modules()
IMPORTS = {name: imports(path, MODULES) - {name} for name, path in MODULES.items()}


def layer(name: str) -> int:
    """The place of a module of `nrdf` among the layers."""
    inner = name.removeprefix("nrdf").removeprefix(".") or "nrdf"
    fitting = [place for place in LAYERS if inner == place or inner.startswith(f"{place}.")]
    if inner == "robot":  # its __init__ imports nothing
        return LAYERS.index("robot.model")
    assert fitting, f"{name} has no place among the layers"
    return LAYERS.index(fitting[0])


def test_nothing_imports_upward():
    upward = [
        f"{name} imports {other}"
        for name, others in IMPORTS.items()
        for other in others
        if name != "nrdf" and name.startswith("nrdf.") and other.startswith("nrdf.")
        if layer(other) > layer(name)
    ]
    assert not upward, "\n".join(upward)


def test_nrdf_never_imports_the_benchmark():
    for name, others in IMPORTS.items():
        if name == "nrdf" or name.startswith("nrdf."):
            assert not [o for o in others if o.startswith("nrdf_benchmark")], name


def test_no_modules_import_each_other_in_a_circle():
    graph = {name: others - {"nrdf"} for name, others in IMPORTS.items() if name != "nrdf"}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


@pytest.mark.parametrize("name", sorted(MODULES))
def test_modules_are_of_a_readable_length(name):
    path = MODULES[name]
    text = path.read_text(encoding="utf-8")
    assert ast.get_docstring(ast.parse(text)), f"{name} does not say what it is"
    if path.name != "__init__.py":
        assert FEWEST_LINES <= len(text.splitlines()) <= MOST_LINES, name


@pytest.mark.parametrize("name", [n for n, p in MODULES.items() if p.name != "__init__.py"])
def test_every_module_has_a_test_file_of_its_own(name):
    parts = name.removeprefix("nrdf.").split(".")
    mirror = TESTS.joinpath(*parts[:-1], f"test_{parts[-1]}.py")
    assert mirror.is_file(), f"{name} wants {mirror.relative_to(ROOT)}"
    assert "def test_" in mirror.read_text(encoding="utf-8"), mirror


@pytest.mark.parametrize("path", sorted(TESTS.rglob("test_*.py")), ids=lambda path: path.name)
def test_test_files_are_short_and_stand_where_their_module_does(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= MOST_TEST_LINES
    inner = path.relative_to(TESTS)
    if len(inner.parts) > 1 and not inner.as_posix().startswith(CROSSING):
        module = inner.with_name(inner.name.removeprefix("test_"))
        assert (SOURCE / module).exists() or (SOURCE / "nrdf" / module).exists(), (
            f"{inner} mirrors no module"
        )


def test_public_names_can_be_read_at_a_glance():
    assert len(nrdf.__all__) <= MOST_PUBLIC_NAMES
