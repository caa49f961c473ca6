"""The only place that calls Numba: flags, cache, threads, lanes."""
