"""The laws of motion: integrators, rooms, collisions, forces, links, obstacles, sleep, events, energy ledger and limiter."""
