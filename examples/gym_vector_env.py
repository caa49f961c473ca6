"""Reinforcement learning on many worlds at once: a Gymnasium VectorEnv of pyverlet.Worlds.

In each world the first circle of a heap is the agent's: it may push itself in any direction, and is paid for its height.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv

import pyverlet as pv

DT, PUSH, LASTS = 1 / 60, 20.0, 5.0  # s, m/s^2, s


class Climb(VectorEnv[np.ndarray[Any, Any], np.ndarray[Any, Any], Any]):
    """Observation: position and velocity of the agent and of the circles nearest to it, relative to its own."""

    metadata = {"autoreset_mode": AutoresetMode.DISABLED}  # noqa: RUF012

    def __init__(self, num_envs: int, *, particles: int = 60, near: int = 6, seed: int = 0) -> None:
        self.num_envs, self._near = num_envs, near
        self.single_action_space = gym.spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.single_observation_space = gym.spaces.Box(-np.inf, np.inf, (4 + 4 * near,), np.float32)
        self.action_space = gym.vector.utils.batch_space(self.single_action_space, num_envs)
        self.observation_space = gym.vector.utils.batch_space(self.single_observation_space, num_envs)
        self._worlds = pv.Worlds("box", num_envs, seed=seed, particles=particles)
        self._start = self._worlds.save()

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray[Any, Any], dict[str, Any]]:
        """Put the worlds back to their start: all, or those of options["reset_mask"]. Seeds are each world's own, for good."""
        self._worlds.restore(self._start, (options or {}).get("reset_mask"))
        return self._observed(), {}

    def step(self, actions: np.ndarray[Any, Any]) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        self._worlds.velocity[:, 0] += PUSH * DT * np.clip(actions, -1.0, 1.0)
        self._worlds.step(DT)
        height = self._worlds.position[:, 0, 1].astype(np.float64)
        truncated = self._worlds.time >= LASTS - DT / 2
        return self._observed(), height, np.zeros(self.num_envs, bool), truncated, {}

    def _observed(self) -> np.ndarray[Any, Any]:
        position, velocity = self._worlds.position, self._worlds.velocity
        away, against = position[:, 1:] - position[:, :1], velocity[:, 1:] - velocity[:, :1]
        nearest = np.argsort((away**2).sum(axis=2), axis=1, kind="stable")[:, : self._near, None]
        parts = position[:, 0], velocity[:, 0], np.take_along_axis(away, nearest, 1), np.take_along_axis(against, nearest, 1)
        return np.concatenate([part.reshape(self.num_envs, -1) for part in parts], axis=1).astype(np.float32)

    def close_extras(self, **kwargs: Any) -> None:
        self._worlds.close()


if __name__ == "__main__":
    env, paid = Climb(64), np.zeros(64)
    env.reset()
    while not (done := env.step(np.tile((0.0, 1.0), (64, 1))))[3].all():
        paid += done[1] * DT
    print(f"always up: {paid.mean():.2f} m s on average of 64 worlds")  # noqa: T201
    env.close()
