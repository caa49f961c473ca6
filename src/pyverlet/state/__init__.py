"""Where the numbers live."""
