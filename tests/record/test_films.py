"""Recordings: the right number of pictures at the right times, the same bytes every time, and nothing broken by an early end."""

import hashlib
import importlib.util
import os
import signal
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from PIL import Image, ImageSequence
from tests.programs import Program, python
from tests.worlds import refused

import pyverlet as pv
from pyverlet import record
from pyverlet.picture import LIGHT, BySpeed
from pyverlet.viewers.renderer import PictureStyle

SIZE = (160, 120)


def heap() -> pv.World:
    return pv.scenes.get("cage").world(particles=200)


def movie_times(path: Path) -> list[float]:
    """Seconds at which each picture of a film is shown, by decoding all of it."""
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert stream.time_base is not None
        return [float(frame.pts * stream.time_base) for frame in container.decode(stream) if frame.pts is not None]


def durations_ms(path: Path) -> list[int]:
    """Milliseconds each picture of a GIF or WebP is shown, by decoding all of it."""
    with Image.open(path) as film:
        return [int(film.info["duration"]) for picture in ImageSequence.Iterator(film) if picture.load()]


def assert_shown(path: Path, count: int, fps: int) -> None:
    """So many pictures, all at their times."""
    if path.suffix == ".mp4":
        assert movie_times(path) == pytest.approx(np.arange(count) / fps, abs=1e-9)
    else:
        assert durations_ms(path) == [1000 // fps] * count


def test_mp4_has_every_picture_at_its_time(tmp_path: Path) -> None:
    done = record.to_video(heap(), tmp_path / "a.mp4", seconds=0.75, fps=60, size=SIZE)
    assert (done.pictures, done.seconds) == (45, 0.75)
    # MP4 counts time in whole parts of a second that 60 divides: exact.
    assert_shown(tmp_path / "a.mp4", 45, 60)
    with av.open(str(tmp_path / "a.mp4")) as container:
        stream = container.streams.video[0]
        assert (stream.width, stream.height) == SIZE
        assert stream.average_rate == 60
        assert container.duration == 750_000  # microseconds: the head knows it, as in any finished file


def test_mp4_shows_the_world(tmp_path: Path) -> None:
    # The last picture, decoded, beside the raster's own of a world stepped by hand: nearer to it than to pictures just before and
    # after. Compared by brightness, since the film halves the resolution of colour.
    record.to_video(heap(), tmp_path / "a.mp4", seconds=0.5, size=SIZE, theme=LIGHT)
    with av.open(str(tmp_path / "a.mp4")) as container:
        last = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)][-1]
    world = heap()
    errors = []
    for frame in range(33):
        expected = record.to_image(world, size=SIZE, theme=LIGHT)
        errors.append(float(np.abs((last.astype(float) - expected) @ (0.2126, 0.7152, 0.0722)).mean()))  # luma of BT.709
        assert world.frames == frame
        world.step(1 / 60)
    assert int(np.argmin(errors)) == 29
    assert errors[29] < 0.75 * min(errors[28], errors[30])
    assert np.abs(last[:10, :10].astype(int) - (0xF3, 0xF4, 0xF6)).max() <= 2  # the ground: film and reader agree on the colours


@pytest.mark.parametrize(("name", "fps", "unit"), [("a.gif", 30, 10), ("a.webp", 60, 1)])
def test_times_in_whole_units_do_not_drift(tmp_path: Path, name: str, fps: int, unit: int) -> None:
    # Hundredths or thousandths of a second, in ms: each picture begins within half of one of its time.
    record.to_video(heap(), tmp_path / name, seconds=30 / fps, fps=fps, size=SIZE)
    starts = np.concatenate(([0], np.cumsum(durations_ms(tmp_path / name))))
    assert np.abs(starts - np.arange(31) / fps * 1000).max() <= 0.5 * unit + 1e-9


def test_gif_keeps_the_colours(tmp_path: Path) -> None:
    record.to_video(heap(), tmp_path / "a.gif", seconds=0.04, size=SIZE)
    with Image.open(tmp_path / "a.gif") as film:
        first = np.asarray(film.convert("RGB"), dtype=float)
    assert np.abs(first - record.to_image(heap(), size=SIZE)).mean() < 5  # 256 colours of some thousand


