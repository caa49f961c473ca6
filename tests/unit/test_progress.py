"""The line of progress: what it estimates, and from when."""

from __future__ import annotations

import pytest

from pyverlet.ground import progress
from pyverlet.ground.progress import Progress


def test_the_time_left_ignores_what_came_before_the_first_call(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    # 100 s of compiling, then a frame every second: with 10 of 60 done, 50 s are left, not 60 s * 109 / 10.
    now = [0.0]
    monkeypatch.setattr(progress, "monotonic", lambda: now[0])
    with Progress("frame") as line:
        now[0] = 99.0
        for done in range(1, 11):
            now[0] += 1.0
            line(done, 60)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "frame: 1 of 60"
    assert lines[-1] == "frame: 6 of 60, 54 s left"
