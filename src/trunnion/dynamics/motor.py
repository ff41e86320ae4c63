"""The motors of the free drivers of a mechanism, with gear, rotor, switch, brake and clutch."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.joints.motors import transmitted
from trunnion.model.parts import Motor
from trunnion.solve.system import System, Values

Array = NDArray[np.float64]

CARRIED = Motor(kind="constant")  # stands for what comes through a clutch that slips
STATED = (
    "ratio", "efficiency", "inertia", "off_from", "brake", "brake_from", "clutch", "clutch_from", "clutch_until"
)  # fmt: skip


@dataclass(frozen=True)
class Drive:
    """What drives one free coordinate; nothing if it has no motor.

    parameters: of the motor, SI; applied: effort on the coordinate beside it, N m or N; inertia: of the rotor as the
    motor sees it, kg m² or kg; ratio: motor speed over the coordinate's; off_from, brake_from: times, s, from which the
    motor is off and the brake on; clutch: effort that a clutch between rotor and gear transmits at most, N m or N,
    engaged between two times, s.
    """

    motor: Motor | None
    parameters: Mapping[str, Any]
    ratio: float = 1.0
    efficiency: float = 1.0
    inertia: float = 0.0
    off_from: float = np.inf
    brake: float = 0.0
    brake_from: float = np.inf
    clutch: float = np.inf
    clutch_from: float = 0.0
    clutch_until: float = np.inf
    applied: float = 0.0

    @property
    def controlled(self) -> bool:
        """Whether it has a controller with an integral."""
        return self.motor is not None and self.motor.of.error is not None

    @property
    def clutched(self) -> bool:
        """Whether it has a clutch."""
        return self.motor is not None and self.motor.clutch is not None

    @property
    def times(self) -> list[float]:
        """Times, s, at which its effort jumps or bends."""
        instants = [self.off_from, self.brake_from]
        if self.clutched:
            instants += [self.clutch_from, self.clutch_until]
        if self.motor is not None and self.motor.kind == "table" and self.motor.over == "time":
            instants += self.parameters["points.place"]
        return [time for time in instants if np.isfinite(time)]

    @property
    def timed(self) -> bool:
        """Whether its effort may change while the coordinate rests."""
        return bool(self.times) or self.controlled

    def switches(self, now: float) -> tuple[bool, bool, bool]:
        """Whether the motor is off, the brake on and the clutch engaged. now: see `Moment`."""
        return now >= self.off_from, now >= self.brake_from, self.engaged(now)

    def switched(self, off: bool, braked: bool, engaged: bool) -> Drive:
        """It as it is with these `switches`, at all times."""
        never, ever = np.inf, -np.inf
        return replace(
            self, off_from=ever if off else never, brake_from=ever if braked else never,
            clutch_from=ever if engaged else never, clutch_until=never,
        )  # fmt: skip

    def shaft(self, time: Array, speed: Array, integral: Array, now: float) -> Array:
        """Effort at the motor's shaft. now: a time, s, that says what is switched on: within one stretch all is."""
        if self.motor is None or now >= self.off_from:
            return 0.0 * speed
        return self.motor.of.function(self.ratio * speed, time, self.parameters, integral)

    def engaged(self, now: float) -> bool:
        """Whether the clutch is engaged, if there is one."""
        return self.clutch_from <= now < self.clutch_until

    def loose(self, now: float, slips: float) -> bool:
        """Whether the rotor turns by itself. slips: sense in which the clutch does, 0 while it holds."""
        return self.clutched and (slips != 0.0 or not self.engaged(now))

    def carried(self, now: float, slips: float) -> float:
        """Effort through the clutch while the rotor turns by itself, on the motor's side."""
        return slips * self.clutch if self.engaged(now) else 0.0

    def seen(self, now: float, slips: float) -> Drive:
        """What the coordinate is driven by: a constant effort without a rotor where that turns by itself."""
        if not self.loose(now, slips):
            return self
        efforts = {"effort": self.carried(now, slips)}
        return replace(self, motor=CARRIED, parameters=efforts, inertia=0.0, off_from=np.inf, clutch=np.inf)

    def spin(self, time: Array, rotor: Array, integral: Array, now: float, slips: float) -> Array:
        """Acceleration of a rotor that turns by itself, at its speed: J ω̇ = T(ω) less what goes through the clutch."""
        shaft = self.shaft(time, rotor / self.ratio, integral, now)
        spin: Array = (shaft - self.carried(now, slips)) / self.inertia
        return spin

    def effort(self, time: Array, speed: Array, second: Array, integral: Array, now: float, share: Any = None) -> Array:
        """Effort on the coordinate, less what the rotor takes to be accelerated, and less the brake.

        second: of the coordinate; share: of the losses in the gear and of the brake, ±1 in motion in that sense, less
        at rest; by the speed, without the brake, if not given.
        """
        free = self.shaft(time, speed, integral, now) - self.inertia * self.ratio * second
        if share is None:
            return transmitted(free, speed, self.ratio, self.efficiency) + self.applied
        ahead, back = (transmitted(free, np.asarray(sense), self.ratio, self.efficiency) for sense in (1.0, -1.0))
        effort: Array = 0.5 * ((1.0 + share) * ahead + (1.0 - share) * back) - share * self.braking(now)
        return effort + self.applied

    def braking(self, now: float) -> float:
        """Effort of the brake, against the motion."""
        return self.brake if now >= self.brake_from else 0.0

    def error(self, time: Array, speed: Array, integral: Array, now: float) -> Array:
        """Rate of the controller's integral."""
        if self.motor is None or self.motor.of.error is None or now >= self.off_from:
            return 0.0 * speed
        return self.motor.of.error(self.ratio * speed, time, self.parameters, integral)

    def excess(self, time: Array, speed: Array, integral: Array, slip: Array) -> Array:
        """By how much what its controller aims at is beyond its limit. slip: of a clutch, (0 or 1, lane)."""
        assert self.motor is not None and self.motor.of.excess is not None  # noqa: PT018
        rotor = self.ratio * speed + sum(slip)
        return self.motor.of.excess(rotor, time, self.parameters, integral)


