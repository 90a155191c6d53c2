"""Readers of exported programs, from each language's grammar: strict, and strangers to the writers.

Whatever a line is not known to be fails. Each gives a list of paths, each a list of `Read`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

REAL = r"-?\d+\.\d+"


@dataclass
class Read:
    """A waypoint: metres, a matrix (3, 3) or the axis (3,) from tip to holder, m/s, N, s.

    feed_m_s is None for the first waypoint of a path, which is not driven on a line.
    """

    kind: str
    position: np.ndarray
    orientation: np.ndarray
    feed_m_s: float | None
    force_n: float | None = None
    dwell_s: float = 0.0


def read_lines(path: Path, newline: str = "\n", longest: int = 10_000) -> list[str]:
    raw = path.read_bytes()
    assert raw.isascii() and raw.endswith(newline.encode())
    assert raw.count(b"\n") == raw.count(newline.encode())
    lines = raw.decode("ascii").split(newline)[:-1]
    assert all(line.isprintable() and len(line) <= longest for line in lines)
    return lines


def floats(text: str, count: int) -> list[float]:
    values = re.split(r"\s*,\s*", text.strip())
    assert len(values) == count and all(re.fullmatch(REAL, v) for v in values), text
    return [float(v) for v in values]


def kind_of(comment: str) -> str | None:
    found = re.match(r"Segment \d+: (approach|process|retract), line \d+, ", comment, re.I)
    return found[1].lower() if found else None


def read_apt(path: Path) -> list[list[Read]]:
    text = "\n".join(line for line in read_lines(path, longest=72) if not line.startswith("$$"))
    assert "PPRINT" in text
    paths: list[list[Read]] = []
    feed, kind, rapid = None, "", False
    statements = text.replace(",$\n", ",").split("\n")
    assert statements[0].startswith("PARTNO/") and statements[-2:] == ["END", "FINI"]
    assert statements[1:3] == ["UNITS/MM", "MULTAX/ON"]
    for statement in statements[3:-2]:
        word, _, rest = statement.partition("/")
        if word == "PPRINT":
            kind = kind_of(rest) or kind
        elif word == "LOADTL":
            assert int(rest) > 0
        elif word == "CUTTER":
            assert floats(rest, 1)[0] > 0
            paths.append([])
        elif word == "SPINDL":
            assert re.fullmatch(rf"{REAL},RPM,CLW|OFF", rest)
        elif statement == "RAPID":
            rapid = True
        elif word == "FEDRAT":
            feed = floats(rest.removesuffix(",MMPM"), 1)[0] / 60_000
        elif word == "DELAY":
            paths[-1][-1].dwell_s = floats(rest, 1)[0]
        else:
            assert word == "GOTO", statement
            values = np.array(floats(rest, 6))
            paths[-1].append(Read(kind, values[:3] / 1000, values[3:], None if rapid else feed))
            rapid = False
    return paths


def read_gcode(path: Path, rotary: str, tcp_control: bool = True) -> list[list[Read]]:
    lines = read_lines(path, longest=80)
    assert lines[0] == lines[-1] == "%" and re.fullmatch(r"O\d{4} \(\w+\)", lines[1])
    assert lines[-2] == "M30"
    paths: list[list[Read]] = []
    kind, feed, modal = "", 0.0, ""
    for line in lines[2:-2]:
        comment = re.fullmatch(r"\(([^()]*)\)", line)
        if comment:
            assert line == line.upper()
            kind = kind_of(comment[1]) or kind
            continue
        assert re.fullmatch(r"([A-Z]-?\d+(\.\d+)?)( [A-Z]-?\d+(\.\d+)?)*", line), line
        words = [(word[0], float(word[1:])) for word in line.split()]
        code = [f"{letter}{value:g}" for letter, value in words if letter in "GM"]
        axes = {letter: value for letter, value in words if letter in "XYZABC"}
        if code == ["G21", "G90", "G94", "G17", "G40", "G49", "G80"]:
            modal = "ready"
        elif code == ["G4"]:
            paths[-1][-1].dwell_s = axes["X"]
        elif code == ["G43.4"] or code == ["G43"]:
            assert (code == ["G43.4"]) == tcp_control and words[1][0] == "H"
            modal = "offset"
            paths.append([])
        elif code in (["G0"], ["G1"]) and modal == "offset":
            assert set(axes) == set("XYZ" + rotary)
            assert all("." in word for word in line.split() if word[0] in axes)
            first, second = np.radians([axes[letter] for letter in rotary])
            turn = Rotation.from_euler("z", second)
            turn = turn * Rotation.from_euler("x" if rotary == "AC" else "y", first)
            position = np.array([axes[letter] for letter in "XYZ"]) / 1000
            position = position if tcp_control else turn.apply(position)
            feed = dict(words).get("F", feed * 60_000) / 60_000
            arrived = turn.apply([0.0, 0.0, 1.0])
            paths[-1].append(Read(kind, position, arrived, feed if code == ["G1"] else None))
        elif code == ["G49"]:
            modal = "ready"
        else:
            assert modal == "ready" or code == ["M5"]
            assert re.fullmatch(r"G5[4-9]|T\d+ M6|S\d+ M3|M5|G53 G0 Z0\.0|G0 [AB]\S+ C\S+", line), (
                line
            )
    return paths


def read_urscript(path: Path) -> list[list[Read]]:
    lines = [line.strip() for line in read_lines(path)]
    program = lines.index(next(line for line in lines if not line.startswith("#")))
    name = re.fullmatch(r"def ([a-zA-Z]\w*)\(\):", lines[program])
    assert name and lines[-1] == "end"
    defined: dict[str, list[Read]] = {}
    called: list[str] = []
    blocks = ["program"]
    kind, force, pressing, procedure = "", 0.0, False, ""
    pose = rf"pose_trans\(nrdf_frame, p\[({REAL}(?:, {REAL}){{5}})\]\)"
    motion = rf"movel\({pose}, a={REAL}, v=({REAL}), r=({REAL})\)"
    for line in lines[program + 1 :]:
        if line.startswith("#"):
            kind = kind_of(line[2:]) or kind
        elif line == "end":
            assert not (blocks[-1] == "procedure" and pressing)
            blocks.pop()
        elif found := re.fullmatch(r"def ([a-zA-Z]\w*)\(\):", line):
            procedure = found[1]
            assert procedure not in defined and blocks == ["program"]
            defined[procedure] = []
            blocks.append("procedure")
        elif line in ("thread nrdf_press():", "while True:"):
            blocks.append("thread")
        elif found := re.fullmatch(rf"nrdf_force_n = ({REAL})", line):
            force = float(found[1])
        elif line == "nrdf_pressing = run nrdf_press()":
            assert not pressing
            pressing = True
        elif line == "kill nrdf_pressing":
            assert pressing
            pressing = False
        elif line in ("zero_ftsensor()", "end_force_mode()"):
            assert not pressing and blocks[-1] == "procedure"
        elif found := re.fullmatch(rf"movej\({pose}, a={REAL}, v={REAL}\)", line):
            assert not defined[procedure] and not pressing
            defined[procedure].append(_turned(kind, found[1], None, None))
        elif found := re.fullmatch(motion, line):
            assert blocks[-1] == "procedure" and defined[procedure]
            read = _turned(kind, found[1], float(found[2]), force if pressing else None)
            last = defined[procedure][-1].position
            assert float(found[3]) < 0.5 * np.linalg.norm(read.position - last)
            defined[procedure].append(read)
        elif found := re.fullmatch(rf"sleep\(({REAL})\)", line):
            if not (len(defined[procedure]) == 1 and float(found[1]) == 0.2):
                defined[procedure][-1].dwell_s = float(found[1])
        elif found := re.fullmatch(r"(\w+)\(\)", line):
            assert blocks == (["program", "thread", "thread"] if line == "sync()" else ["program"])
            called += [found[1]] if line != "sync()" else []
        else:
            numbers = r"\[[^][]+\]"
            assert re.fullmatch(
                rf"force_mode\(get_actual_tcp_pose\(\), {numbers}, {numbers}, 2, {numbers}\)|"
                r'popup\("[\w .+-]+: [\w ,]+\?", title="nrdf", blocking=True\)|'
                rf"global nrdf_frame = p{numbers}|global nrdf_force_n = 0\.0",
                line,
            ), line
    assert blocks == [] and called == list(defined)
    return [defined[procedure] for procedure in called]


def _turned(kind: str, text: str, feed: float | None, force: float | None) -> Read:
    values = np.array(floats(text, 6))
    return Read(kind, values[:3], Rotation.from_rotvec(values[3:]).as_matrix(), feed, force)


def read_rapid(path: Path) -> list[list[Read]]:
    lines = [line.strip() for line in read_lines(path, "\r\n")]
    module = re.fullmatch(r"MODULE ([a-zA-Z]\w{0,31})", lines[0])
    assert module and lines[-1] == "ENDMODULE"
    vectors = rf"\[\[({REAL}(?:,{REAL}){{2}})\],\[({REAL}(?:,{REAL}){{3}})\],"
    target = vectors + r"\[0,0,0,0\],\[9E9,9E9,9E9,9E9,9E9,9E9\]\]"
    motion = rf"(Move[JL]) {target},(\w+),(\w+),([a-zA-Z]\w{{0,31}})\\WObj:=([a-zA-Z]\w{{0,31}});"
    speeds: dict[str, float] = {}
    called: list[str] = []
    routines: dict[str, list[Read]] = {}
    routine, kind = "", ""
    for line in lines[1:-1]:
        if line.startswith("!"):
            kind = kind_of(line[2:]) or kind
        elif found := re.fullmatch(
            rf"LOCAL CONST speeddata (\w+):=\[({REAL}),\d+,\d+,\d+\];", line
        ):
            speeds[found[1]] = float(found[2]) / 1000
        elif found := re.fullmatch(r"(?:LOCAL )?PROC ([a-zA-Z]\w{0,31})\(\)", line):
            assert not routine and found[1].lower() != module[1].lower()
            routine = found[1]
            routines[routine] = []
        elif line == "ENDPROC":
            assert routine
            routine = ""
        elif found := re.fullmatch(motion, line):
            move, position, turn, speed, zone = found.groups()[:5]
            q1, q2, q3, q4 = floats(turn, 4)
            assert abs(np.linalg.norm([q1, q2, q3, q4]) - 1) < 1e-6
            assert (move == "MoveJ") == (not routines[routine])
            assert zone in ("fine", "nrdf_zone")
            matrix = Rotation.from_quat([q2, q3, q4, q1]).as_matrix()
            feed = speeds[speed] if move == "MoveL" else None
            routines[routine].append(Read(kind, np.array(floats(position, 3)) / 1000, matrix, feed))
        elif found := re.fullmatch(rf"WaitTime ({REAL});", line):
            routines[routine][-1].dwell_s = float(found[1])
        elif found := re.fullmatch(r"([a-zA-Z]\w*);", line):
            called.append(found[1])
        else:
            zone = rf"LOCAL CONST zonedata nrdf_zone:=\[FALSE(,{REAL}){{3}},1,{REAL},1\];"
            assert re.fullmatch(rf"|Conf[JL]\\O(n|ff);|{zone}", line), line
    assert list(routines)[1:] == called
    return [routines[name] for name in called]


def read_krl(source: Path) -> list[list[Read]]:
    name = source.stem
    assert len(name) <= 24
    data = read_lines(source.with_suffix(".dat"), "\r\n")
    assert data[2] == f"DEFDAT {name}" and data[-1] == "ENDDAT"
    constants = dict(
        found.groups()
        for line in data
        if (found := re.fullmatch(r"DECL (?:INT|REAL) ([a-zA-Z]\w{0,23})=([\d.]+)", line))
    )
    assert len(constants) == len(data) - 5
    lines = read_lines(source, "\r\n")
    assert lines[:3] == ["&ACCESS RVP", "&REL 1", f"DEF {name}( )"]
    frame = r"\{" + ",".join(rf"{key} ({REAL})" for key in "XYZABC") + r"\}"
    routines: dict[str, list[Read]] = {name: []}
    called: list[str] = []
    routine, kind, feed = name, "", None
    for line in lines[3:]:
        if line.startswith(";"):
            kind = kind_of(line[2:]) or kind
        elif found := re.fullmatch(r"DEF ([a-zA-Z]\w{0,23})\( \)", line):
            assert not routine
            routine = found[1]
            routines[routine] = []
        elif line == "END":
            assert routine
            routine = ""
        elif found := re.fullmatch(rf"\$VEL\.CP=({REAL})", line):
            feed = float(found[1])
        elif found := re.fullmatch(rf"(PTP|LIN) {frame}( C_DIS)?", line):
            values = [float(v) for v in found.groups()[1:7]]
            matrix = Rotation.from_euler("ZYX", values[3:], degrees=True).as_matrix()
            assert (found[1] == "PTP") == (not routines[routine])
            reached = feed if found[1] == "LIN" else None
            routines[routine].append(Read(kind, np.array(values[:3]) / 1000, matrix, reached))
        elif found := re.fullmatch(rf"WAIT SEC ({REAL})", line):
            routines[routine][-1].dwell_s = float(found[1])
        elif found := re.fullmatch(r"BAS\(#(\w+),(\w+)\)", line):
            assert found[2].isdigit() or found[2] in constants
        elif found := re.fullmatch(r"([a-zA-Z]\w*)\( \)", line):
            called.append(found[1])
        else:
            assert line in ("", "PTP $AXIS_ACT", "$APO.CDIS=nrdf_blend_mm"), line
    assert list(routines)[1:] == called
    return [routines[name] for name in called]
