"""Compile the core of pyverlet: `python -m build_core` in the source folder does it in place, only what has changed.

`joining` (in the package) makes one source of the modules of a unit, `translate` has Cython write C for both precisions,
`compiler` finds and runs a C compiler, `build` does both for all units and variants. `backend` is what pip calls.
"""
