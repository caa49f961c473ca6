"""`python -m build_core [--native] [--precision 32] [unit ...]`: compile the core in place, into src/; only what has changed."""

from __future__ import annotations

import argparse
import sys
import time

from build_core.build import UNITS, build, native_variant, targets
from build_core.compiler import VARIANTS, CompilerError, compiler
from build_core.translate import CORE, ROOT, TranslationError


def main() -> None:
    """Build, and say what and how long."""
    parser = argparse.ArgumentParser(prog="python -m build_core", description=__doc__)
    parser.add_argument(
        "units", nargs="*", default=UNITS, metavar="unit", help=f"which to build, of {', '.join(UNITS)}; all by default"
    )
    parser.add_argument("--native", action="store_true", help="only for processors like this one; removes those for others")
    parser.add_argument(
        "--precision", type=int, choices=(32, 64), help="only this one, of 32 and 64 bits; leaves the other as it is"
    )
    options = parser.parse_args()
    if unknown := set(options.units) - set(UNITS):
        parser.error(f"unit is {', '.join(sorted(unknown))}; allowed is {' or '.join(UNITS)}")
    start = time.monotonic()
    try:
        variants = (native_variant(),) if options.native else tuple(VARIANTS)
        wanted = targets(tuple(options.units), variants)
        made = build(ROOT / "src", [each for each in wanted if options.precision in (None, 64 if each.real64 else 32)])
    except (TranslationError, CompilerError) as error:
        sys.exit(str(error))
    for unit in options.units if options.native else ():
        for old in (path for variant in set(VARIANTS) - set(variants) for path in (CORE / variant).glob(f"{unit}_f*")):
            old.unlink()
    print(f"{len(made)} modules of {', '.join(options.units)} by {' '.join(compiler())} in {time.monotonic() - start:.1f} s")


if __name__ == "__main__":
    main()