def test_numbered_pictures_are_exact(tmp_path: Path) -> None:
    record.to_video(heap(), tmp_path / "frame-{:03d}.png", seconds=0.1, fps=60, size=SIZE, colour=BySpeed(full=3))
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == [f"frame-{k:03d}.png" for k in range(6)]
    world = heap()
    for k, name in enumerate(names):
        if k:
            world.step(1 / 60)
        with Image.open(tmp_path / name) as picture:
            assert (np.asarray(picture) == record.to_image(world, size=SIZE, colour=BySpeed(full=3))).all()


def test_a_plain_png_is_the_last_moment(tmp_path: Path) -> None:
    world = heap()
    plan = record.plan(tmp_path / "a.png", seconds=0.5, size=SIZE)
    done = record.shoot(world, plan, PictureStyle())
    assert (done.pictures, done.seconds, world.frames) == (1, 0.0, 30)
    with Image.open(tmp_path / "a.png") as picture:
        assert (np.asarray(picture) == record.to_image(world, size=SIZE)).all()


@pytest.mark.parametrize(("fps", "between"), [(60, 1), (50, 2), (30, 2), (25, 3), (24, 3), (10, 6), (1, 60), (120, 1), (7, 9)])
def test_physics_between_pictures(fps: int, between: int) -> None:
    plan = record.plan("a.webp", seconds=2, fps=fps)
    assert plan.frames_between == between
    assert plan.dt * between == pytest.approx(1 / fps, rel=1e-15)
    assert plan.dt <= 1 / 60 + 1e-12
    assert plan.pictures == 2 * fps


def test_the_world_is_stepped_to_the_last_picture(tmp_path: Path) -> None:
    world = heap()
    record.to_video(world, tmp_path / "a.gif", seconds=0.4, fps=10, size=(32, 32))
    assert world.frames == 3 * 6
    assert world.time == pytest.approx(0.3)


@pytest.mark.parametrize("suffix", [".mp4", ".gif", ".webp"])
def test_the_same_bytes_every_time(tmp_path: Path, suffix: str) -> None:
    def hash_of(name: str, threads: int) -> str:
        world = pv.scenes.get("cage").world(particles=1500, threads=threads)
        record.to_video(world, tmp_path / f"{name}{suffix}", seconds=0.3, size=SIZE, colour=BySpeed())
        return hashlib.blake2b((tmp_path / f"{name}{suffix}").read_bytes()).hexdigest()

    expected = hash_of("a", 1)
    assert hash_of("b", 1) == expected
    assert hash_of("c", min(2, pv.common.threads.max_threads())) == expected


