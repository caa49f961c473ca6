"""The world: `World.step`, what it holds, and what it can be asked."""
