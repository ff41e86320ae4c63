"""Motions of many mechanisms at once, from event to event, each lane at its own pace.

The method is that of `integrate`, lane by lane: DOP853 (E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary
Differential Equations I, 2nd ed., Springer, 1993) with a step size of its own, and where a step would pass a bend or
the speed 0 that number takes the place of the time (M. Hénon, Physica D 5 (1982) 412-414,
doi:10.1016/0167-2789(82)90034-3), so that the lane ends exactly there. What is not certain is left to others.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853

from trunnion.dynamics.compiled_lanes import CompiledLanes
from trunnion.dynamics.course import NODES, Courses
from trunnion.dynamics.lanes import Lanes, LaneState, picked_drive
from trunnion.dynamics.motor import Drive
from trunnion.dynamics.sampled import SampledTables

__all__ = ["Starts"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
Flags = NDArray[np.bool_]

TIME, PLACE, SPEED = 0, 1, 2  # which number goes ahead evenly in a step; the rows of a state, and the integral
UNDER_WAY, DONE, ENDED, LEFT = 0, 1, 2, 3  # of a lane: ENDED at the end of its range, LEFT to others
CREPT = 1e-9  # of the duration: a step that gets on
CLOSE = 1e-13  # of the duration: times that are one
SNAP = 1e-9  # of the coordinate: a bend at which a lane begins
FIRST = 1e-3  # of the typical time: the first step
MOST_TRIED = 100  # steps refused one after the other
STUCK = 60  # events without progress
MOST_STEPS = 200_000
SAFETY, LEAST, MOST = 0.9, 0.2, 10.0  # of the change of a step, as in SciPy


def _shares() -> Array:
    """(7, node): how much each part of the dense output counts at the nodes of a step."""
    found, product = np.empty((7, len(NODES))), np.ones(len(NODES))
    for i in range(7):
        product = product * (NODES if i % 2 == 0 else 1.0 - NODES)
        found[i] = product
    return found


SHARES = _shares()


@dataclass
class Starts:
    """Motions of the lanes of one table.

    drive: numbers that vary are (lane,); begin: coordinate, speed (2, lane); limits of the way, if it has ends; unit:
    typical acceleration; sizes: of coordinate; sticks: whether a lane may rest.
    """

    tables: SampledTables
    drive: Drive
    begin: Array
    duration: float
    tolerance: float
    unit: float
    size: float
    sticks: bool
    status: Rows = field(init=False)

    def __post_init__(self) -> None:
        count = self.begin.shape[1]
        self.status = np.zeros(count, np.intp)
        self.state = np.zeros((4, count))
        self.state[PLACE], self.state[SPEED] = self.begin
        self.rate, self.stale = np.zeros((4, count)), np.ones(count, bool)
        self.mode, self.target = np.zeros(count, np.intp), np.zeros(count)
        self.step = np.full(count, FIRST / np.sqrt(self.unit))
        self.sense = np.sign(self.begin[1]) if self.sticks else np.zeros(count)
        self.stretch, self.lap = np.zeros(count, np.intp), np.zeros(count)
        self.straight, self.tried, self.stayed = np.zeros(count, bool), np.zeros(count, int), np.zeros(count, int)
        self.friction = np.zeros((count, len(self.tables.rubs)))
        self.pace = np.full(count, np.sqrt(self.unit))
        times = [*self.drive.times_of(self.duration), np.full(count, self.duration)]
        self.breaks = np.sort(np.array([np.broadcast_to(one, (count,)) for one in times], float).T, axis=1)
        self.next = np.zeros(count, np.intp)
        self._pass_breaks(np.arange(count))
        pins = [rub.load.across is None for rub in self.tables.rubs]
        self.compiled = CompiledLanes(tuple(pins), count) if pins else None
        self.found: list[tuple[Rows, Array]] = []

    # ---- the whole way ----------------------------------------------------------------------------------------

    @np.errstate(all="ignore")
    def run(self) -> Courses:
        """The courses of all lanes; those LEFT have none that holds."""
        self._place(np.arange(len(self.status)))
        self._stand(np.flatnonzero((self.state[SPEED] == 0.0) & (self.status == UNDER_WAY)))
        for _ in range(MOST_STEPS):
            lanes = np.flatnonzero(self.status == UNDER_WAY)
            if not len(lanes):
                break
            self._advance(lanes)
        self.status[self.status == UNDER_WAY] = LEFT
        return Courses.of(len(self.status), self.found)

    def _at(self, lanes: Rows, rows: Array, now: Array) -> LaneState:
        drive = self.drive
        off, brake = (np.broadcast_to(one, self.status.shape)[lanes] for one in (drive.off_from, drive.brake_from))
        speed = rows[SPEED]
        if self.sticks:  # nothing is asked for beyond the speed 0
            speed = np.where(self.sense[lanes] * speed < 0.0, 0.0, speed)
        return LaneState(
            rows[TIME], rows[PLACE], speed, rows[3], self.stretch[lanes], self.lap[lanes], self.sense[lanes],
            now >= off, now >= brake,
        )  # fmt: skip

    def _now(self, lanes: Rows) -> Array:
        """A time within the stretch of time, which says what is switched on."""
        k = self.next[lanes]
        before = np.where(k > 0, self.breaks[lanes, np.maximum(k - 1, 0)], 0.0)
        found: Array = 0.5 * (before + self.breaks[lanes, k])
        return found

    def _asked(self, lanes: Rows) -> Lanes:
        return Lanes(self.tables, lanes, picked_drive(self.drive, lanes), self.friction[lanes], self.compiled)

    def _rates(self, asked: Lanes, lanes: Rows, rows: Array, now: Array) -> Array:
        """The derivative of states by time."""
        second, error = asked.rates(self._at(lanes, rows, now))
        return np.array([np.ones_like(second), rows[SPEED], second, error])

    # ---- one step of every lane -------------------------------------------------------------------------------

    def _advance(self, lanes: Rows) -> None:
        asked, now = self._asked(lanes), self._now(lanes)
        fresh = self.stale[lanes]
        if np.any(fresh):
            part = lanes[fresh]
            own = self._asked(part)
            self.rate[:, part] = self._rates(own, part, self.state[:, part], now[fresh])
            asked.friction[fresh], self.stale[part] = own.friction, False
        self._foresee(lanes)
        mode, old, by_time = self.mode[lanes], self.state[:, lanes], self.rate[:, lanes]
        lane = np.arange(len(lanes))
        way = self.target[lanes] - old[mode, lane]
        arrives = self.step[lanes] >= np.abs(way)
        size = np.where(arrives, way, np.copysign(self.step[lanes], way))
        slopes = [_along(by_time, mode)]
        for row in DOP853.A[1:]:
            slopes.append(_along(self._rates(asked, lanes, old + size * _summed(row, slopes), now), mode))
        new = old + size * _summed(DOP853.B, slopes)
        new[mode, lane] = np.where(arrives, self.target[lanes], new[mode, lane])
        after = self._rates(asked, lanes, new, now)
        slopes.append(_along(after, mode))
        miss = self._miss(lanes, old, new, size, slopes)
        good = (miss < 1.0) & np.all(np.isfinite(new), axis=0)
        good &= (mode != PLACE) | (new[SPEED] * old[SPEED] > 0.0)
        turned = self._turn(lanes, old, by_time, new, good)
        kept = good & ~turned
        self._resize(lanes, np.abs(size), miss, kept, turned, arrives)
        self.tried[lanes] = np.where(kept, 0, self.tried[lanes] + 1)
        self.status[lanes[self.tried[lanes] > MOST_TRIED]] = LEFT
        self.friction[lanes] = asked.friction
        if np.any(kept):
            self._keep(lanes, kept, asked, now, old, new, after, size, slopes)
            self._arrive(lanes[kept & arrives])

    def _foresee(self, lanes: Rows) -> None:
        """Lanes whose next step would pass a bend go to it; not if they turn round before."""
        gains = (self.mode[lanes] == SPEED) & (self.rate[SPEED, lanes] * self.state[SPEED, lanes] >= 0.0)
        self._switch(lanes[gains], TIME, 0.0)
        low, high = self._bounds(lanes)
        _, q, speed, _ = self.state[:, lanes]
        timed = (self.mode[lanes] == TIME) & ~self.straight[lanes]
        self.target[lanes] = np.where(
            self.mode[lanes] == TIME, self.breaks[lanes, self.next[lanes]], self.target[lanes]
        )
        level = np.where(speed > 0.0, high, low)
        step = np.minimum(self.step[lanes], self.target[lanes] - self.state[TIME, lanes])
        reached = speed * speed + 2.0 * self.rate[SPEED, lanes] * (level - q)
        goes = timed & np.isfinite(level) & (speed != 0.0) & ((level - q) / speed < step) & (reached > 0.0)
        self._switch(lanes[goes], PLACE, level[goes])

    def _switch(self, lanes: Rows, mode: int, target: Array | float) -> None:
        """Another number goes ahead evenly; the step covers the same time."""
        old = self.mode[lanes]
        self.step[lanes] *= np.abs(self.rate[mode, lanes] / self.rate[old, lanes])
        self.mode[lanes], self.target[lanes] = mode, target
        self.stayed[lanes] += 1
        bad = ~(np.isfinite(self.step[lanes]) & (self.step[lanes] > 0.0)) | (self.stayed[lanes] > STUCK)
        self.status[lanes[bad]] = LEFT

    def _turn(self, lanes: Rows, old: Array, by_time: Array, new: Array, good: Flags) -> Flags:
        """Whether each lane passes an event in this step, which is then taken anew in another way."""
        low, high = self._bounds(lanes)
        mode, sense = self.mode[lanes], self.sense[lanes]
        timed = (mode == TIME) & ~self.straight[lanes]
        beyond = (new[PLACE] > high) | (new[PLACE] < low)
        back = (sense != 0.0) & (sense * new[SPEED] <= 0.0)
        resting = timed & good & beyond & ~back & (old[SPEED] == 0.0)
        self.step[lanes[resting]] *= 0.25
        short = old[SPEED] ** 2 + 2.0 * by_time[SPEED] * (self.target[lanes] - old[PLACE]) <= 0.0
        stops = (timed & good & back) | ((mode == PLACE) & ~good & short)
        self._switch(lanes[stops], SPEED, 0.0)
        passes = ((timed & good & beyond & ~back) | ((mode == SPEED) & good & beyond)) & ~resting
        level = np.where(new[PLACE] > high, high, low)
        self._switch(lanes[passes], PLACE, level[passes])
        late = (mode != TIME) & good & (new[TIME] > self.breaks[lanes, self.next[lanes]]) & ~passes
        self._switch(lanes[late], TIME, self.breaks[lanes, self.next[lanes]][late])
        self.straight[lanes[late]] = True
        return np.asarray(resting | stops | passes | late)

    def _resize(self, lanes: Rows, size: Array, miss: Array, kept: Flags, turned: Flags, arrives: Flags) -> None:
        change = np.where(miss > 0.0, SAFETY * miss ** (-1.0 / 8.0), MOST)
        change = np.where(np.isfinite(change), np.clip(change, LEAST, MOST), LEAST)
        change = np.where(kept & (self.tried[lanes] == 0), change, np.minimum(change, 1.0))
        before = self.step[lanes]
        cut = kept & arrives  # shorter than it could have been
        self.step[lanes] = np.where(turned, before, np.where(cut, np.maximum(before, size * change), size * change))

    def _miss(self, lanes: Rows, old: Array, new: Array, size: Array, slopes: list[Array]) -> Array:
        """Estimate of the error of a step, as a share of what it may be: SciPy's."""
        pace = np.maximum(self.pace[lanes], np.abs(new[SPEED]))
        self.pace[lanes] = np.where(np.isfinite(pace), pace, self.pace[lanes])
        own = self.pace[lanes]
        # of time and coordinate what is typical: how long it has run and how far is no measure of a turn
        scale = self.tolerance * np.array([
            1.0 / own, np.full_like(own, self.size), 0.01 * own + np.maximum(np.abs(old[2]), np.abs(new[2])),
            1.0 + np.maximum(np.abs(old[3]), np.abs(new[3])),
        ])  # fmt: skip
        fifth = np.sum((_summed(DOP853.E5, slopes) / scale) ** 2, axis=0)
        third = np.sum((_summed(DOP853.E3, slopes) / scale) ** 2, axis=0)
        found = np.abs(size) * fifth / np.sqrt((fifth + 0.01 * third) * 3.0)
        return np.where((fifth == 0.0) & (third == 0.0), 0.0, np.where(np.isfinite(found), found, np.inf))

    def _keep(
        self, lanes: Rows, kept: Flags, asked: Lanes, now: Array, old: Array, new: Array, after: Array, size: Array,
        slopes: list[Array],
    ) -> None:  # fmt: skip
        """Note a step that was taken, by its dense output at the nodes, and go on from its end."""
        part, mode = lanes[kept], self.mode[lanes]
        slopes = list(slopes)
        for row in DOP853.A_EXTRA:
            tried = old + size * _summed(row, slopes)
            slopes.append(_along(self._rates(asked, lanes, tried, now), mode))
        change = new - old
        parts = [change, size * slopes[0] - change, 2.0 * change - size * (slopes[12] + slopes[0])]
        parts += [size * _summed(row, slopes) for row in DOP853.D]
        numbers = [one[:, kept] for one in parts]
        nodes = old[:, kept, None] + _summed(SHARES, [one[..., None] for one in numbers])
        self.found.append((part, self._with_effort(lanes, kept, nodes, now)))
        self.state[:, part], self.rate[:, part] = new[:, kept], after[:, kept]
        self.stayed[part[(mode[kept] == TIME) & (size[kept] > CREPT * self.duration)]] = 0

    def _with_effort(self, lanes: Rows, kept: Flags, nodes: Array, now: Array) -> Array:
        """(time, coordinate, speed, effort of the drive, (lane, node)) of steps."""
        part, count = lanes[kept], nodes.shape[-1]
        wide = np.repeat(part, count)
        flat = nodes.reshape(4, -1)
        at = self._at(wide, flat, np.repeat(now[kept], count))
        second = Courses.slopes(nodes[SPEED]) / Courses.slopes(nodes[TIME])
        drive = picked_drive(self.drive, wide)
        asked = Lanes(self.tables, wide[:0], drive, self.friction[:0])
        given = asked.given(at, second.ravel())
        way = np.where(at.speed != 0.0, np.sign(at.speed), at.sense)
        effort = given - way * np.where(at.braked, drive.brake, 0.0)
        return np.concatenate([nodes[:3], effort.reshape(1, *nodes.shape[1:])])

    # ---- events -----------------------------------------------------------------------------------------------

    def _arrive(self, lanes: Rows) -> None:
        """What becomes of lanes that are where they were to go."""
        mode = self.mode[lanes]
        for number, then in ((PLACE, self._cross), (SPEED, self._stand), (TIME, self._pass_breaks)):
            part = lanes[mode == number]
            if len(part):
                if number != TIME:
                    self._switch(part, TIME, 0.0)
                then(part)
                self.stale[part] = True

    def _pass_breaks(self, lanes: Rows) -> None:
        """The next break after the present time; the end after the last."""
        self.straight[lanes] = False
        self.stayed[lanes] = 0
        for _ in range(self.breaks.shape[1]):
            here = self.breaks[lanes, np.minimum(self.next[lanes], self.breaks.shape[1] - 1)]
            self.next[lanes] += here <= self.state[TIME, lanes] + CLOSE * self.duration
            done = self.next[lanes] >= self.breaks.shape[1]
            self.next[lanes[done]] -= 1
            self.status[lanes[done]] = DONE

    def _stand(self, lanes: Rows) -> None:
        """Lanes at the speed 0: they break away, or rest until the next break."""
        self.state[SPEED, lanes] = 0.0
        self.stayed[lanes] += 1
        self.status[lanes[self.stayed[lanes] > STUCK]] = LEFT
        lanes = lanes[self.status[lanes] == UNDER_WAY]
        if not len(lanes):
            return
        self.stale[lanes] = True
        if not self.sticks:  # it goes on in the sense of its acceleration
            self.sense[lanes] = np.sign(
                self._rates(self._asked(lanes), lanes, self.state[:, lanes], self._now(lanes))[2]
            )
            self._settle_on(lanes)
            self.sense[lanes] = 0.0
            return
        over = [self._brink(lanes, sense) for sense in (1.0, -1.0)]
        unsure = ~np.isfinite(over[0]) | ~np.isfinite(over[1])
        self.status[lanes[unsure]] = LEFT
        rests = (over[0] <= 0.0) & (over[1] <= 0.0) & ~unsure
        self.sense[lanes] = np.where(over[0] >= over[1], 1.0, -1.0)
        self._settle_on(lanes[~rests & ~unsure])
        self._rest(lanes[rests])

    def _brink(self, lanes: Rows, sense: float) -> Array:
        """By how much lanes at rest are driven beyond where they break away in a sense."""
        self.sense[lanes] = sense
        before = self.stretch[lanes], self.lap[lanes], self.status[lanes]
        self._settle_on(lanes)
        found = self._asked(lanes).beyond(self._at(lanes, self.state[:, lanes], self._now(lanes)))
        self.stretch[lanes], self.lap[lanes], self.status[lanes] = before
        return found

    def _rest(self, lanes: Rows) -> None:
        """Stay until the next break; what changes meanwhile is left to others."""
        if not len(lanes):
            return
        motor = self.drive.motor
        if motor is not None and (motor.of.error is not None or (motor.kind == "table" and motor.over == "time")):
            self.status[lanes] = LEFT
            return
        now, until = self._now(lanes), self.breaks[lanes, self.next[lanes]]
        nodes = np.repeat(self.state[:, lanes, None], len(NODES), axis=2)
        nodes[TIME] += (until - self.state[TIME, lanes])[:, None] * NODES
        held = nodes.copy()
        held[3] = self._asked(lanes).given(self._at(lanes, self.state[:, lanes], now), 0.0 * until)[:, None]
        self.found.append((lanes, held))
        self.state[TIME, lanes] = until
        self._pass_breaks(lanes)
        again = lanes[self.status[lanes] == UNDER_WAY]
        self._stand(again)

    def _cross(self, lanes: Rows) -> None:
        """Into the next stretch of the way."""
        self.stayed[lanes] = 0
        forward = self.state[SPEED, lanes] > 0.0
        self.stretch[lanes] += np.where(forward, 1, -1)
        self._wrap(lanes)

    def _wrap(self, lanes: Rows) -> None:
        """Round the turn; off the end of a range the lane has ended."""
        count = len(self.tables.count)
        over, under = self.stretch[lanes] >= count, self.stretch[lanes] < 0
        self.stretch[lanes] = np.where(over, 0, np.where(under, count - 1, self.stretch[lanes]))
        if self.tables.period is None:
            self.stretch[lanes] = np.where(over, count - 1, np.where(under, 0, self.stretch[lanes]))
            self.status[lanes[over | under]] = ENDED
        else:
            self.lap[lanes] += over.astype(float) - under

    def _place(self, lanes: Rows) -> None:
        """In which stretch lanes begin."""
        q, tables = self.state[PLACE, lanes], self.tables
        low = tables.low[lanes]
        if tables.period is not None:
            self.lap[lanes] = np.floor((q - low[:, 0]) / tables.period[lanes])
            q = q - self.lap[lanes] * tables.period[lanes]
        else:  # outside its range no lane begins
            high = low[:, -1] + tables.width[lanes, -1] * tables.count[-1]
            self.status[lanes[~((q >= low[:, 0]) & (q <= high))]] = LEFT
        self.stretch[lanes] = np.clip(np.sum(low <= q[:, None], axis=1) - 1, 0, len(tables.count) - 1)
        self._settle_on(lanes)

    def _settle_on(self, lanes: Rows) -> None:
        """A lane at a bend is in the stretch that lies ahead of it."""
        low, high = self._bounds(lanes)
        q, near = self.state[PLACE, lanes], SNAP * np.maximum(1.0, np.abs(self.state[PLACE, lanes]))
        way = np.where(self.state[SPEED, lanes] != 0.0, np.sign(self.state[SPEED, lanes]), self.sense[lanes])
        ahead = ((way > 0.0) & (q >= high - near)).astype(np.intp) - ((way < 0.0) & (q <= low + near))
        self.stretch[lanes] += ahead
        self._wrap(lanes)

    def _bounds(self, lanes: Rows) -> tuple[Array, Array]:
        """Coordinates between which the forces of a lane are smooth; infinite if they are everywhere."""
        tables, stretch = self.tables, self.stretch[lanes]
        if not tables.parted and tables.period is not None:
            return np.full(len(lanes), -np.inf), np.full(len(lanes), np.inf)
        low = tables.low[lanes, stretch]
        high = low + tables.width[lanes, stretch] * tables.count[stretch]
        shift = 0.0 if tables.period is None else self.lap[lanes] * tables.period[lanes]
        return low + shift, high + shift


def _along(by_time: Array, mode: Rows) -> Array:
    """The derivative of states by the number that goes ahead evenly."""
    lane = np.arange(by_time.shape[1])
    found: Array = by_time / by_time[mode, lane]
    found[mode, lane] = 1.0
    return found


def _summed(weights: Array, parts: list[Any]) -> Any:
    """Σ w_i p_i in the order given, so that a lane's sum does not depend on how many there are."""
    total = 0.0
    for weight, part in zip(weights, parts, strict=False):
        if np.ndim(weight) or weight != 0.0:
            total = total + weight * part
    return total