def test_progress_is_told_after_every_picture(tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    record.to_video(heap(), tmp_path / "a.mp4", seconds=0.1, size=SIZE, progress=lambda *said: told.append(said))
    assert told == [(k, 6) for k in range(1, 7)]


@pytest.mark.parametrize("suffix", [".mp4", ".gif", ".webp"])
def test_ctrl_c_keeps_what_was_recorded(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"

    def interrupt(done: int, total: int) -> None:
        if done == 20:
            signal.raise_signal(signal.SIGINT)

    before = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(
            pv.errors.Interrupted, match=rf"interrupted; '.*a\{suffix}' holds the first 20 pictures, 0.4 s, and plays"
        ):
            record.to_video(heap(), path, seconds=5, fps=50, size=SIZE, progress=interrupt)
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert_shown(path, 20, 50)


@pytest.mark.parametrize("suffix", [".mp4", *(pytest.param(each, marks=pytest.mark.slow) for each in (".gif", ".webp"))])
@pytest.mark.skipif(os.name == "nt", reason="no limit on the size of files to set")
def test_a_full_disk_keeps_what_was_recorded(tmp_path: Path, suffix: str) -> None:
    # A limit on the size of files stands for the full disk: writing fails at the same place, with an OSError as well.
    code = (
        "import resource, signal, sys; from pyverlet.cli import main; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, 150_000))\n"
        f"sys.exit(main('record cage a{suffix} --particles 200 --seconds 60 --fps 50 --size 320x240'.split()))"
    )
    done = python("-c", code, cwd=tmp_path)
    assert done.returncode == 1, done.stderr
    last = done.stderr.splitlines()[-1]
    assert last.startswith("pyverlet: File too large; '")
    assert "Traceback" not in done.stderr
    count = int(last.partition("holds the first ")[2].split()[0])
    assert count >= 2  # of a film in fragments of a second
    assert_shown(tmp_path / f"a{suffix}", count, 50)


@pytest.mark.skipif(os.name == "nt", reason="no SIGINT to a child on Windows")
def test_ctrl_c_on_the_command_line(tmp_path: Path) -> None:
    command = ("record", "cage", "a.mp4", "--particles", "200", "--seconds", "10000", "--size", "160x120")
    with Program("-m", "pyverlet", *command, cwd=tmp_path) as program:
        program.line("recording: ", error=True)
        _, err = program.end()
    assert program.process.returncode == 130
    assert err.splitlines()[-1].startswith("pyverlet: interrupted; 'a.mp4' holds the first ")
    count = int(err.splitlines()[-1].partition("first ")[2].split()[0])
    assert len(movie_times(tmp_path / "a.mp4")) == count


def test_an_error_on_the_way_leaves_a_film_that_plays(tmp_path: Path) -> None:
    world = heap()

    def spoil(done: int, total: int) -> None:
        if done == 7:
            world.velocity[3] = np.nan

    with pytest.raises(pv.NonFiniteError):
        record.to_video(world, tmp_path / "a.mp4", seconds=1, size=SIZE, progress=spoil)
    assert len(movie_times(tmp_path / "a.mp4")) == 7


@pytest.mark.parametrize(
    ("name", "options", "says"),
    [
        ("a.avi", {}, r"'.*a.avi'; allowed is a name that ends in .mp4, .gif, .webp, .html, .png"),
        ("a", {}, "allowed is a name that ends in"), ("{}{}.png", {}, r"one number, such as frame-\{:04d\}.png"),
        ("{x}.png", {}, "one number"), ("frame-%04d.png", {}, r"one number, such as frame-\{:04d\}.png"),
        ("{{}}.png", {}, "one number"), ("none/a.mp4", {}, "none/a.mp4', which cannot be written: No such file"),
        ("none/a.png", {}, "none/a.png', which cannot be written: No such file"),
        ("folder.mp4", {}, "cannot be written: Is a directory"),
        ("a.mp4", {"size": (161, 120)}, "size is 161x120; allowed for .mp4 are even numbers of at least 16, such as 162x120"),
        ("a.mp4", {"size": (8, 120)}, "such as 16x120"),
        ("a.gif", {"fps": 60}, "fps is 60; allowed for .gif is at most 50"), ("a.mp4", {"fps": 0}, "fps is 0"),
        ("a.mp4", {"fps": 29.97}, "fps is 29.97; allowed is a whole number"),
        ("a.mp4", {"seconds": 0}, "seconds is 0"), ("a.mp4", {"seconds": float("nan")}, "seconds is nan"),
        ("a.mp4", {"seconds": 1e12}, "frames; allowed are at most"),
        ("a.mp4", {"colour": "speed"}, r"colour is 'speed'; allowed is an object such as pyverlet.picture.BySpeed\(\)"),
        ("a.mp4", {"theme": "dark"}, "theme is 'dark'"),
    ],
)  # fmt: skip
def test_bad_input_is_one_sentence_and_steps_nothing(tmp_path: Path, name: str, options: dict[str, Any], says: str) -> None:
    (tmp_path / "folder.mp4").mkdir()
    world = heap()
    refused(says, record.to_video, world, tmp_path / name, **{"size": SIZE} | options)
    assert world.frames == 0


def test_a_picture_without_a_file_needs_no_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda module: None)
    pixels = record.to_image(heap(), size=(64, 48))
    assert pixels.shape == (48, 64, 3)
    assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 50


def test_to_image_writes_where_it_is_told(tmp_path: Path) -> None:
    pixels = record.to_image(heap(), tmp_path / "a.png", size=SIZE)
    with Image.open(tmp_path / "a.png") as picture:
        assert (np.asarray(picture) == pixels).all()
    for name in ("a.jpg", "{}.png", "none/a.png"):
        refused("path is", record.to_image, heap(), tmp_path / name, size=SIZE)


def test_a_world_has_a_door_to_both(tmp_path: Path) -> None:
    world = heap()
    assert (world.to_image(size=SIZE) == record.to_image(world, size=SIZE)).all()
    world.to_video(tmp_path / "a.mp4", seconds=0.1, size=SIZE)
    assert len(movie_times(tmp_path / "a.mp4")) == 6
