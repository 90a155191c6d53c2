"""Replaces a result over and over, killed (-9) before every single change on disk, one by one.

Usage: kill_points.py FOLDER [inside]. Prints how many points there were; an AssertionError else.
"inside": FOLDER/result is where the process works, so it cannot be moved.
"""

from __future__ import annotations

import os
import shutil
import signal
import sys
from pathlib import Path

from nrdf.io.output import output_folder
from nrdf.io.result_folder import MANIFEST

EVENTS = ("os.rename", "os.remove", "os.rmdir", "os.mkdir")
FOREIGN = {"mine.txt": "mine", "sub/note.txt": "mine", "other/deep/x.txt": "mine"}
FIRST = {"a.txt": "1", "gone.txt": "1", "sub/b.txt": "1", "left/c.txt": "1", "report.json": "1"}
SECOND = {"a.txt": "2", "new.txt": "2", "sub/b.txt": "2", "report.json": "2"}

root, inside = Path(sys.argv[1]), len(sys.argv) > 2
left, armed = 0, False


def count(event: str, arguments: tuple) -> None:
    global left
    if armed and event in EVENTS:
        if left == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        left -= 1


def write(folder: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def run(files: dict[str, str]) -> None:
    with output_folder(root / "result", overwrite=True) as folder:
        write(folder, files)


def found(folder: Path) -> dict[str, str]:
    files = [path for path in folder.rglob("*") if path.is_file()]
    files = [path for path in files if not path.relative_to(folder).parts[0].startswith(".")]
    return {path.relative_to(folder).as_posix(): path.read_text() for path in files}


def check_after_kill(point: int) -> None:
    seen = found(root / "result")
    ours = {name: text for name, text in seen.items() if name not in FOREIGN}
    if inside:
        whole = ours.get("report.json")
        expected = [FIRST] if whole == "1" else [SECOND] if whole == "2" else [ours]
    else:
        expected = [FIRST, SECOND]
        if not (root / "result").exists():
            (aside,) = root.glob(".result.*.old")
            assert found(aside) == FIRST | FOREIGN, point
            return
    assert ours in expected, (point, ours)
    everywhere = [found(path) for path in root.iterdir() if path.is_dir()]
    assert all(any(n in files for files in everywhere) for n in FOREIGN), point


def main() -> None:
    global left, armed
    sys.addaudithook(count)
    point, done = 0, False
    while not done:
        shutil.rmtree(root, ignore_errors=True)
        (root / "result").mkdir(parents=True)
        if inside:
            os.chdir(root / "result")
        write(root / "result", FOREIGN)
        run(FIRST)
        child = os.fork()
        if child == 0:
            left, armed = point, True
            run(SECOND)
            os._exit(0)
        status = os.waitpid(child, 0)[1]
        done = os.WIFEXITED(status)
        assert not done or os.WEXITSTATUS(status) == 0
        check_after_kill(point)
        run(SECOND)
        assert found(root / "result") == SECOND | FOREIGN, (point, found(root / "result"))
        assert [path.name for path in root.iterdir()] == ["result"], point
        hidden = [p.name for p in (root / "result").iterdir() if p.name.startswith(".")]
        assert hidden == [MANIFEST], point
        assert not (root / "result" / "left").exists(), point
        point += 1
    sys.stdout.write(str(point - 1))


if __name__ == "__main__":
    main()
