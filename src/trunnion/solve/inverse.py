"""Motion stated at one joint, effort at another: what the drivers do while the joints that they move follow their laws.

The same links are driven at the stated joints and walked forward; coordinates, rates and second derivatives of the
drivers' joints are read of that walk, with derivatives by every number of the mechanism. Past a position at which the
stated joints cannot be moved by the drivers, where ∂(drivers)/∂(stated) changes its sign, there is no answer.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, MechanismError
from trunnion.joints.motion import Span
from trunnion.model.mechanism import Mechanism
from trunnion.solve.forward import Forward, forward
from trunnion.solve.switches import near, turned
from trunnion.solve.system import Cycle, System, Values, freed

Array = NDArray[np.float64]
KEPT = ("trunnion", "space", "ground", "dimensions", "links", "joints", "joint_defaults", "gears", "loop", "assembly",
        "over_constraint", "fits")  # fmt: skip
TURN, LOOKS = 2 * np.pi, 181


def driven_at_outputs(mechanism: Mechanism) -> Mechanism | None:
    """The same links, driven at the joints whose motion is stated; None where every driver states its own."""
    if not any(driver.moves for driver in mechanism.drivers.values()):
        return None
    data = mechanism.data()
    drivers = {driver.moves or name: data["drivers"][name] for name, driver in mechanism.drivers.items()}
    drivers = {name: {key: value for key, value in entry.items() if key != "moves"} for name, entry in drivers.items()}
    return Mechanism(**{key: data[key] for key in KEPT if key in data}, drivers=drivers)


@dataclass(frozen=True)
class Inverse:
    """moves: driver and the joint that it moves; system, values, cycle, assembly: of the links driven at those;
    findings: of the choice of that assembly."""

    moves: Mapping[str, str]
    system: System
    values: Values
    cycle: Cycle
    assembly: Any
    findings: tuple[Finding, ...] = ()

    def drive(self, values: Values, name: str, time: Number) -> tuple[Number, Number, Number]:
        """Coordinate, rate and second derivative of a driver at times, s; NaN past a dead centre of the drivers."""
        renamed = dict(values)  # the numbers of each law stand under the joint that it is of
        for driver, joint in self.moves.items():
            before = f"drivers.{driver}."
            numbers = ((path, value) for path, value in values.items() if path.startswith(before))
            renamed |= {f"drivers.{joint}.{path.removeprefix(before)}": value for path, value in numbers}
        walk = forward(self.system, renamed, self.assembly, time)
        which = 0 if self.system.turns(name) else 1
        coordinate, rate, second = (of(name)[which] for of in (walk.coordinates, walk.rates, walk.second_rates))
        if which == 0 and self.cycle.duration > 0:
            coordinate = near(coordinate, np.interp(primal(time), *self._turns[name]))
        lost = np.where(self._sense(renamed, time) * self._sense_at_start < 0, np.nan, 0.0)
        return coordinate + lost, rate, second

    def span(self, name: str, span: Span) -> Span:
        """The cycle of a driver, from that of the law of the joint that it moves."""
        rates, coordinates = self._ranges[name]
        travel = float(np.nanmax(coordinates) - np.nanmin(coordinates))
        return span._replace(one_way=False, peak=float(np.nanmax(np.abs(rates))), travel=travel)

    def _sense(self, values: Values, time: Number) -> Array:
        """The sign of the determinant of ∂(drivers)/∂(stated joints) at times, s."""
        place = primal(time)
        plain = {path: primal(value) for path, value in values.items()}
        drives = {name: self.system.drive(plain, name, place)[0] for name in self.system.mechanism.drivers}
        columns = []
        for joint in self.moves.values():
            still = {name: (value, float(name == joint), 0.0) for name, value in drives.items()}
            walk = forward(self.system, freed(plain, still), self.assembly, place)
            columns.append([walk.rates(name)[0 if self.system.turns(name) else 1] for name in self.moves])
        shape = np.broadcast_shapes(*(np.shape(number) for column in columns for number in column))
        matrix = np.array([[np.broadcast_to(number, shape) for number in column] for column in columns], float)
        return np.asarray(np.sign(np.linalg.det(np.moveaxis(np.nan_to_num(matrix), (0, 1), (-1, -2)))))

    @cached_property
    def _sense_at_start(self) -> float:
        """That of the nominal mechanism at the first position at which it has one."""
        senses = np.ravel(self._sense(self.values, self.cycle.times(LOOKS)))
        return float(next((sense for sense in senses if sense), 1.0))

    def _walk(self, time: Array) -> Forward:
        return forward(self.system, self.values, self.assembly, time)

    @cached_property
    def _ranges(self) -> dict[str, tuple[Array, Array]]:
        """Rates and coordinates of the drivers over the cycle of the nominal mechanism."""
        time = self.cycle.times(LOOKS)
        walk, ranges = self._walk(time), {}
        for name in self.moves:
            which = 0 if self.system.turns(name) else 1
            coordinate = np.broadcast_to(np.asarray(walk.coordinates(name)[which], float), time.shape)
            coordinate = np.interp(time, *self._turns[name]) if which == 0 and self.cycle.duration > 0 else coordinate
            ranges[name] = np.broadcast_to(np.asarray(walk.rates(name)[which], float), time.shape), coordinate
        return ranges

    @cached_property
    def _turns(self) -> dict[str, tuple[Array, Array]]:
        """Times, s, and angles without jumps of the drivers of the nominal mechanism: integrals of their rates."""
        names = [name for name in self.moves if self.system.turns(name)]
        if not names:
            return {}

        def look(time: Array) -> tuple[Array, NDArray[np.integer]]:
            walk = self._walk(time)
            rows = [np.broadcast_to(np.asarray(walk.rates(name)[0], float), time.shape) for name in names]
            return np.array(rows), np.isnan(rows[0]).astype(int)

        drivers = self.system.mechanism.drivers
        knots = [float(np.ravel(primal(knot))[0]) for name in drivers for knot in self.system.knots(self.values, name)]

        def firsts(times: Array) -> list[Number]:
            walk = self._walk(times)
            return [self._turned(walk, name) for name in names]

        span = (0.0, self.cycle.duration)
        return dict(zip(names, turned(self.cycle, look, firsts, np.array(knots, float), span), strict=True))

    def _turned(self, walk: Forward, name: str) -> Number:
        """Angle of a driver; with its whole turns where it moves a rack or screw, whose slide tells them."""
        for gear, gear_entry in self.system.mechanism.gears.items():
            turning, sliding = self.system.mechanism.coupled(gear)
            if gear_entry.slides and turning == name:
                slide = walk.coordinates(sliding)[1] - self.values[f"gears.{gear}.phase"]
                return slide / self.system.ratio(self.values, gear)
        return walk.coordinates(name)[0]

    def check(self, system: System, values: Values, assembly: Any) -> None:
        """MechanismError where the drivers do not hold the stated joints at the start where their laws say."""
        walk = forward(system, values, assembly, np.zeros(1))
        own_walk = self._walk(np.zeros(1))
        size = float(np.max(primal(system.size(values))))
        for name, joint in self.moves.items():
            which, unit = (0, 1.0) if system.turns(joint) else (1, size)
            coordinate, coordinate_wanted = (
                float(np.ravel(primal(of.coordinates(joint)[which]))[0]) for of in (walk, own_walk)
            )
            off = coordinate - coordinate_wanted
            off -= TURN * round(off / TURN) if which == 0 and np.isfinite(off) else 0.0
            if abs(off) > 1e-6 * unit:
                what = f"the assembly that is chosen does not hold {joint} where its motion begins"
                raise MechanismError(
                    Finding(what, f"drivers.{name}.moves", f"name its start in assembly: {{{joint}: …}}")
                )
