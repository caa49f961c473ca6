"""The commands run, bench and list, and the ways in which `run` shows a scene; other commands have files of their own."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from pyverlet import __version__, scenes
from pyverlet.cli import _options as options
from pyverlet.cli import _print as out
from pyverlet.cli import _sweep
from pyverlet.cli._options import integrators, single
from pyverlet.common import checks
from pyverlet.common.errors import InputError
from pyverlet.common.progress import Progress
from pyverlet.data.trajectory import Trajectory
from pyverlet.laws.integrators import Integrator
from pyverlet.picture import DARK, Colouring, Fixed, Theme
from pyverlet.scenes import SCENES, Scene, Settings, report, sketch
from pyverlet.scenes.report import DEFAULT_SECONDS
from pyverlet.scenes.sketch import Sketch
from pyverlet.viewers import DEFAULT_PORT
from pyverlet.viewers.renderer import PictureStyle
from pyverlet.world.panels import Panel, Panels
from pyverlet.world.world import World

DEFAULT_DT = 1 / 60

FIRST = """\
pyverlet run                        circles fall into a heap, in a tab of your browser
pyverlet list                       the other scenes: pyverlet run cloth
pyverlet new mysketch.py            a scene of your own to start from, 25 lines
pyverlet run mysketch.py --watch    see it, change it, save: the page follows
pyverlet --help                     all commands; pyverlet run --help, all options of one"""
"""Next steps, printed if no command is given."""

app = typer.Typer(
    name="pyverlet",
    help="Real-time 2D particle physics: thousands of circles that fall, bounce, roll and pile up.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
check_app = typer.Typer(help="Measure what is promised.", rich_markup_mode=None)
app.add_typer(check_app, name="check")
app.add_typer(_sweep.app, name="sweep")


def _show_version(wanted: bool) -> None:
    if wanted:
        out.write(f"pyverlet {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _pyverlet(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        out.write(FIRST)


@app.command(name="list")
def list_scenes(as_json: options.Json = False) -> None:
    """List the scenes, one per line."""
    rows = [(scene.name, scene.summary) for scene in scenes.SCENES.values()]
    out.tell([{"name": name, "summary": summary} for name, summary in rows], out.table(rows), as_json=as_json)


@app.command()
@options.with_settings(*options.SETTINGS)
def run(
    scene: options.SceneName = "cage",
    *,
    overrides: dict[str, Any],
    dt: options.Dt = DEFAULT_DT,
    seconds: options.Seconds = None,
    frames: options.Frames = None,
    as_json: options.Json = False,
    trajectory: options.Trajectory = None,
    every: options.Every = None,
    watch: Annotated[bool, typer.Option("--watch", help="Build a sketch anew whenever it is saved; the page stays.")] = False,
    patience: Annotated[float | None, options.number("Seconds a watched sketch may build.", shown="10")] = None,
    journal: Annotated[Path | None, options.file("Keep all that is done on the page, for `pyverlet replay`.")] = None,
    headless: Annotated[
        bool, typer.Option("--headless", help=f"Run without the page, {DEFAULT_SECONDS:g} s unless said, and report.")
    ] = False,
    no_open: options.NoOpen = False,
    window: Annotated[bool, typer.Option("--window", help="Show it in a window of its own, not on the page.")] = False,
    port: options.Port = None,
    plot: Annotated[Path | None, options.file("Write y(t) beside the closed form (scene fall).")] = None,
) -> None:
    """Run a scene on a live page, or without one and report.

    --seconds, --frames, --json, --trajectory and --plot limit the run, and imply --headless.
    """
    typed = overrides.pop("integrator")
    methods = integrators(typed)
    ends = headless or as_json or plot or trajectory or seconds is not None or frames is not None
    if patience is not None and not watch:
        raise InputError(f"patience is {patience:g}; allowed is none without --watch")
    what: dict[str, Any] = {"integrators": methods, "overrides": overrides, "dt": dt}
    page = {"port": DEFAULT_PORT if port is None else port, "open_browser": not no_open}
    if watch:
        if Path(scene).suffix.lower() != sketch.SUFFIX:
            raise InputError(f"watch is asked for with {scene!r}; allowed is a sketch, such as mysketch.py")
        if ends or window or journal:
            raise InputError("watch is asked for with a run that ends, a window or a journal; allowed is the page alone")
        limit = {} if patience is None else {"time_limit": checks.number("patience", patience, above=0.0)}
        _show_watched(Path(scene), served=page, **what, **limit)
        return
    chosen = scenes.get(scene)
    chosen.settings(**overrides)  # refuse errors before anything starts
    if every is not None and trajectory is None:
        raise InputError(f"every is {every}; allowed is none without --trajectory")
    if journal and (ends or window):
        raise InputError(f"journal is '{journal}' for a run without a page; allowed is one with the page")
    if window and (ends or port is not None or no_open or overrides["ledger"]):
        raise InputError("window is asked for together with a run that ends or with options of the page; allowed is one of them")
    if window:
        if len(methods) > 1:
            raise InputError(f"integrators is {typed!r}; allowed is one in a window, which shows a single world")
        _show_window(chosen, chosen.settings(**overrides, integrator=methods[0] if methods else None), dt=dt)
        return
    if not ends:
        _show_page(chosen, served=page, journal=journal, **what)
        return
    if port is not None:
        raise InputError(f"port is {port}; allowed is none, since this run has no live page")
    count = report.frame_count(seconds=seconds, frames=frames, dt=dt)
    if plot is None:
        panels = chosen.panels(integrators=methods, **overrides)
        with _kept(panels, trajectory, every) as observe:
            results = [_measure(panel, chosen, count, dt, observe) for panel in panels]
        _tell_all(chosen, panels, results, as_json)
        return
    if trajectory:
        raise InputError(f"trajectory is '{trajectory}' and plot is '{plot}'; allowed is one of them")
    if len(methods) > 1:
        raise InputError(f"integrators is {typed!r}; allowed is one for plot (several: pyverlet compare)")
    settings = chosen.settings(**overrides, integrator=methods[0] if methods else None)
    result = _run_and_plot(chosen, settings, count, dt, plot)
    out.tell(result, out.report(result), as_json=as_json)


@app.command()
@options.with_settings(*(name for name in options.SETTINGS if name not in ("picture", "ledger")))
def bench(
    scene: options.SceneName = "cage",
    *,
    overrides: dict[str, Any],
    dt: options.Dt = DEFAULT_DT,
    seconds: options.Seconds = None,
    frames: options.Frames = None,
    as_json: options.Json = False,
    settle: Annotated[float, options.number("Simulated seconds to run before measuring.", shown="5")] = DEFAULT_SECONDS,
    stages: Annotated[bool, typer.Option("--stages", help="A table of the stages of a frame, and nothing else.")] = False,
) -> None:
    """Measure a scene after its circles have settled.

    Prints the median frame time and, for comparison between machines, the time of NumPy's a = b + s c.
    """
    chosen = scenes.get(scene)
    count = report.frame_count(seconds=seconds, frames=frames, dt=dt)
    warm = report.frame_count(seconds=settle, dt=dt) if checks.number("settle", settle, least=0.0) else 0
    world = chosen.world(**overrides | {"integrator": single(overrides["integrator"])})
    for _ in Progress.over("settling, frame", range(warm)):
        world.step(dt)
    triad = report.triad()
    result = _measure(Panel("", world), chosen, count, dt)
    ratio = result["ns_per_particle_substep"] / triad["ns_per_element"]
    result |= {"settle_seconds": settle, "triad": triad, "ratio_to_triad": ratio}
    out.tell(result, (out.stages if stages else out.report)(result), as_json=as_json)


Report = dict[str, Any]  # of `report.run`


def _measure(panel: Panel, scene: Scene, frames: int, dt: float, observe: Callable[[World], None] | None = None) -> Report:
    with Progress("frame") as progress:
        what: dict[str, Any] = {"scene": scene.name, "frames": frames, "dt": dt, "observe": observe, "step": panel.step}
        return report.run(panel.world, progress=progress, **what)


@contextmanager
def _kept(panels: Panels, path: Path | None, every: int | None) -> Iterator[Callable[[World], None] | None]:
    """Context with a function that writes each frame to a trajectory, if one is wanted."""
    if path is None:
        yield None
        return
    if len(panels) > 1:
        raise InputError(f"trajectory is '{path}' for {len(panels)} worlds side by side; allowed is one world")
    with Trajectory(path, every=1 if every is None else every) as film:
        film.add(panels.worlds[0])

        def observe(world: World) -> None:
            if world.frames % film.every == 0:
                film.add(world)

        try:
            yield observe
        finally:
            out.note(f"'{path}' holds {film.frames} frames")


def _run_and_plot(scene: Scene, settings: Settings, frames: int, dt: float, path: Path) -> Report:
    from pyverlet.lab import figures

    figures.check_can_plot(path)
    if scene.closed_form is None:
        known = ", ".join(other.name for other in SCENES.values() if other.closed_form)
        raise InputError(f"plot is for scenes with a closed form to compare with ({known}), got {scene.name!r}")
    world, looks = scene.build(settings), list[tuple[float, Any]]()

    def look(world: World) -> None:
        looks.append((float(world.time), world.position[:, 1].astype(np.float64)))

    look(world)
    result = _measure(Panel("", world), scene, frames, dt, look)
    time, simulated = map(np.array, zip(*looks, strict=True))
    exact = scene.closed_form(settings, time)
    error = float(np.abs(simulated - exact).max())
    step = f"{result['substeps']} substeps of {1e3 * dt / result['substeps']:.3g} ms"
    title = f"{scene.name}: {result['integrator']}, {step}, {result['dtype']}"
    figures.save(figures.heights_figure(time, simulated, exact, title), path)
    out.note(f"wrote {path}; largest error in y: {error:.3g} m")
    return result | {"largest_error_m": error}


def _tell_all(scene: Scene, panels: Panels, results: list[Report], as_json: bool) -> None:
    """Print one report, or those of several panels with their names and a common hash."""
    if len(results) == 1:
        out.tell(results[0], out.report(results[0]), as_json=as_json)
        return
    named = [{"panel": panel.name, **result} for panel, result in zip(panels, results, strict=True)]
    text = "\n\n".join(f"{values['panel']}\n\n{out.report(values)}" for values in named)
    out.tell({"scene": scene.name, "panels": named, "state_hash": panels.state_hash()}, text, as_json=as_json)


def _show_page(
    scene: Scene,
    *,
    integrators: Sequence[Integrator],
    overrides: Mapping[str, Any],
    dt: float,
    journal: Path | None,
    served: Mapping[str, Any],
) -> None:
    """Show the scene on the live page until Ctrl-C, and record a journal if one is wanted."""
    from pyverlet.viewers.journal import Journal
    from pyverlet.viewers.launch import serve
    from pyverlet.viewers.presentation import Presentation, Repertoire

    SCENES.setdefault(scene.name, scene)  # scenes from files can be chosen on the page, too
    repertoire = Repertoire(scene, dt=dt, integrators=integrators, overrides=overrides)

    def build() -> Presentation:
        with Progress("where each circle ends") as progress:
            return repertoire.open(progress)

    with Journal(journal, dt=dt) if journal else nullcontext() as kept:
        kind: dict[str, Any] = {"view_state": kept.view_state} if kept else {}
        serve(build, title=scene.name, dt=dt, **kind, **served)
    if kept:
        out.note(f"'{journal}' holds {kept.frame:,} frames: pyverlet replay '{journal}'")


def _show_watched(path: Path, *, dt: float, served: Mapping[str, Any], **build: Any) -> None:
    """Show a sketch on the live page until Ctrl-C, and rebuild it whenever it is saved; `build`: as for `SketchBuilder`."""
    from pyverlet.viewers.launch import serve
    from pyverlet.viewers.watching import SketchBuilder, Watcher

    builder = SketchBuilder(path, dt=dt, **build)
    Sketch.read(path)  # a missing file is an error here, not on the page

    serve(builder.first, title=path.stem, dt=dt, while_running=lambda session: Watcher(builder, session).at_work(), **served)


def _show_window(scene: Scene, settings: Settings, *, dt: float) -> None:
    """Show the scene's world, the first of several, in a window until it is closed."""
    from pyverlet.viewers import window as viewer

    viewer.check_extra()
    if scene.variants:
        out.note(f"a window shows one of the {len(scene.variants)} worlds of {scene.name}; the page shows them side by side")
    style = picture_style(scene, settings, dt)
    out.note(viewer.KEYS)
    viewer.Window(scene.build(settings), title=scene.name, dt=dt, style=style).run()


def picture_style(
    scene: Scene, settings: Settings, dt: float, colour: Colouring | None = None, theme: Theme = DARK
) -> PictureStyle:
    """The picture style of the scene, in its colours unless others are given."""
    show = scene.show
    if colour is None and show.colours:
        with Progress("where each circle ends") as progress:
            colour = Fixed(show.colours(settings, dt, progress))
    part = show.view(settings) if show.view else None
    draw = partial(scene.sketch.call, "draw") if scene.sketch and scene.sketch.has("draw") else None  # a film stops at errors
    return PictureStyle(colour, theme, part, draw)
