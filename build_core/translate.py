"""Have Cython write the C of a unit, once for both precisions.

To Cython, `real` is a float. The C for doubles is the same text with another name and another conversion from Python, compiled
with -DREAL64: `real` in it is a double then, as `double` is anyway. The reverse fails: where `real` is a double to Cython, it may
store the product of a `real` and a `double` as `real`.
"""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parent.parent
CORE = ROOT / "src" / "pyverlet" / "core"
DIRECTIVES = {
    "language_level": 3, "boundscheck": False, "wraparound": False, "cdivision": True, "initializedcheck": False,
    "freethreading_compatible": True, "embedsignature": True, "infer_types": True, "binding": False, "auto_pickle": False,
}  # fmt: skip
"""Functions that know their own module, and pickles, would be a twentieth of what is compiled; nobody asks for either."""

CYTHON = "import gc; gc.disable(); from Cython.Compiler.Main import main; main(command_line=1)"
"""Cython without garbage collection, which is a third of its time and frees 3 % of its memory."""


class TranslationError(RuntimeError):
    """What Cython does not take, by file and line."""


def _load_joining() -> ModuleType:
    """`pyverlet.core.joining`, without the package around it, which needs NumPy."""
    spec = importlib.util.spec_from_file_location("pyverlet_joining", CORE / "joining.py")
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules["pyverlet_joining"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


joining = _load_joining()


def joined_source(unit: str) -> str:
    """The joined modules of a unit, with the directives of Cython."""
    header = "# cython: " + ", ".join(f"{name}={value}" for name, value in DIRECTIVES.items())
    return f"{header}\n{joining.joined(unit)[0]}"


def declarations() -> dict[str, str]:
    """The .pxd files by name."""
    return {path.name: path.read_text(encoding="utf-8") for path in sorted(CORE.glob("*.pxd"))}


def headers() -> dict[str, str]:
    """The C headers by name."""
    return {path.name: path.read_text(encoding="utf-8") for path in sorted(CORE.glob("*.h"))}


def _where(text: str, unit: str, name: str) -> str:
    """Cython's messages with the files and lines of the modules instead of those of the joined source."""
    origins = joining.joined(unit)[1]

    def module_line(match: re.Match[str]) -> str:
        path, line = origins[int(match[1]) - 3]  # after the directives and the first line
        return f"{path.relative_to(ROOT)}:{line}:"

    return re.sub(rf"\S*{re.escape(name)}\.py:(\d+):", module_line, text)


def in_doubles(text: str, name: str, name64: str) -> str:
    """The C of a unit in floats as that of one in doubles, to be compiled with -DREAL64."""
    return text.replace("= __Pyx_PyFloat_AsFloat(", "= __Pyx_PyFloat_AsDouble(").replace(name, name64)


def with_constants(text: str) -> str:
    """The C of a unit in which numbers of modules, which Cython makes variables, are known to the compiler.

    Arrays of contacts are rows of numbers: their offsets were read from memory at each use, 2 to 6 % of a frame.
    """
    declared = re.compile(r"^static (\w+) (__pyx_v_\w+);$", re.MULTILINE)
    for kind, name in declared.findall(text):
        given = re.findall(rf"^ +{name} = (.+);$", text, re.MULTILINE)
        if len(given) == 1 and "__pyx" not in given[0]:
            text = text.replace(f"static {kind} {name};", f"#define {name} (({kind}){given[0]})").replace(
                f"  {name} = {given[0]};", ""
            )
    return text


def translate(unit: str, name: str, folder: Path) -> Path:
    """Write `name`.c into the folder, and return its path.

    Raises:
        TranslationError: Cython does not take the source; its messages name our files.
    """
    folder.mkdir(parents=True, exist_ok=True)
    source, made = folder / f"{name}.py", folder / f"{name}.c"
    source.write_text(joined_source(unit), encoding="utf-8")
    for file, text in declarations().items():
        (folder / file).write_text(text, encoding="utf-8")
    command = [sys.executable, "-c", CYTHON, "-3", "-I", str(folder), "-o", made.name, source.name]
    command += ["--module-name", f"pyverlet.core.{name}"]  # it puts itself among the modules by that name
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise TranslationError(_where(done.stdout + done.stderr, unit, name))
    kernels = re.compile(r"^static CYTHON_INLINE (?=.*\b__pyx_f_)", re.MULTILINE)
    text = with_constants(kernels.sub("static KERNEL_INLINE ", made.read_text(encoding="utf-8")))
    made.write_text(text, encoding="utf-8")
    return made
