"""The scene `image`: where circles end does form the picture, and what is no picture is refused."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import pyverlet as pv
from pyverlet import scenes
from pyverlet.cli import main
from pyverlet.scenes import Settings
from pyverlet.scenes._picture import read
from pyverlet.scenes.image import SCENE

QUARTERS = np.array([[(255, 0, 0), (0, 255, 0)], [(0, 0, 255), (255, 255, 0)]], dtype=np.uint8)


@pytest.fixture
def quarters(tmp_path: Path) -> Path:
    """A picture of four colours: red and green above, blue and yellow below; 3:2."""
    path = tmp_path / "quarters.png"
    Image.fromarray(QUARTERS.repeat(40, axis=0).repeat(60, axis=1)).save(path)
    return path


def settings(picture: Path | None, **options: object) -> Settings:
    return SCENE.settings(particles=300, picture=picture, **options)


def test_the_second_run_forms_the_picture(quarters: Path) -> None:
    chosen = settings(quarters)
    assert SCENE.show.colours is not None
    assert SCENE.show.seconds is not None
    told: list[tuple[int, int]] = []
    colours = SCENE.show.colours(chosen, 1 / 60, lambda *said: told.append(said))
    frames = round(SCENE.show.seconds(chosen) * 60)
    assert told == [(k, frames) for k in range(1, frames + 1)]
    world = SCENE.build(chosen)
    for _ in range(frames):
        world.step(1 / 60)
    # Equal bits: no circle is in another place than in the first run, so each has the colour of its quarter, without exception.
    x, y = world.position.T
    top = np.quantile(y + world.radius, 0.995)
    expected = QUARTERS[(y <= top / 2).astype(int), (x >= 0).astype(int)]
    assert (colours == expected).all()
    # And it is a heap at rest: 1 J is one circle of 1 kg falling 10 cm.
    assert world.energy().kinetic / len(world) < 0.02
    # The heap has the picture's shape, 3:2, as far as 300 circles of half a metre can.
    extent = world.boundary.extent()
    assert extent is not None
    assert (extent[2] - extent[0]) / top == pytest.approx(1.5, rel=0.1)


@pytest.mark.slow
def test_recorded_it_shows_the_picture(quarters: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.png"
    command = ["record", "image", str(out), "--picture", str(quarters), "--particles", "300", "--size", "300x200"]
    assert main(command) == 0
    with Image.open(out) as file:
        pixels = np.asarray(file, dtype=float)
    for row, column in np.ndindex(2, 2):
        # The middle of each quarter, away from where they meet; between the circles is ground, 16 to 20 % of it.
        part = pixels[30 + 90 * row : 80 + 90 * row, 30 + 140 * column : 120 + 140 * column].reshape(-1, 3)
        assert part.mean(axis=0) == pytest.approx(0.83 * QUARTERS[row, column], abs=25)


def test_without_a_picture_there_is_one_of_our_own() -> None:
    assert SCENE.show.colours is not None
    colours = SCENE.show.colours(settings(None), 1 / 60, None)
    # Sea below, sky above, and a white sail: a circle in ten shows it.
    assert len(np.unique(colours, axis=0)) > 50
    assert 10 < (colours == 255).all(axis=1).sum() < 60


@pytest.mark.parametrize("count", [1, 2, 3, 7, 50, 333])
@pytest.mark.parametrize("spread", [1.0, 1.5, 3.0])
def test_any_number_starts_inside_without_overlap(count: int, spread: float) -> None:
    world = SCENE.world(particles=count, radius_spread=spread, seed=count)
    assert world.escaped() == 0
    assert world.overlap().max == 0.0
    world.step(1 / 60)


def test_the_view_is_the_picture_not_the_jet(quarters: Path) -> None:
    chosen = settings(quarters)
    assert SCENE.show.view is not None
    x0, y0, x1, y1 = SCENE.show.view(chosen)
    assert (x1 - x0) / (y1 - y0) == pytest.approx(1.5, rel=0.03)
    extent = SCENE.build(chosen).boundary.extent()
    assert extent is not None
    assert extent[3] > 1.5 * y1


def test_transparent_pictures_stand_on_white(tmp_path: Path) -> None:
    Image.fromarray(np.array([[(255, 0, 0, 255), (255, 0, 0, 0)]], dtype=np.uint8)).save(tmp_path / "a.png")
    assert read(tmp_path / "a.png").tolist() == [[[255, 0, 0], [255, 255, 255]]]


def test_large_pictures_are_made_smaller(tmp_path: Path) -> None:
    Image.new("L", (3000, 1500), 99).save(tmp_path / "a.jpg")
    assert read(tmp_path / "a.jpg").shape == (512, 1024, 3)


def test_what_is_no_picture_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.png").write_text("not a picture")
    Image.new("RGB", (900, 100)).save(tmp_path / "thin.png")
    Image.new("RGB", (90, 100)).save(tmp_path / "cut.png")
    whole = (tmp_path / "cut.png").read_bytes()
    (tmp_path / "cut.png").write_bytes(whole[: len(whole) // 2])
    for name, says in (
        ("none.png", "does not exist"),
        ("text.png", "not a picture"),
        ("cut.png", "not a picture"),
        ("thin.png", "900 x 100 pixels; allowed is at most 4 times"),
        (".", "allowed is a file"),
    ):
        with pytest.raises(pv.InputError, match=says):
            SCENE.world(picture=tmp_path / name)


def test_only_image_takes_a_picture(quarters: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "cage", "--picture", str(quarters), "--frames", "1"]) == 2
    assert "allowed is none, since the scene 'cage' shows none" in capsys.readouterr().err
    for scene in scenes.SCENES.values():
        assert (scene.show.colours is not None) == (scene.name == "image")


def test_a_missing_extra_names_the_command(quarters: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda module: None)
    with pytest.raises(pv.InputError, match=r"pip install 'pyverlet\[record\]'"):
        SCENE.world(picture=quarters)
