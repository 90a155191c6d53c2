"""Builds the wheel, looks at what is in it, and runs it in an environment that has nothing else.

    python tools/check_wheel.py [--keep FOLDER]

The wheel is built from the source distribution, so both are checked. `nrdf info` and `nrdf demo`
run in an empty folder outside the checkout, with the extra `robot`. Ends with 1 where something is
missing or fails. With --keep the wheel is copied to FOLDER.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CONSTRAINTS = ROOT / "constraints.txt"
SOURCES = ROOT / "src"
KINDS = (".py", ".typed", ".npz", ".yaml", ".json", ".safetensors", ".html", ".xml", ".txt")
"""Files of the packages that have to be in the wheel."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path, help="folder to copy the wheel to")
    keep = parser.parse_args().keep
    with tempfile.TemporaryDirectory(prefix="nrdf-wheel-") as name:
        folder = Path(name)
        wheel = build(folder / "dist")
        faults = missing(wheel)
        if faults:
            print("not in the wheel:", *faults, sep="\n  ")
            return 1
        print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB, complete")
        run_demo(install(wheel, folder / "env"), folder / "empty")
        if keep is not None:
            keep.mkdir(parents=True, exist_ok=True)
            shutil.copy(wheel, keep)
    print("the wheel, installed alone, runs the demo")
    return 0


def build(folder: Path) -> Path:
    """The wheel, built by way of the source distribution."""
    command = [sys.executable, "-m", "build", "--outdir", str(folder), str(ROOT)]
    environment = {**os.environ, "PIP_CONSTRAINT": str(CONSTRAINTS)}
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if done.returncode:
        sys.exit(f"the wheel cannot be built:\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
    (wheel,) = folder.glob("*.whl")
    return wheel


def missing(wheel: Path) -> list[str]:
    """What should be in the wheel and is not: every source and data file, licences, metadata."""
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        (metadata_file,) = (name for name in names if name.endswith(".dist-info/METADATA"))
        metadata = archive.read(metadata_file).decode()
    wanted = {
        path.relative_to(SOURCES).as_posix()
        for package in ("nrdf", "nrdf_benchmark")
        for path in (SOURCES / package).rglob("*")
        if path.suffix in KINDS and "__pycache__" not in path.parts
    }
    info = metadata_file.rpartition("/")[0]
    wanted |= {f"{info}/entry_points.txt", f"{info}/licenses/LICENSE"}
    wanted.add(f"{info}/licenses/src/nrdf/bundled/ATTRIBUTION.txt")
    faults = sorted(wanted - names)
    foreign = {name.partition("/")[0] for name in names} - {"nrdf", "nrdf_benchmark", info}
    faults += [f"(and {name} should not be there)" for name in sorted(foreign)]
    for line in ("License-Expression: ", "Requires-Python: ", "Classifier: ", "Summary: "):
        if f"\n{line}" not in metadata:
            faults.append(f"METADATA: {line}")
    return faults


def install(wheel: Path, folder: Path) -> Path:
    """The commands' folder of a new environment with the wheel and its extra `robot`."""
    subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
    commands = folder / ("Scripts" if os.name == "nt" else "bin")
    pip = [str(commands / "python"), "-m", "pip", "install", "--quiet", "-c", str(CONSTRAINTS)]
    subprocess.run([*pip, f"nrdf[robot] @ {wheel.as_uri()}"], check=True)
    return commands


def run_demo(commands: Path, folder: Path) -> None:
    """`nrdf info` and `nrdf demo` in an empty folder, by nothing but the environment."""
    folder.mkdir()
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}

    def nrdf(*words: str) -> str:
        command = [str(commands / "nrdf"), *words]
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"nrdf {' '.join(words)} ended with {done.returncode}:\n{done.stderr[-3000:]}")
        return done.stdout

    known = json.loads(nrdf("info", "--as-json"))
    if not {"chair", "car", "plane"} <= {model["name"] for model in known["models"]}:
        sys.exit("nrdf info: the model zoo is not there")
    nrdf("eval")  # from nrdf_benchmark, by entry point
    print(nrdf("demo"))
    report = folder / "demo" / "stefan" / "simulation" / "report.html"
    if sys.version_info >= (3, 11) and not report.exists():
        sys.exit("nrdf demo: there is no simulation, though the extra robot is installed")


if __name__ == "__main__":
    sys.exit(main())
