"""The nine claims: every verdict borne out, and the page that says so up to date."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from pyverlet.cli import main
from pyverlet.lab import truth
from pyverlet.lab.truth import EXPERIMENTS, Finding, Number

PAGE = Path(__file__).resolve().parents[2] / "docs" / "truth.md"


@pytest.fixture(scope="module")
def findings() -> Sequence[Finding]:
    return [experiment.run() for experiment in EXPERIMENTS.values()]


def test_there_are_nine(findings: Sequence[Finding]) -> None:
    assert list(EXPERIMENTS) == [f"J{n}" for n in range(1, 10)]
    for finding in findings:
        assert finding.numbers
        # A number without a bound or a value on paper is an illustration; each experiment has some that can fail.
        assert any((n.expected, n.below, n.above) != (None, None, None) for n in finding.numbers)


@pytest.mark.parametrize("code", EXPERIMENTS)
def test_the_verdict_is_borne_out(findings: Sequence[Finding], code: str) -> None:
    (finding,) = [finding for finding in findings if finding.experiment.code == code]
    assert [number for number in finding.numbers if not number.holds] == []
    assert finding.verdict == finding.experiment.verdict


def test_the_page_is_what_the_code_writes(findings: Sequence[Finding]) -> None:
    assert PAGE.read_text(encoding="utf-8") == truth.markdown(findings), "pyverlet truth --markdown > docs/truth.md"


@pytest.mark.parametrize(
    ("number", "holds", "text"),
    [
        (Number("", 1.0, "m", expected=1.0), True, "1.000 m (on paper 1.000 m)"),
        (Number("", 1.1, "m", expected=1.0), False, "1.100 m (on paper 1.000 m)"),
        (Number("", 1.01, "m", expected=1.0, within=0.02), True, "1.010 m (on paper 1.000 m)"),
        (Number("", -1e-15, "J", below=1e-12), True, "below 1e-12 J"),
        (Number("", -1e-3, "J", below=1e-12), False, "-0.001000 J"),
        (Number("", float("nan"), "J", below=1e-12), False, "nan J"),
        (Number("", float("nan"), "J", expected=1.0), False, "nan J (on paper 1.000 J)"),
        (Number("", 31, above=30), True, "31"),
        (Number("", 30, above=30), False, "30"),
    ],
)
def test_numbers_hold_or_not(number: Number, holds: bool, text: str) -> None:
    assert number.holds is holds
    assert number.text == text


def test_a_verdict_that_is_not_borne_out_is_told(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    experiment = EXPERIMENTS["J8"]
    bouncing = truth.Experiment("J8", "", "", "", experiment.verdict, lambda: [Number("rise", 0.5, "m", below=1e-12)])
    monkeypatch.setitem(EXPERIMENTS, "J8", bouncing)
    assert main(["truth", "J8"]) == 1
    assert "not borne out by these numbers" in capsys.readouterr().out


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    code = main(["truth", *arguments])
    captured = capsys.readouterr()
    assert code == 0, captured.err
    return captured.out


def test_on_the_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    out = run(capsys, "j4", "J5")
    assert out.startswith("J4  Claim        Explicit Euler gains energy")
    assert "mean gain of a step: 0.01337 J (on paper 0.01337 J)" in out
    assert "\n\nJ5  Claim" in out
    assert max(map(len, out.splitlines())) <= 110
    (finding,) = json.loads(run(capsys, "J4", "--json"))
    assert (finding["code"], finding["holds"], finding["verdict"]) == ("J4", True, EXPERIMENTS["J4"].verdict)
    assert finding["numbers"][0]["value"] == pytest.approx(9.81**2 / 3600 / 2)
    assert "## J4. “Explicit Euler" in run(capsys, "J4", "--markdown")


def test_an_unknown_claim_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["truth", "J10"]) == 2
    assert "unknown claim 'J10'; known: J1, J2" in capsys.readouterr().err
