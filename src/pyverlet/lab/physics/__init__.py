"""The guarantees of the physics, each measured by one small function, for `pyverlet check physics` and the tests.

To add one: a function that returns a `Result`, with the equation in its docstring, and a line in CHECKS.
"""

from pyverlet.common.errors import InputError
from pyverlet.common.guess import did_you_mean
from pyverlet.lab.physics import energy, friction, gas, lost, rest
from pyverlet.lab.physics._check import Check, Result

__all__ = ["CHECKS", "Check", "Result", "named"]

CHECKS: tuple[Check, ...] = (
    Check("rebound-box", friction.rebound, {"floor": "box"}),
    Check("rebound-cage", friction.rebound, {"floor": "cage"}),
    Check("rebound-circle", friction.rebound, {"floor": "circle"}),
    Check("rebound-substeps", friction.rebound_substeps),
    Check("ball-in-box", friction.ball_in_box, {"steps": 100_000}, full={"steps": 1_000_000}),
    Check("gas-energy", gas.energy, {"particles": 1000, "seconds": 10}, full={"seconds": 60}),
    Check("gas-angular-momentum", gas.angular_momentum, {"particles": 1000, "seconds": 10}, full={"seconds": 60}),
    Check("gas-speeds", gas.speeds, {"particles": 1000, "seconds": 10}, full={"seconds": 60}),
    Check("gas-falling", gas.falling, {"particles": 60, "seconds": 10}, full={"particles": 300, "seconds": 30}),
    Check("gas-periodic", gas.periodic_kept, {"particles": 1000, "seconds": 5, "fraction": 0.3},
          full={"seconds": 60, "fraction": 0.5}),
    Check("gas-pressure", gas.pressure, {"particles": 400, "seconds": 3, "fraction": 0.3},
          full={"particles": 900, "seconds": 10, "fraction": 0.5}),
    Check("rest-cage", rest.cage, {"particles": 2000, "seconds": 30}, full={"particles": 20_000}),
    Check("rest-substeps", rest.substeps, {"particles": 1000, "seconds": 15}, full={"particles": 20_000, "seconds": 30}),
    Check("rest-column", rest.column, {"particles": 100, "seconds": 60}),
    Check("left-alone", rest.left_alone, {"particles": 500, "seconds": 30, "friction": 0.0}, full={"seconds": 600}),
    Check("left-alone-rough", rest.left_alone, {"particles": 500, "seconds": 60, "friction": 0.5}, full={"seconds": 600}),
    Check("masses", rest.pile, {"particles": 500, "seconds": 20, "radius_ratio": 1, "mass_ratio": 1000}, full={"seconds": 60}),
    Check("radii", rest.pile,
          {"particles": 500, "seconds": 20, "radius_ratio": 50, "mass_ratio": 1000, "most": 0.6}, full={"seconds": 60}),
    Check("radii-masses", rest.pile,
          {"particles": 500, "seconds": 40, "radius_ratio": 50, "mass_ratio": 1000, "independent": True}, full={"seconds": 60}),
    Check("heavy-on-column", rest.heavy_on_column),
    Check("heavy-on-rough-bed", rest.heavy_on_bed, {"friction": 0.5, "particles": 1000}),
    Check("heavy-on-smooth-bed", rest.heavy_on_bed, {"friction": 0.0, "particles": 1000}),
    Check("sliding-disc", friction.sliding_disc),
    Check("slope", friction.slope),
    Check("repose", friction.repose, {"heaps": 12}),
    Check("free-spin", friction.free_spin),
    Check("energy-scenes", energy.in_scenes, {"seconds": 4}, full={"seconds": 30}),
    Check("energy-gas", energy.never_rises, {"worlds": energy.GASES, "seconds": 4}, full={"seconds": 30}),
    Check("energy-overlapped", energy.never_rises, {"worlds": energy.OVERLAPPED, "seconds": 4}, full={"seconds": 30}),
    Check("energy-coincident", energy.never_rises, {"worlds": energy.COINCIDENT, "seconds": 4}, full={"seconds": 30}),
    Check("coincident", lost.coincident),
    Check("crowded", lost.crowded),
    Check("closed-room", lost.leaves_no_room),
    Check("passing", lost.passing),
)  # fmt: skip


def named(name: str) -> Check:
    """The check of this name.

    Raises:
        InputError: there is none; the message suggests the nearest and lists the known ones.
    """
    known = {check.name: check for check in CHECKS}
    if name in known:
        return known[name]
    raise InputError(f"unknown check {name!r}{did_you_mean(name.lower(), known)}; known: {', '.join(known)}")
