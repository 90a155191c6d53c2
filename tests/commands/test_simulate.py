"""`nrdf simulate`: where the arm stands, and where the results go."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from nrdf import cli
from nrdf.commands.simulate import _placement
from nrdf.errors import NrdfError


def test_a_base_that_is_given_looks_at_the_object_which_stays():
    placement, count = _placement(("1", "1", "0"), 0.4, None)
    assert count == 1 and placement.base_m == (1.0, 1.0, 0.0) and placement.stand_m == 0.4
    assert placement.base_yaw_rad == pytest.approx(-3 * np.pi / 4)
    assert _placement(("auto",), 0.0, None) == (None, 12)
    assert _placement(("0", "-1", "0"), 0.0, 4)[1] == 4


@pytest.mark.parametrize("base", [("1", "2"), ("a", "b", "c"), ("nan", "0", "0")])
def test_a_base_is_auto_or_three_numbers(base):
    with pytest.raises(NrdfError, match="--base"):
        _placement(base, 0.0, None)


def test_results_go_into_the_job_unless_told(plate_job, tmp_path, monkeypatch, capsys):
    pytest.importorskip("mujoco")
    seen = []

    def write_simulation(folder, done, title, origin, pictures, film, progress):
        seen.append((done, title, pictures, film))
        (folder / "report.json").write_text("{}")
        return {}

    job = tmp_path / "job"
    shutil.copytree(plate_job, job)
    monkeypatch.setattr("nrdf.robot.report.folder.write_simulation", write_simulation)
    monkeypatch.setattr("nrdf.robot.simulation.simulate.simulate", lambda *_: "done")
    monkeypatch.setattr("nrdf.commands.simulate.show_simulation", lambda report: None)
    assert cli.run(["simulate", str(job), "--no-pictures"]) == 0
    assert seen == [("done", "job", False, False)]
    assert (job / "simulation" / "report.json").exists()
    assert cli.run(["simulate", str(job)]) == 2
    assert "is not empty" in " ".join(capsys.readouterr().err.split())