def switched(drives_: Mapping[str, Drive], end: float) -> Iterator[tuple[float, str, str, float]]:
    """Time, s, kind, driver and effort of every motor that is switched off and brake that is put on up to an end."""
    for name, drive in drives_.items():
        if drive.motor is not None and drive.off_from <= end:
            yield drive.off_from, "motor-off", name, np.nan
        if drive.brake and drive.brake_from <= end:
            yield drive.brake_from, "brake", name, drive.brake


def applied_to(driver: str) -> str:
    """The path of an effort on a free driver beside its motor's, which no file states."""
    return f"drivers.{driver}.applied"


def drives(system: System, values: Values, number: Callable[[Any], Any] = float) -> dict[str, Drive]:
    """What drives each free coordinate, by driver. number: what becomes of a value."""
    by_driver: dict[str, Drive] = {}
    for name, driver in system.mechanism.drivers.items():
        if not driver.found:
            continue
        motor, path = driver.motor, f"drivers.{name}.motor."
        parameters: dict[str, Any] = {
            key.removeprefix(path): number(value) for key, value in values.items() if key.startswith(path)
        }
        stated = {key: parameters[key] for key in STATED if key in parameters}
        if motor is not None:
            parameters = {"integral": 0.0, **parameters, "over": motor.over}
            for key in ("place", "effort"):
                numbers = [parameters[f"points.{k}.{key}"] for k in range(len(motor.points or ()))]
                parameters[f"points.{key}"] = numbers
        applied = number(values.get(applied_to(name), 0.0))
        by_driver[name] = Drive(motor, parameters, applied=applied, **stated)
    return by_driver
