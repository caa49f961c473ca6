"""What setuptools cannot read in pyproject.toml: that there are extension modules, and who compiles them."""

from __future__ import annotations

from pathlib import Path

from build_core.build import build, chosen_variants, targets
from build_core.compiler import CompilerError
from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext


class BuildCore(build_ext):  # type: ignore[misc]
    """Compile with `build_core` instead of the compiler that Python was built with."""

    def run(self) -> None:
        """Put all extension modules into the wheel's folder, or into src/ for an editable install."""
        try:
            to = Path("src") if self.inplace or self.editable_mode else Path(self.build_lib)
            build(to, targets(variants=chosen_variants()))
        except CompilerError as error:
            raise SystemExit(str(error)) from None


setup(ext_modules=[Extension(target.module, []) for target in targets()], cmdclass={"build_ext": BuildCore})
