"""Find a C compiler, and call it."""

from __future__ import annotations

import importlib.util
import os
import platform
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from functools import cache
from pathlib import Path

FLAGS = ["-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-std=gnu11", "-g0", "-DNDEBUG"]
"""Equal bits everywhere: nothing is contracted or reordered, so never -ffast-math."""

OPTIMIZED = {
    "clang": ["-O3"],
    "gcc": [
        "-O2", "-fvect-cost-model=dynamic", "-ftree-loop-distribution", "-fpeel-loops", "-fsplit-loops",
        "-fno-tree-slp-vectorize",
    ],
}  # fmt: skip
"""Of what -O3 adds to -O2 in gcc, only loops make frames faster (by 5 to 11 %); the rest is a fifth of the time to compile. Where
it makes vectors of statements that are no loop, gcc 12 contracts a * b +- c to one operation, whatever FLAGS say."""

QUIET = ["-w", "-DKERNEL_INLINE=inline __attribute__((always_inline))", "-DCYTHON_COMPRESS_STRINGS=0"]
"""No warnings about Cython's C. Kernels that say so are always inlined; Cython's own functions, few of which need to be fast,
where the compiler sees fit. Strings are not compressed, so that `translate.in_doubles` can replace names in them."""

X86 = platform.machine().lower() in ("x86_64", "amd64")
VARIANTS = {"baseline": "x86-64", "x86_64_v3": "x86-64-v3", "x86_64_v4": "x86-64-v4"} if X86 else {"baseline": ""}
"""Sub-folder of the core -> processor it is compiled for."""


class CompilerError(RuntimeError):
    """No compiler, or one that fails, in one sentence."""


def _candidates() -> list[list[str]]:
    """Commands that may be a C compiler, the best first: clang's code is faster than gcc's."""
    zig = [sys.executable, "-m", "ziglang", "cc"]
    if given := os.environ.get("CC"):
        return [zig if given == "ziglang" else shlex.split(given)]
    found = [[path] for name in ("clang", "gcc", "cc") if (path := shutil.which(name))]
    if importlib.util.find_spec("ziglang"):
        found.append(zig)
    return found


def is_zig(command: list[str]) -> bool:
    """Whether this is the C compiler of ziglang, which spells some options in its own way."""
    return "zig" in " ".join(command[-3:])


def _works(command: list[str]) -> str:
    """What is wrong with this compiler; empty if it makes a shared library of code like ours."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "try.c")
        include = "" if sys.platform == "win32" else "#include <math.h>\n"
        source.write_text(f"{include}typedef float v __attribute__((vector_size(32)));\nv f(v a) {{ return a * a; }}\n")
        # As the core is compiled: zig first makes a library for each processor, C library and level, in 5 s of CPU time.
        options = [*(OPTIMIZED["clang"] if is_zig(command) else []), *_architecture(command, VARIANTS["baseline"])]
        try:
            _run([*command, *options, "-shared", "-fPIC", str(source), "-o", str(Path(folder, "try.so"))])
        except (OSError, CompilerError) as error:
            return str(error)
    return ""


@cache
def compiler() -> list[str]:
    """The command of the C compiler that is used.

    Raises:
        CompilerError: there is none that works.
    """
    tried = []
    for command in _candidates():
        wrong = _works(command)
        if not wrong:
            return command
        tried.append(f"{shlex.join(command)} fails" + "".join(f" ({line})" for line in wrong.strip().splitlines()[-1:]))
    found = "; ".join(tried) or "none was found"
    raise CompilerError(
        f"pyverlet needs a C compiler to be built: {found}; install clang or gcc, or set CC to one, or to `ziglang`"
    )


def requirements() -> list[str]:
    """What a build needs from PyPI for want of a compiler: zig's, unless `CC` names another."""
    try:
        compiler()
    except CompilerError:
        return ["ziglang>=0.13"] if os.environ.get("CC", "ziglang") == "ziglang" else []
    return []


def _run(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        told = (done.stdout + done.stderr).splitlines()[:40]
        raise CompilerError("\n".join([shlex.join(command), *told] if told else [f"exit code {done.returncode}"]))


def _architecture(command: list[str], name: str) -> list[str]:
    """The options for a processor, and with zig for a C library so old that every Linux has one as new."""
    options = [f"-march={name.replace('-', '_') if is_zig(command) else name}"] if name else []  # zig has underscores
    system = str(sysconfig.get_config_var("MULTIARCH"))
    if is_zig(command) and system in ("x86_64-linux-gnu", "aarch64-linux-gnu"):
        options += ["-target", f"{system}.2.17"]
    return options


def _linking() -> list[str]:
    """How to make an extension module on this system."""
    if sys.platform == "darwin":
        machines = shlex.split(os.environ.get("ARCHFLAGS", ""))
        return ["-bundle", "-undefined", "dynamic_lookup", *machines]
    if sys.platform == "win32":
        threaded = "t" if sysconfig.get_config_var("Py_GIL_DISABLED") else ""
        name = f"python{sys.version_info.major}{sys.version_info.minor}{threaded}"
        return ["-shared", f"-L{Path(sys.base_prefix, 'libs')}", f"-l{name}"]
    return ["-shared", "-fPIC", "-pthread", "-Wl,--strip-all"]


def compile_extension(source: Path, target: Path, variant: str, include: list[Path], defines: list[str]) -> None:
    """Compile one C file to an extension module for the processors of a variant."""
    command = compiler()
    target.parent.mkdir(parents=True, exist_ok=True)
    paths = [*include, Path(sysconfig.get_path("include")), Path(sysconfig.get_path("platinclude"))]
    made = target.with_name(f"{target.name}.{os.getpid()}.tmp")  # whole or not at all
    options = [*optimized(), *FLAGS, *QUIET, *_architecture(command, VARIANTS[variant])]
    options += [*(f"-D{define}" for define in defines), *(f"-I{path}" for path in dict.fromkeys(paths))]
    libraries = [] if sys.platform == "win32" else ["-lm"]
    _run([*command, *options, str(source), *_linking(), "-o", str(made), *libraries])
    made.replace(target)
    target.chmod(0o755)


@cache
def version() -> str:
    """What the compiler says of itself."""
    return subprocess.run([*compiler(), "--version"], capture_output=True, text=True, check=False).stdout


def optimized() -> list[str]:
    """How far the compiler optimizes."""
    return OPTIMIZED["gcc" if "Free Software Foundation" in version() else "clang"]


@cache
def signature() -> str:
    """What a compiled file depends on beside its source."""
    return "\n".join([shlex.join(compiler()), version(), *optimized(), *FLAGS, *QUIET, *_linking(), sys.version])
