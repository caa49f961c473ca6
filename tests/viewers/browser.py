"""A Chromium for the tests of the page: where it is found, how it is started, what is read off the page.

The browser is the one PYVERLET_CHROMIUM names, or else an installed one; without any, tests that need it are skipped on
somebody's machine and fail where CI is set.
"""

import contextlib
import os
import re
import shutil
from collections.abc import Callable, Iterator
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from matplotlib import image
from numpy.typing import NDArray
from playwright.sync_api import Browser, Locator, Page, expect
from tests.programs import Program

NO_OUTLINES = "\N{EN DASH}"
"""What the page shows where there is no number."""

FLAGS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
]  # fmt: skip

KINDS = [pytest.param([], id="webgl"), pytest.param(["--disable-3d-apis"], id="no-webgl", marks=pytest.mark.slow)]
"""Flags of the browsers the page is tried in. Where hardware is imitated it draws without WebGL in both, unless it is told to."""

SERVE = """
import sys
from pyverlet.scenes import get
from pyverlet.viewers.launch import serve
from pyverlet.viewers.presentation import Repertoire
if len(sys.argv) > 3:
    from pyverlet.viewers import renderer
    renderer.PICTURES_FROM = int(sys.argv[3])
repertoire = Repertoire(get(sys.argv[1]), dt=1 / 60, overrides={"particles": int(sys.argv[2]), "ledger": sys.argv[4:] == ["1"]})
serve(repertoire.open, title=sys.argv[1], port=0, open_browser=False)
"""


def chromium() -> str:
    """Path of a Chromium."""
    named = os.environ.get("PYVERLET_CHROMIUM")
    found = named or shutil.which("chromium") or shutil.which("google-chrome") or shutil.which("chromium-browser")
    if found is None:
        reason = "no Chromium found; set PYVERLET_CHROMIUM to one"
        if os.environ.get("CI"):
            pytest.fail(reason)
        pytest.skip(reason)
    return found


class Served(Program):
    """Python that serves a page, at its address."""

    def __init__(self, *arguments: str, **options: Any) -> None:
        super().__init__("-W", "error", *arguments, **options)
        self.address: str = re.findall(r"http://\S+", self.line("http://"))[0]


Serve = Callable[..., Served]
"""Starts programs: a scene, its circles and, if given, from how many on the server draws, and 1 for a ledger."""


@contextlib.contextmanager
def tab(browser: Browser, **options: Any) -> Iterator[Page]:
    """A page on which no error happens."""
    page = browser.new_page(**{"viewport": {"width": 1280, "height": 800}, **options})
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    # That nobody answers while its server ends is no error of the page's: it dials again.
    page.on(
        "console",
        lambda said: errors.append(said.text) if said.type == "error" and "ERR_CONNECTION_REFUSED" not in said.text else None,
    )
    yield page
    page.close()
    assert errors == []


def seen_pixels(page: Page) -> NDArray[np.float32]:
    """(h, w, 3) of the page as it is drawn, from 0 to 1."""
    return np.asarray(image.imread(BytesIO(page.screenshot()))[:, :, :3])


def number(page: Page, name: str) -> float:
    return float(page.get_by_test_id(name).inner_text())


def comes_true(page: Page, condition: Callable[[], bool]) -> bool:
    """Whether a condition comes true within ten seconds."""
    for _ in range(200):
        if condition():
            return True
        page.wait_for_timeout(50)
    return False


def box(element: Locator) -> Any:
    """Where it stands on the page: x, y, width and height, and its lower end."""
    found: Any = element.bounding_box()
    return {**found, "bottom": found["y"] + found["height"]}


def shown(page: Page, what: str) -> Any:
    """Of what the page tells its tests: a number it draws, or where its camera is."""
    return page.evaluate(f"() => window.pyverlet.{what}")


def each(page: Page, what: str, count: int) -> NDArray[np.float64]:
    """(count,) of what the page tells of each circle."""
    return np.array(page.evaluate(f"(n) => Array.from({{length: n}}, (_, i) => window.pyverlet.{what}(i))", count))


def rgb(inks: Any) -> NDArray[np.int64]:
    """(n, 3) from 0 to 255 of the colours that circles have."""
    return np.asarray(inks, np.int64)[..., None] >> (0, 8, 16) & 255


def draw(page: Page, start: Any, *to: Any, steps: int = 1, button: Any = "left", wait: float = 0.0) -> None:
    """Press the mouse at `start`, and let go where it has come; after each of its ways `wait` ms pass."""
    page.mouse.move(*start)
    page.mouse.down(button=button)
    for place in to:
        page.mouse.move(*place, steps=steps)
        page.wait_for_timeout(wait)
    page.mouse.up(button=button)


def ask_for(page: Page, count: int) -> None:
    """So many circles, in the field for that."""
    page.get_by_test_id("count").fill(str(count))
    page.get_by_test_id("count").press("Enter")


def visit(page: Page, address: str) -> None:
    page.goto(address)
    expect(page.get_by_test_id("particles")).not_to_have_text(NO_OUTLINES)


def where(page: Page, particle: int) -> dict[str, float]:
    # Between a new shape and its first frame there is nobody to ask about.
    asked = "(i) => { try { return window.pyverlet.where(i); } catch { return null; } }"
    found: dict[str, float] = page.wait_for_function(asked, arg=particle).json_value()
    return found


def everywhere(page: Page, count: int) -> NDArray[np.float64]:
    """(count, 4) of x, y in metres and left, top in CSS pixels."""
    all_of_them = "Array.from({length: n}, (_, i) => Object.values(window.pyverlet.where(i)))"
    asked = f"(n) => {{ try {{ return {all_of_them}; }} catch {{ return null; }} }}"
    return np.array(page.wait_for_function(asked, arg=count).json_value(), dtype=np.float64)


def pause(page: Page) -> None:
    page.get_by_test_id("pause").click()
    expect(page.get_by_test_id("pause")).to_have_text("Resume")


def status(page: Page) -> dict[str, Any]:
    """All numbers of the frame on screen, as they came."""
    found: dict[str, Any] = page.evaluate("() => window.pyverlet.status()")
    return found
