"""All units of the core for both precisions and all processors, as far as they have changed since the last time."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import shutil
import sysconfig
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib import metadata
from importlib.machinery import ExtensionFileLoader
from pathlib import Path

from build_core.compiler import VARIANTS, CompilerError, compile_extension, signature
from build_core.translate import CORE, ROOT, declarations, headers, in_doubles, joined_source, translate

UNITS = ("engine", "motion", "tools")
"""Units that are compiled for each precision and variant; the processor's own is compiled once."""

WORK = ROOT / "build" / "core"


@dataclass(frozen=True)
class Target:
    """One extension module."""

    unit: str
    name: str
    variant: str
    real64: bool

    @property
    def module(self) -> str:
        return f"pyverlet.core.{self.variant}.{self.name}"

    def path(self, root: Path) -> Path:
        """Where it goes in a folder with packages."""
        return root.joinpath(*self.module.split(".")).with_name(self.name + str(sysconfig.get_config_var("EXT_SUFFIX")))


def targets(units: tuple[str, ...] = UNITS, variants: tuple[str, ...] = tuple(VARIANTS)) -> list[Target]:
    """What is made of these units, for these variants."""
    made = [Target("processor", "processor", "baseline", False)]
    for unit in units:
        for real64 in (False, True):
            made += [Target(unit, f"{unit}_f{64 if real64 else 32}", variant, real64) for variant in variants]
    return made


def chosen_variants() -> tuple[str, ...]:
    """The variants to install: the one for this processor; all if PYVERLET_VARIANTS is `all`, for wheels that go elsewhere.

    Raises:
        CompilerError: there is no C compiler, or it fails; PYVERLET_VARIANTS is something else.
    """
    if (wanted := os.environ.get("PYVERLET_VARIANTS", "")) not in ("", "all"):
        raise CompilerError(f"PYVERLET_VARIANTS is {wanted!r}; allowed is 'all', or nothing for the processor of this machine")
    return tuple(VARIANTS) if wanted else (native_variant(),)


def native_variant() -> str:
    """The variant for the processor of this machine, which is asked by the unit that knows it.

    Raises:
        CompilerError: there is no C compiler, or it fails.
    """
    if len(VARIANTS) == 1:
        return "baseline"
    (processor,) = targets(())
    signature()
    path = _compiled(processor, *_translated(processor.unit))
    loader = ExtensionFileLoader(processor.module, str(path))
    spec = importlib.util.spec_from_file_location(processor.module, path, loader=loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    return {4: "x86_64_v4", 3: "x86_64_v3"}.get(module.level(), "baseline")


def _translated(unit: str) -> tuple[dict[bool, Path], str]:
    """The C of a unit by precision, and a hash of it and its headers; Cython is called only if what it read has changed."""
    name, name64 = (f"{unit}_f32", f"{unit}_f64") if unit in UNITS else (unit, "")
    folder, text = WORK / unit, joined_source(unit)

    def used(file: str) -> bool:
        return file.startswith("lanes") or f"cimports.{file.partition('.')[0]} " in text

    ours = Path(__file__).with_name("translate.py").read_text(encoding="utf-8")
    read = [text, *(each for file, each in declarations().items() if used(file)), metadata.version("cython"), ours]
    stamp, state = folder / "translated", hashlib.sha256("\0".join(read).encode()).hexdigest()
    sources = {False: folder / f"{name}.c", **({True: folder / f"{name64}.c"} if name64 else {})}
    if not (all(path.exists() for path in sources.values()) and stamp.exists() and stamp.read_text() == state):
        stamp.unlink(missing_ok=True)  # a failed translation leaves a file, too
        made = translate(unit, name, folder).read_text(encoding="utf-8")
        if name64:
            sources[True].write_text(in_doubles(made, name, name64), encoding="utf-8")
        stamp.write_text(state)
    included = (each for file, each in headers().items() if used(file))
    return sources, hashlib.sha256("\0".join([state, *included, signature()]).encode()).hexdigest()


def _compiled(target: Target, sources: dict[bool, Path], state: str) -> Path:
    """The extension of a target in the work folder."""
    made, state = target.path(WORK / "made"), f"{state} {VARIANTS[target.variant]}"
    stamp = WORK / target.unit / f"{target.name}-{target.variant}{sysconfig.get_config_var('EXT_SUFFIX')}"
    if not (made.exists() and stamp.exists() and stamp.read_text() == state):
        compile_extension(sources[target.real64], made, target.variant, [CORE], ["REAL64"] if target.real64 else [])
        stamp.write_text(state)
    return made


def build(root: Path, wanted: list[Target] | None = None) -> list[Path]:
    """Compile what has changed, and put it all into a folder with packages. Returns the files.

    Raises:
        TranslationError: Cython does not take a source.
        CompilerError: there is no C compiler, or it fails.
    """
    wanted = targets() if wanted is None else wanted
    signature()  # finds a compiler, or says that there is none
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        sources = {unit: pool.submit(_translated, unit) for unit in dict.fromkeys(each.unit for each in wanted)}
        made = list(pool.map(lambda each: _compiled(each, *sources[each.unit].result()), wanted))
    placed = []
    for target, path in zip(wanted, made, strict=True):
        to = target.path(root)
        to.parent.mkdir(parents=True, exist_ok=True)
        if not (to.exists() and to.read_bytes() == path.read_bytes()):
            part = to.with_name(f"{to.name}.tmp")
            shutil.copy2(path, part)
            part.replace(to)  # a process that has the old one loaded keeps it
        placed.append(to)
    return placed
