"""When pictures of slow worlds are due."""

from __future__ import annotations

from itertools import pairwise

import pytest

from pyverlet.viewers.frame_pacing import PICTURE_S, FramePacing


def made(pacing: FramePacing, ends: list[float]) -> list[float]:
    """Which of these times, the ends of substeps, have a picture."""
    shown = []
    for end in ends:
        if pacing.due(end):
            pacing.made(end)
            shown.append(end)
    return shown


@pytest.mark.parametrize("substep_ms", [0.4, 5.6, 6.0, 8.0, 9.5, 12.0, 16.0])
def test_a_world_of_short_substeps_has_as_many_pictures_as_a_screen(substep_ms: float) -> None:
    shown = made(FramePacing(), [1.0 + k * substep_ms / 1000 for k in range(round(10_000 / substep_ms))])
    assert len(shown) == pytest.approx(600, abs=2)
    gaps = [b - a for a, b in pairwise(shown[1:])]
    assert max(gaps) < PICTURE_S + substep_ms / 1000 + 1e-9
    assert min(gaps) > PICTURE_S - substep_ms / 1000 - 1e-9


def test_a_world_of_long_substeps_has_one_after_each() -> None:
    ends = [0.03 * k for k in range(1, 100)]
    assert made(FramePacing(), ends) == ends


def test_of_what_was_missed_one_is_made_up_for() -> None:
    pacing = FramePacing()
    assert made(pacing, [1.0, 3.0, 3.001, 3.002, 3.003, 3.0167]) == [1.0, 3.0, 3.001, 3.0167]
