"""Films that are pages: one file that asks nobody for anything, plays what the world did, and survives being cut off."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect
from tests.worlds import refused

import pyverlet as pv
from pyverlet import record
from pyverlet.cli import main
from pyverlet.picture import LIGHT, BySpeed, Fixed
from pyverlet.record._films import Disk
from pyverlet.record._reel import FINENESS
from pyverlet.viewers import bundle

from .browser import comes_true, each, everywhere, number, shown, status, tab

BYTES = 15e6 / (5_000 * 10)
"""That a circle may take for a second: 5,000 for 10 s are to fit into 15 MB."""

FPS = 60


@pytest.fixture
def page(chrome: Browser) -> Iterator[Page]:
    asked: list[str] = []
    with tab(chrome) as page:
        page.on("request", lambda request: asked.append(request.url))
        yield page
    assert len(asked) == 1  # the file itself, once


def restless() -> pv.World:
    """Circles that bounce, a bridge of sticks, a wheel that turns, and some that come and go."""
    world = pv.World(boundary=pv.Box((-6, 0), (6, 12)), collisions=pv.Collisions(restitution=0.8))
    rng = np.random.default_rng(1)
    world.add(position=rng.uniform((-5, 6), (5, 11), (60, 2)), velocity=rng.normal(0, 3, (60, 2)), radius=0.2)
    pv.bridge(world, (-4, 4), (4, 4))
    world.obstacles.append(pv.Capsule((-1, 1), (1, 1), radius=0.2, angular_velocity=2.0))
    world.actors.append(pv.Emitter(pv.Box((-1, 10), (1, 12)), rate=20, radius=0.2))
    world.actors.append(pv.Sink(pv.Box((-6, 0), (-4, 2))))
    return world


def seek(page: Page, frame: int) -> None:
    """Pause at a frame, as the bar does."""
    page.evaluate("(k) => { pyverlet.player.paused = true; pyverlet.player.go(k); }", frame)
    assert comes_true(page, lambda: abs(float(status(page)["time"]) - frame / FPS) < 1e-6)


def visit(page: Page, path: Path) -> None:
    page.goto(path.as_uri())
    assert comes_true(page, lambda: page.evaluate("() => Boolean(window.pyverlet?.status())"))


def test_the_page_shows_what_the_world_did(page: Page, tmp_path: Path) -> None:
    done = record.to_video(restless(), tmp_path / "a.html", seconds=1.5, fps=FPS)
    assert (done.pictures, done.seconds) == (90, 1.5)
    visit(page, tmp_path / "a.html")
    world, at = restless(), 0
    counts = set()
    for frame in (0, 1, 2, 40, 59, 60, 61, 89):  # over the edge of a chunk, too
        while at < frame:
            world.step(1 / FPS)
            at += 1
        seek(page, frame)
        counts.add(len(world))
        # Half a step of the film's grid and half a place of the picture's, along each axis.
        x0, y0, x1, y1 = shown(page, "camera.room")
        half = 0.2 / FINENESS / 2 + max(x1 - x0, y1 - y0) / 65535 / 2
        assert np.abs(everywhere(page, len(world))[:, :2] - world.position).max() < 1.01 * half
        found = status(page)
        assert found["particles"] == len(world)
        assert found["kinetic"] == pytest.approx(float(world.energy().kinetic), rel=1e-9)
        assert shown(page, "overlay.links") == len(world.links.pulls()[0])
    assert len(counts) > 3


@pytest.mark.slow
def test_velocities_colours_zoom_and_time(page: Page, tmp_path: Path) -> None:
    world = pv.scenes.get("cage").world(particles=300)
    record.to_video(world, tmp_path / "heap.html", seconds=1, colour=BySpeed(), theme=LIGHT)
    visit(page, tmp_path / "heap.html")
    expect(page.locator("#title")).to_have_text("heap")
    assert page.locator("#pyverlet").get_attribute("data-theme") == "light"
    assert page.locator("#colour").input_value() == "speed"
    assert comes_true(page, lambda: status(page)["paused"])  # at its end
    assert number(page, "time") == pytest.approx(59 / 60, abs=1e-3)
    seek(page, 30)
    page.keyboard.press("v")
    assert comes_true(page, lambda: shown(page, "overlay.arrows") > 100)
    before = everywhere(page, 300)
    page.keyboard.press("+")
    page.keyboard.press("+")
    assert comes_true(page, lambda: everywhere(page, 300)[0, 2] != before[0, 2])
    page.keyboard.press("ArrowLeft")
    assert comes_true(page, lambda: status(page)["time"] == 0)
    page.keyboard.press(" ")
    assert comes_true(page, lambda: status(page)["time"] > 0.1)
    page.select_option("#speed", "0.03125")
    # Between two frames: slow motion is smooth.
    assert comes_true(page, lambda: abs(status(page)["time"] * FPS % 1 - 0.5) < 0.45)
    for live in ("gravity", "scene", "physics-ms", "copy"):
        expect(page.get_by_test_id(live)).to_be_hidden()
    page.get_by_test_id("help").click()
    expect(page.get_by_test_id("sheet")).not_to_contain_text("gravity")


@pytest.mark.slow
def test_a_film_that_was_cut_off_plays_what_there_is(page: Page, tmp_path: Path) -> None:
    record.to_video(pv.scenes.get("box").world(particles=20), tmp_path / "a.html", seconds=3, fps=FPS)
    whole = (tmp_path / "a.html").read_bytes()
    last = whole.rindex(b"<script type=")
    (tmp_path / "cut.html").write_bytes(whole[: last + 300])
    visit(page, tmp_path / "cut.html")
    assert shown(page, "player.reel.length") == 120
    seek(page, 119)


@pytest.mark.slow
def test_a_full_disk_leaves_the_seconds_before(page: Page, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Full(Disk):
        def write(self, data: bytes) -> int:
            if self.end + len(data) > 200_000 and self.error is None:
                self.error = OSError(28, "No space left on device")
            return super().write(data)

    monkeypatch.setattr("pyverlet.record._films.Disk", Full)
    with pytest.raises(pv.PyverletError, match="No space left on device") as told:
        record.to_video(pv.scenes.get("cage").world(particles=300), tmp_path / "a.html", seconds=30)
    kept = int(str(told.value).partition("holds the first ")[2].split()[0])
    assert kept in range(60, 1800, 60)
    visit(page, tmp_path / "a.html")
    assert shown(page, "player.reel.length") == kept


@pytest.mark.slow
def test_colours_of_ones_own_come_along(page: Page, tmp_path: Path) -> None:
    world = pv.scenes.get("box").world(particles=3)
    record.to_video(world, tmp_path / "a.html", seconds=0.1, colour=Fixed([(255, 0, 0), (0, 255, 0), (0, 0, 255)]))
    visit(page, tmp_path / "a.html")
    assert each(page, "tint", 3).tolist() == [0x0000FF, 0x00FF00, 0xFF0000]


def test_it_is_small_and_the_same_every_time(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        record.to_video(pv.scenes.get("cage").world(particles=500), tmp_path / name / "c.html", seconds=3)
    film = (tmp_path / "a" / "c.html").read_bytes()
    assert film == (tmp_path / "b" / "c.html").read_bytes()
    assert len(film) < BYTES * 500 * 3 + len(bundle.film("c", fps=60, colour="order", theme="dark"))


def test_from_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str], refusal: Any) -> None:
    path = tmp_path / "a.html"
    assert main(["record", "cage", str(path), "--particles", "20", "--seconds", "0.1"]) == 0
    assert "6 pictures, 0.1 s" in capsys.readouterr().err
    assert "allowed for .html is none" in refusal("record", "cage", str(path), "--size", "640x360")
    refused("finds its scale itself", record.to_video, pv.World(), path, seconds=0.1, colour=BySpeed(full=3.0))
