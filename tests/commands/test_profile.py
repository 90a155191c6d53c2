"""`nrdf profile`: from a strip's CSV to what stands in a knowledge file."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from nrdf import cli
from nrdf.process.tool_keys import Tool
from nrdf.process_model.spray_profile import SprayProfile

GUN = SprayProfile(0.05, 0.05, 4e-7, 0.15, across_exponent=2.5, along_exponent=2.5)


@pytest.fixture
def strip(tmp_path):
    x = np.linspace(-0.06, 0.06, 25)
    rows = [
        f"{1e3 * (a + 0.2):.3f},{1e6 * t:.5f}" for a, t in zip(x, GUN.strip(x, 0.3), strict=True)
    ]
    path = tmp_path / "strip.csv"
    path.write_text("offset_mm,thickness_um\n" + "\n".join(rows) + "\n")
    return path


def profile(strip, *more):
    return cli.run(["profile", str(strip), "--feed-mm-s", "300", "--standoff-mm", "150", *more])


def test_a_strip_becomes_the_profile_of_a_knowledge_file(strip, tmp_path, capsys):
    out, picture = tmp_path / "deep" / "gun.yaml", tmp_path / "strip.png"
    assert profile(strip, "--out", str(out), "--picture", str(picture)) == 0
    assert "off the strip by 0.0%" in capsys.readouterr().out
    tool = Tool.model_validate({"name": "gun", "radius_mm": 50, **yaml.safe_load(out.read_text())})
    found = tool.profile
    assert found is not None
    assert found.across_m == pytest.approx(0.05, rel=0.01)
    assert found.across_exponent == pytest.approx(2.5, rel=0.02)
    assert found.flow_m3_s == pytest.approx(4e-7, rel=0.01)
    assert found.standoff_m == pytest.approx(0.15)
    assert picture.read_bytes()[:4] == b"\x89PNG"


def test_a_second_strip_tells_the_other_half_width(strip, tmp_path, capsys):
    narrow = tmp_path / "along.csv"
    x = np.linspace(-0.03, 0.03, 25)
    film = SprayProfile(0.02, 0.05, 4e-7, 0.15).strip(x, 0.3)
    rows = [f"{1e3 * a:.3f},{1e6 * t:.5f}" for a, t in zip(x, film, strict=True)]
    narrow.write_text("offset_mm,thickness_um\n" + "\n".join(rows) + "\n")
    assert profile(strip, "--along", str(narrow)) == 0
    found = yaml.safe_load(capsys.readouterr().out.split("off the strip")[0])["profile"]
    assert found["along_mm"] == pytest.approx(20.0, rel=0.02)


def test_a_strip_of_another_form_is_said_and_no_strip_refused(strip, tmp_path, capsys):
    strip.write_text(
        "offset_mm,thickness_um\n" + "\n".join(f"{x},{5 + abs(x)}" for x in range(-20, 21, 2))
    )
    assert profile(strip) == 0
    assert "another form than a beta" in " ".join(capsys.readouterr().err.split())
    strip.write_text("x,y\n1,2\n")
    assert profile(strip, "--out", str(tmp_path / "gun.yaml")) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "a measured strip needs offset_mm and thickness_um" in said
    assert not (tmp_path / "gun.yaml").exists()
    assert profile(strip, "--out", str(strip)) == 2  # its own input
