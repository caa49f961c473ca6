"""Circles that touch: who may, and what happens to them."""
