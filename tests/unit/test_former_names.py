"""Names that changed work under their former ones for one version, and warn."""

from typing import Any

import pytest

import pyverlet as pv


def test_former_names_warn_and_work() -> None:
    world = pv.World(boundary=pv.Periodic((0, 0), (4, 4)), substeps=2)
    world.add(position=(1, 1), radius=0.1)
    seen: list[Any] = []
    with pytest.warns(DeprecationWarning, match="onlooker is deprecated; it is called observer now"):
        world.onlooker = seen.append
    world.step(1 / 60)
    assert len(seen) == 1
    with pytest.warns(DeprecationWarning, match="observer"):
        assert world.onlooker is world.observer
    for owner, old, new in (
        (world.boundary, "seam", "periodic"), (world._state, "seam", "periodic"), (world._sorted, "seam", "periodic"),
        (world._sorted, "slots_of", "sorted_index"), (world, "noting_contacts", "recording_contacts"),
        (world, "tells_events", "records_events"),
    ):  # fmt: skip
        with pytest.warns(DeprecationWarning, match=f"{old} is deprecated; it is called {new} now"):
            assert getattr(owner, old) == getattr(owner, new)
