"""The golden files of the exports: a short job in every format.

After an intended change: PYTHONPATH=tests python -m builders.golden_exports writes them anew; read
the diff.
"""

from __future__ import annotations

from pathlib import Path

from builders.export_checks import read_bag
from builders.export_jobs import small_job
from nrdf.export.registry import FORMATS, export_job

GOLDEN = Path(__file__).parents[1] / "export" / "golden"


def summary_of_bag(folder: Path) -> str:
    """A bag as text: its database is not the same from version to version of SQLite."""
    lines = []
    for topic, time, message in read_bag(folder):
        poses = [getattr(p, "pose", p) for p in getattr(message, "poses", [])]
        points = [[p.position.x, p.position.y, p.position.z] for p in poses]
        lines.append(f"{time} {topic} {points}" + getattr(message, "data", ""))
    return "\n".join(lines) + "\n"


def golden(name: str, folder: Path) -> dict[str, bytes]:
    """Golden file's name to content, as they would be now."""
    files = export_job(small_job(), [name], folder)[name]
    if name == "ros2-bag":
        return {"ros2-bag.txt": summary_of_bag(folder / name / "bag").encode()}
    return {Path(file).name: (folder / file).read_bytes() for file in files}


if __name__ == "__main__":
    import tempfile

    GOLDEN.mkdir(exist_ok=True)
    for known in FORMATS:
        with tempfile.TemporaryDirectory() as place:
            for file, content in golden(known, Path(place)).items():
                (GOLDEN / file).write_bytes(content)
