"""The command line: help, version, mistakes, exit codes."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from nrdf import cli

VERBS = [[name] for name in cli.verbs() if name not in cli.GROUPS]
VERBS += [[group, name] for group in cli.GROUPS for name in cli.verbs()[group]()]


def test_help_lists_every_verb_and_imports_nothing_heavy():
    code = (
        "import sys; from nrdf import cli; assert cli.run(['--help']) == 0; "
        "print([m for m in ('torch', 'scipy', 'matplotlib', 'numpy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    assert lines[-1] == "[]"
    for verb in cli.verbs():
        assert any(line.startswith(f"  {verb} ") for line in lines)


def test_help_fits_a_screen_in_three_groups(capsys):
    assert cli.run([]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) <= 24 and max(map(len, lines)) <= 80
    listed = [line.split()[0] for line in lines if line.startswith("  ")]
    users, makers = listed[:14], listed[14:]
    assert users == [
        "teach", "profile", "check", "transfer", "retrieve", "align", "cell", "export", "simulate",
        "run", "serve", "studio", "demo", "info",
    ]  # fmt: skip
    assert makers == ["model", "eval", "ablate"]


@pytest.mark.parametrize("group", cli.GROUPS)
def test_a_group_lists_its_verbs(group, capsys):
    for words in ([group], [group, "--help"]):
        assert cli.run(words) == 0
        lines = capsys.readouterr().out.splitlines()
        assert max(map(len, lines)) <= 100
        for verb in cli.verbs()[group]():
            assert any(line.startswith(f"  {verb} ") for line in lines)


@pytest.mark.parametrize("words", VERBS, ids=" ".join)
def test_every_verb_explains_itself_with_an_example(words, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")  # even on a wide terminal
    assert cli.run([*words, "--help"]) == 0
    said = capsys.readouterr().out
    assert re.search(rf"Example: nrdf {' '.join(words)}\s", said)
    assert max(map(len, said.splitlines())) <= 100
    assert "None" not in said and "PATH" not in said.replace("METHOD=PATH", "")
    assert not re.search(r"\b(STR|INT|FLOAT|BOOL)\b", said)
    assert "(default: True)" not in said and "(default: False)" not in said
    # A flag that switches something off says what it leaves out.
    for first, text in re.findall(r"--no-[a-z-]+ +(\w+) (.*)", said):
        assert first in ("Leave", "Do"), text


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["transfr"], "no verb 'transfr'; did you mean 'transfer'?"),
        (["synth", "chair"], "no verb 'synth'; did you mean 'model synth'?"),
        (["model", "trian"], "nrdf model has no verb 'trian'; did you mean 'train'?"),
        (["eval", "qq"], "nrdf eval has no verb 'qq'; known: bsrc, objects"),
        (["simulate", "job", "--pictres"], "nrdf simulate has no option --pictres; did you mean"),
        (["model", "kind", "chair", "--sede=1"], "no option --sede; did you mean '--seed'?"),
        (["retrieve", "--model", "chair"], "nrdf retrieve needs --reference, --region, --target"),
        (["model", "synth", "chair", "--count", "x"], "--count: invalid literal for int()"),
        (["check"], "Missing from nrdf check: FILE"),
        (["teach", "--category", "chair"], "nrdf teach needs --reference and --category"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_a_mistyped_word_is_named_with_the_nearest(words, message, capsys):
    assert cli.run(words) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert message in said and "--help" in said
    assert not set("│╭╰─") & set(said) and "Traceback" not in said


def test_what_is_resumable_is_a_verb(capsys, monkeypatch):
    assert {tuple(words.split()) for words in cli.RESUMABLE} <= {tuple(words) for words in VERBS}
    said = "interrupted; the same command goes on where it was"
    for words, resumed in (("model train chair", 1), ("info", 0), ("eval bsrc", 0)):
        monkeypatch.setattr(cli, "_run", lambda _: (_ for _ in ()).throw(KeyboardInterrupt))
        assert cli.run(words.split()) == 130
        assert (said in capsys.readouterr().err) == resumed


def test_what_only_the_benchmark_has_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setattr(cli, "entry_points", lambda group: ())
    assert "eval" not in cli.verbs()
    for words in (["eval", "bsrc"], ["ablate", "chair"]):
        assert cli.run(words) == 2
        assert "pip install 'nrdf[benchmark]'" in " ".join(capsys.readouterr().err.split())


def test_a_package_that_is_gone_adds_no_verbs_and_a_broken_one_is_told(monkeypatch):
    def found(value):
        monkeypatch.setattr(
            cli, "entry_points", lambda group: [EntryPoint("eval", value, "nrdf.commands")]
        )
        return cli.verbs()

    assert "eval" not in found("no_such_package.commands:evaluations")
    with pytest.raises(ModuleNotFoundError, match=r"nrdf\.no_such_module"):
        found("nrdf.no_such_module:evaluations")


def test_version(capsys):
    import nrdf

    assert cli.run(["--version"]) == 0
    assert capsys.readouterr().out == f"nrdf {nrdf.__version__}\n"


def test_verbose_works_anywhere(capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(["info", "-v", "--as-json"])
    assert ended.value.code == 0


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("words", [["--help"], ["--version"]])
def test_output_that_nobody_can_take_is_no_traceback(words):
    code = "import sys; from nrdf import cli; sys.exit(cli.run(sys.argv[1:]))"
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-c", code, *words], stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert "Traceback" not in done.stderr and done.returncode != 0
    assert "No space left on device" in done.stderr


def test_targets_may_come_after_other_options():
    words = ["transfer", "k.yaml", "--out", "jobs", "--target", "a", "b", "--workers", "2"]
    assert cli._with_targets_first(words) == [
        "transfer",
        "k.yaml",
        "a",
        "b",
        "--out",
        "jobs",
        "--workers",
        "2",
    ]
    assert cli._with_targets_first(["transfer", "k", "a"]) == ["transfer", "k", "a"]
