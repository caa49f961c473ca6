"""Worlds as data: kept in files, many at once, and in sweeps over one machine or a cluster."""
