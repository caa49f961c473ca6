"""The `World` class: stepping, contents, measurements and spatial queries."""
