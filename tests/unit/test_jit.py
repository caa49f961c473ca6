"""The cache of compiled kernels: named after the sources, so that an edit anywhere among them compiles anew."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.compile import jit

SOURCES = Path(pv.__file__).parent


def test_the_hash_sees_an_edit_in_any_kernel_and_no_other(tmp_path: Path) -> None:
    copy = tmp_path / "pyverlet"
    shutil.copytree(SOURCES, copy)
    before = jit.sources_hash(copy)
    assert before == jit.sources_hash()
    (copy / "world" / "world.py").write_text("# edited")
    assert jit.sources_hash(copy) == before
    for name in (
        "kernels/contact.py",
        "kernels/motion.py",
        "ground/constants.py",
        "compile/jit.py",
        "compile/lanes.py",
    ):
        with (copy / name).open("a") as file:
            file.write("\n# edited\n")
        after = jit.sources_hash(copy)
        assert after != before
        before = after


CALL_A_KERNEL = """
import numpy as np
from pyverlet.kernels import motion
from pyverlet.compile import jit
out = np.zeros((1, 2))
motion.advance.alone(out, out, np.ones((1, 2)), 1.0)
print(out[0, 0], sum(motion.advance.alone.stats.cache_hits.values()))
"""


@pytest.mark.slow
def test_an_edited_helper_is_not_served_from_the_cache(tmp_path: Path) -> None:
    # Numba alone would miss this: the file of the kernel that is called does not change, that of an inlined one does.
    copy = tmp_path / "site" / "pyverlet"
    shutil.copytree(SOURCES, copy)
    kernels = copy / "kernels"
    (kernels / "_helper.py").write_text("from pyverlet.compile.jit import kernel\n\n\n@kernel\ndef gain():\n    return 1.0\n")
    motion = (kernels / "motion.py").read_text()
    motion = motion.replace("import numpy as np\n", "import numpy as np\nfrom pyverlet.kernels._helper import gain\n", 1)
    motion = motion.replace("to[k] = start[k] + h * rate[k]", "to[k] = start[k] + gain() * h * rate[k]", 1)
    (kernels / "motion.py").write_text(motion)

    def call() -> list[str]:
        env = {**os.environ, "PYTHONPATH": str(copy.parent), "PYVERLET_CACHE_DIR": str(tmp_path / "cache")}
        return subprocess.run(
            [sys.executable, "-c", CALL_A_KERNEL], env=env, capture_output=True, text=True, check=True
        ).stdout.split()

    assert call() == ["1.0", "0"]
    assert call() == ["1.0", "1"]  # from the cache
    helper = kernels / "_helper.py"
    helper.write_text(helper.read_text().replace("1.0", "2.0"))
    assert call() == ["2.0", "0"]


def test_caches_nobody_used_for_a_month_go(tmp_path: Path) -> None:
    current, stale, recent = (tmp_path / name for name in ("current", "stale", "recent"))
    for folder in (current, stale, recent):
        folder.mkdir()
    long_ago = time.time() - 40 * 24 * 3600
    os.utime(stale, (long_ago, long_ago))
    jit._forget_stale(current)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["current", "recent"]


def test_without_a_writable_folder_it_still_runs(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("")
    env = {**os.environ, "PYVERLET_CACHE_DIR": str(blocked), "TMPDIR": str(tmp_path)}
    code = "from pyverlet.compile import jit; print(jit.cache_dir())"
    run = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True)
    assert Path(run.stdout.strip()).is_relative_to(tmp_path)


@pytest.mark.parametrize("boundary", [pv.Circle(radius=10), pv.Box((0, 0), (10, 10)), pv.Open()])
def test_warm_up_leaves_the_world_alone_and_nothing_to_compile(boundary: pv.Boundary) -> None:
    collisions = pv.Collisions(restitution=0.5, friction=0.5)
    world = pv.World(boundary=boundary, collisions=collisions, ledger=True, events=True)
    world.links.append(pv.Stick(world.add(position=[(3, 3), (4, 4)]), 0, 1))
    world.obstacles.append(pv.Disc((2, 2), 0.5, angular_velocity=1.0))
    world.forces += [pv.Wind((1, 0), linear=0.1), pv.Gravitation(strength=1.0), pv.force(lambda x, y, vx, vy, mass, t: (x, y))]
    before = world.state_hash()
    assert pv.warm_up(world) > 0
    assert world.state_hash() == before
    compiled: list[int] = []
    with jit.watch_compiling(lambda: compiled.append(1)):
        world.step(1 / 60)
        world.energy(), world.overlap(), world.momentum(), world.escaped()
    assert compiled == []


@pytest.mark.slow  # it compiles all there is
def test_warm_up_reports_progress_and_leaves_nothing_to_compile(tmp_path: Path) -> None:
    code = (
        "import pyverlet as pv; world = pv.World(); world.add(position=(0, 0)); seen = []\n"
        "pv.warm_up(world, lambda done, total: seen.append((done, total)))\n"
        "assert seen[0][0] == 1 and seen[-1][0] == seen[-1][1] > 20, seen\n"
        "assert [d for d, _ in seen] == sorted(d for d, _ in seen)\n"
        "pv.warm_up(world, lambda done, total: exit('compiled twice'))\n"
        # The look at how neighbours have moved, and the second grid for small circles, are needed late, not in the first frame.
        "import numpy as np; from pyverlet.compile import jit; rng = np.random.default_rng(0); late = []\n"
        "world = pv.World(boundary=pv.Box((0, 0), (20, 20)))\n"
        "size = 0.5 * 20.0 ** -rng.random(200)\n"
        "world.add(position=rng.uniform(1, 19, (200, 2)), velocity=rng.normal(0, 20, (200, 2)), radius=size)\n"
        "with jit.watch_compiling(lambda: late.append(1)): world.run(seconds=0.5)\n"
        "assert world.rebuilds > 3 and not late, (world.rebuilds, late)\n"
        "world = pv.World(gravity=(0, 0), sleep=True); world.add(position=[(0, 0), (1, 0)], radius=0.5)\n"
        "before = len(late); pv.warm_up(world, lambda done, total: late.append(2)); assert late[before:]\n"
        "with jit.watch_compiling(lambda: late.append(1)):\n"
        "    world.run(seconds=1); assert world.asleep.all()\n"
        "    world.add(position=(2, 0), velocity=(-1, 0), radius=0.5); world.run(seconds=1); assert not world.asleep.any()\n"
        # Chains have compiled code of their own, which worlds with other links too do not use.
        "world = pv.World(); world.links.append(pv.Stick(world.add(position=[(0, 0), (1, 0)]), 0, 1)); pv.warm_up(world)\n"
        "with jit.watch_compiling(lambda: late.append(1)): world.run(seconds=0.1)\n"
        "assert 1 not in late\n"
    )
    subprocess.run([sys.executable, "-c", code], env={**os.environ, "PYVERLET_CACHE_DIR": str(tmp_path)}, check=True, timeout=900)


def test_float32_stays_float32() -> None:
    # A stray float64 constant would widen the arithmetic: 1 + 2^-24 is 1 in float32.
    out = np.zeros((1, 2), np.float32)
    from pyverlet.state.moves import advance

    advance(out, np.ones((1, 2), np.float32), np.ones((1, 2), np.float32), 2.0**-25)
    assert out[0, 0] == 1.0


def test_parts_of_kernels_are_not_called_from_python() -> None:
    """They are compiled without what that takes: called nevertheless, they would end the process."""
    part = next(kernel for kernel in jit.KERNELS.values() if kernel.inner)
    with pytest.raises(TypeError, match="is called by kernels, not from Python"):
        part(1.0)
