"""The state of particles: the user's arrays, the engine's copy of them, and handles."""
