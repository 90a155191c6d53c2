"""Measure what docs/guides/studio.md says about speed, on the bundled chairs.

    python tools/studio_speed.py

Processor time of this program, in seconds; what the browser takes to draw comes on top.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import nrdf
from nrdf.bundled import REFERENCE as CHAIR
from nrdf.bundled import TARGETS, bundled_chair
from nrdf.geometry.similarity import Similarity
from nrdf.io.cloud import PointCloud, write_cloud
from nrdf.scans.simulate import ScanSettings, simulate_scan
from nrdf.shapes.families import get_family
from nrdf.studio.model.computing import LocalComputing
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.editor import Editor
from nrdf.studio.model.paintable_cloud import PaintableCloud
from nrdf.studio.model.result_cache import ResultCache
from nrdf.studio.model.session import Session
from nrdf.studio.model.uploads import bundled
from nrdf.studio.scene.drawing import colours_of

TIMES = 5


def took(work: Callable[[], object], times: int = TIMES) -> float:
    """The shortest processor time of several runs."""
    spent = []
    for _ in range(times):
        start = time.process_time()
        work()
        spent.append(time.process_time() - start)
    return min(spent)


def main() -> None:
    """Print a line for each measurement."""
    truth = bundled_chair(CHAIR)[1]
    model = nrdf.load_model("chair")
    with tempfile.TemporaryDirectory() as folder:
        editor = Editor(Session(folder))
        editor.open_reference(CHAIR, bundled(CHAIR), "chair")
        for name, kind in (("seat", "sand"), ("back-front", "polish")):
            editor.add_region(name)
            editor.paint(REFERENCE, name, truth[name])
            editor.restart_step(name, 0, kind)
        editor.add_target(TARGETS[0], bundled(TARGETS[0]))
        results = ResultCache(editor, LocalComputing(lambda category: model))
        cloud = editor.paintable(REFERENCE)
        middle = int(np.flatnonzero(truth["seat"])[0])

        def grow() -> None:
            editor.paint(REFERENCE, "seat", truth["seat"] | cloud.canvas.patch(middle, 0.2))
            colours_of(editor, results, REFERENCE)

        def plan() -> None:
            results.make_plans(editor.document, silent)

        grow()
        print(f"a click of Grow, 0.2 m, its colours and the saved session: {took(grow):.4f} s")
        editor.paint(REFERENCE, "seat", truth["seat"])
        print(f"plans on a seat and a backrest: {took(plan, 1):.2f} s")
        editor.change_numbers("seat", 0, {"stepover_mm": 22.0})
        print(f"the seat's plan again, after a number was changed: {took(plan, 1):.2f} s")
        looks(editor, results)
        drop(editor, results, Path(folder))
        document = editor.document
        spent = took(lambda: results.transfer(document, silent), 1)
        print(f"both on {TARGETS[0]}, regions and tool paths: {spent:.2f} s")
        spent = took(lambda: results.correspondence_features(document, silent), 1)
        features = results.correspondence_features(document, silent)
        print(f"similarity, the first point on two objects: {spent:.2f} s")
        spent = took(lambda: features.distances(middle))
        print(f"similarity, each point after it: {spent:.4f} s")


def looks(editor: Editor, results: ResultCache) -> None:
    """First looks while a slider is dragged: the seat, a backrest by cross-hatch, a film."""
    film = {
        "name": "gun", "radius_m": 0.05,
        "profile": {"across_m": 0.05, "along_m": 0.04, "flow_m3_s": 4e-7},
    }  # fmt: skip
    for what, region, first, step in (
        ("sanding, raster", "seat", 30.0, {}),
        ("polishing, cross-hatch", "back-front", 24.0, {}),
        ("a film", "seat", 40.0, {
            "tool": film, "standoff_m": 0.15, "thickness_um": {"value": 60.0, "tolerance": 6.0}}),
    ):  # fmt: skip
        if step:
            editor.restart_step(region, 0, "paint")
            editor.change_step(region, 0, **step)
        results.make_plans(editor.document, silent)
        mesh = results.shown_mesh(editor.document.region(region))
        spent = []
        for moved in np.linspace(0.0, 6.0, 21)[1:]:
            editor.change_numbers(region, 0, {"stepover_mm": first + float(moved)})
            document = editor.document
            spent.append(took(lambda: results.look(document, region, 0, silent), 1))  # noqa: B023
        shown = results.shown_plan(editor.document.region(region), 0)
        assert mesh is not None and shown is not None and not shown.fault, shown
        assert (shown.left is not None) == bool(step), "what it leaves"
        print(
            f"a first look, {what}, {len(mesh.faces)} triangles: "
            f"median {np.median(spent):.2f} s, longest {max(spent):.2f} s"
        )
    editor.restart_step("seat", 0, "sand")


def drop(editor: Editor, results: ResultCache, folder: Path) -> None:
    """A scan of half a million points, as it is dropped: read, cleaned, placed, and drawn."""
    path = lying_scan(folder)
    content = path.read_bytes()
    for _ in range(2):
        start, clock = time.process_time(), time.monotonic()
        placed = results.read_scan(path.name, content, editor.document, None, silent)
        shown = PaintableCloud(placed.cloud)
        spent, waited = time.process_time() - start, time.monotonic() - clock
        print(f"a scan of {len(placed.cloud)} points: {spent:.1f} s, by the clock {waited:.1f} s")
    print(f"its surface, drawn after it: {took(lambda: shown.surface_for(0.025), 1):.1f} s")


def lying_scan(folder: Path) -> Path:
    """A dense scan, in millimetres, of a chair that lies in some pose on a floor."""
    kept = Path(__file__).parents[2] / "shared" / "objects" / "ikea" / "chair" / "jokkmokk.npz"
    if kept.is_file():
        held = np.load(kept)
        vertices, faces = held["vertices"].astype(float), held["faces"]
    else:
        made = get_family("chair").member(5).mesh()
        vertices, faces = made.vertices, made.faces
    turn = Rotation.from_euler("xyz", (100, 25, 40), degrees=True).as_matrix()
    scale = 850.0 / float(np.ptp(vertices, axis=0).max())
    scan = simulate_scan(
        vertices, faces, ScanSettings(views=6, pixels=715, noise=0.0005),
        np.random.default_rng(0), Similarity(turn, np.array([300.0, -200.0, 900.0]), scale), "mm",
    )  # fmt: skip
    path = folder / "dense-chair.ply"
    write_cloud(path, PointCloud(scan.cloud.points, scan.normals, unit="mm"))
    return path


def silent(done: int, total: int) -> None:
    """Ignores progress."""


if __name__ == "__main__":
    main()
