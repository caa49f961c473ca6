"""Base utilities that all other packages use."""
