"""All assemblies of a general group at one position, and following one of them along the cycle."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.algebra.nested import each

__all__ = ["GUESSES", "SEED", "Follower", "assemblies", "at", "extent", "guess_reaches", "lane_of", "limits"]

Array = NDArray[np.float64]
Elements = Sequence[Any]  # per joint: both its elements, as nested tuples of numbers


class Followed(Protocol):
    """A group that is solved by Newton's method, in the plane or in space.

    kept: the coordinates (entries of a pose's q) that an assembly states; kept_kinds: "turn", "slide", or "part" of a
    quaternion. late: most rounds of Newton for the lanes that a few do not settle.
    """

    @property
    def kept(self) -> tuple[int, ...]: ...

    @property
    def kept_kinds(self) -> tuple[str, ...]: ...

    def position(self, elements: Any, assembly: Any, drive: Sequence[Number] = (), late: int = ...) -> Any: ...

    def size(self, elements: Any) -> Number: ...

    def signature(self, pose: Any, spread: float) -> list[Number]: ...


GUESSES = 512
TRIED = 64  # guesses at each place where it is tried whether there is an assembly at all
TOGETHER = 6  # such places at a time: the first at which there is one is enough
FEW = 16  # guesses at each place where an assembly is looked for again
PROBES = 96  # such places in the gaps of a track
MOST_CONDITION = 1e8  # of an assembly that counts
SAME = 1e-6  # of signatures: nearer assemblies are one
SEED = 20060704  # of the guesses: the same assemblies every time
TURN_JUMP = 0.35  # rad between neighbours of the grid: more is another branch
SLIDE_JUMP = 0.25  # of the group's size, likewise
BLOCK = 32  # grid points tried at a time
STRIDE = 24  # grid points from one to the next that is followed first
WIDE = 8  # of these at a time
LONGEST = 1440  # grid points solved at once
NEAR_LIMIT = 24  # more rounds of Newton from a guess nearby: halving a step brings it to 1e-7 where branches meet
HALVINGS = 5  # of the way between two grid points, where Newton strays


def _wrap(rows: Array) -> None:
    """Carry the start over to the end of a periodic cycle: the same position, turned by whole turns."""
    if np.isfinite(rows[0, 0]) and not np.isfinite(rows[0, -1]):
        rows[:, -1] = rows[:, 0]
    elif np.isfinite(rows[0, -1]) and not np.isfinite(rows[0, 0]):
        rows[:, 0] = rows[:, -1]


def _gap_backward(rows: Array) -> list[int]:
    """Indices from the end of the cycle down to the first gap, if the end was reached only by wrapping."""
    if np.all(np.isfinite(rows[0])) or not np.isfinite(rows[0, -1]):
        return []
    return list(range(rows.shape[1] - 1, -1, -1))


def _unknown(rows: Array, order: Sequence[int], place: int) -> Sequence[int]:
    """The grid points along `order` from a known one on to the last before one that is known, or of LONGEST."""
    piece = order[place : place + LONGEST]
    there = np.flatnonzero(np.isfinite(rows[0, piece[1:]]))
    return piece[: 1 + there[0]] if len(there) else piece


def _through(known: Array, places: Array) -> Array:
    """Between columns of numbers, at places counted in columns: cubic, with the slopes of the neighbours."""
    slopes = np.gradient(known, axis=1)
    low = np.minimum(places.astype(np.intp), known.shape[1] - 2)
    s = places - low
    ends = known[:, low] * (1 + 2 * s) * (1 - s) ** 2 + known[:, low + 1] * s**2 * (3 - 2 * s)
    return np.asarray(ends + slopes[:, low] * s * (1 - s) ** 2 + slopes[:, low + 1] * s**2 * (s - 1))


def _probes(gaps: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Some grid points spread over the gaps of a track, at most PROBES; none if it is a gap as a whole."""
    places = np.flatnonzero(gaps)
    if len(places) == len(gaps):
        return places[:0]
    return places[np.unique(np.linspace(0, len(places) - 1, min(len(places), PROBES)).astype(np.intp))]


def assemblies(group: Followed, elements: Elements, drive: Sequence[Number]) -> Any:
    """All assemblies found at one position from many guesses, each once, along the last axis of a pose."""
    rng = np.random.default_rng(SEED)
    spread = extent(group, elements)
    guesses = [rng.uniform(-reach, reach, GUESSES) for reach in guess_reaches(group, spread)]
    pose = group.position(elements, guesses, drive)
    shape = (GUESSES,)
    key = np.array([np.broadcast_to(n, shape) for n in group.signature(pose, spread)])
    sound = np.isfinite(key).all(axis=0) & (np.broadcast_to(pose.condition, shape) < MOST_CONDITION)
    for i in _geared(group):  # whole turns more would be another tooth
        sound = sound & (np.abs(np.broadcast_to(pose.q[i], shape)) <= np.pi)
    good = np.flatnonzero(sound)
    kept: list[int] = []
    for lane in good:
        if all(np.max(np.abs(key[:, lane] - key[:, other])) > SAME for other in kept):
            kept.append(int(lane))
    kept.sort(key=lambda lane: tuple(np.round(key[:, lane], 6)))  # a numbering that does not depend on the guesses
    return pose._replace(
        frames=each(pose.frames, lambda n: np.broadcast_to(n, shape)[kept]),
        q=tuple(np.broadcast_to(q, shape)[kept] for q in pose.q),
        orientation=np.broadcast_to(pose.orientation, shape)[kept],
    )


def closing(group: Followed, elements: Elements, drive: Sequence[Number], places: Sequence[int]) -> Iterator[int]:
    """Those of some grid points at which one of a few guesses closes the group, several points tried at once."""
    rng = np.random.default_rng(SEED)
    every = np.array(places, np.intp)
    spread = extent(group, at(elements, every))
    guesses = [rng.uniform(-reach, reach, (len(places), TRIED)) for reach in guess_reaches(group, spread)]
    for first in range(0, len(places), TOGETHER):
        some = slice(first, first + TOGETHER)
        lanes = np.repeat(every[some], TRIED)
        start = [guess[some].ravel() for guess in guesses]
        pose = group.position(at(elements, lanes), start, [lane_of(q, lanes) for q in drive])
        closed = np.isfinite(np.broadcast_to(pose.orientation, lanes.shape))
        for q in pose.q:
            closed = closed & np.isfinite(np.broadcast_to(q, lanes.shape))
        yield from (int(place) for place in every[some][closed.reshape(-1, TRIED).any(axis=1)])


def guess_reaches(group: Followed, spread: float) -> list[float]:
    """How far a guess of each coordinate may lie from 0."""
    return [{"turn": np.pi, "slide": 2 * spread, "part": 1.0}[kind] for kind in group.kept_kinds]


def _geared(group: Any) -> list[int]:
    """Entries of q that a gear pair multiplies."""
    geared = {gear.first for gear in getattr(group, "gears", ())}
    return [group.starts[joint] for joint in group.order if joint in geared - set(group.driven)]


def extent(group: Followed, elements: Elements) -> float:
    """How far a slide may reach: the largest size of the group over the lanes, m."""
    sizes = group.size(elements)
    return float(np.max(sizes[np.isfinite(sizes)], initial=0.0)) or 1.0


def lane_of(number: Number, index: int | NDArray[np.intp]) -> Number:
    return number[index] if np.ndim(number) else number


def at(elements: Elements, index: int | NDArray[np.intp]) -> list[Any]:
    """The elements at some grid points."""
    return [each(one, lambda n: lane_of(n, index)) for one in elements]


class Ways(NamedTuple):
    """Assemblies at one grid point: coordinates (free, way), and what tells them apart (entry, way)."""

    q: Array
    key: Array


@dataclass(frozen=True)
class Follower:
    """Follows one assembly of a general group from grid point to grid point. leaps: whether wide steps are tried."""

    group: Followed
    elements: Elements
    drive: Sequence[Number]
    orientation: float
    leaps: bool = True

    def run(self, rows: Array, order: Sequence[int]) -> None:
        """Fill `rows` (free, grid) along `order`, whose first column is known, up to where the branch ends.

        Several grid points are tried at a time, all lanes in parallel, and kept as far as they follow smoothly.
        """
        slope = np.zeros(len(rows))
        block, place, leaps = 1, 0, False
        while place + 1 < len(order):
            here, ahead = order[place], list(order[place + 1 : place + 1 + block])
            if np.isfinite(rows[0, ahead[0]]):
                slope = rows[:, ahead[0]] - rows[:, here]
                place += 1
                continue
            if leaps and len(piece := _unknown(rows, order, place)) > 2 * STRIDE:
                ahead = list(piece[1:])
                found = self._leap(rows[:, here], slope, piece)
                leaps = found.shape[1] == len(ahead)
            elif len(ahead) == 1:
                alone = self._advance(rows[:, here], slope, here, ahead[0], 0, 1 << HALVINGS)
                if alone is None:
                    return
                found, leaps = alone[:, None], self.leaps and place == 0
            else:
                guess = rows[:, here, None] + slope[:, None] * np.arange(1, len(ahead) + 1)
                found = self._followed(rows[:, here], np.asarray(ahead), guess)
            kept = found.shape[1]
            if kept:
                rows[:, ahead[:kept]] = found
                before = rows[:, ahead[kept - 2]] if kept > 1 else rows[:, here]
                slope = found[:, -1] - before
            place += kept
            block = min(2 * block, BLOCK) if kept == len(ahead) else max(1, min(kept, BLOCK))

    def both_ways(self, rows: Array, begin: int, periodic: bool) -> None:
        """Follow from one grid point forward and back, and over the end of a periodic cycle."""
        run = range(begin, rows.shape[1])
        self.run(rows, list(run))
        self.run(rows, list(range(begin, -1, -1)))
        if periodic:
            _wrap(rows)
            self.run(rows, _gap_backward(rows))

    def revisit(self, rows: Array, periodic: bool) -> NDArray[np.intp]:
        """Fill the parts of the gaps in which the group can be assembled again, as far as the probes find them.

        A range that reaches into what is known belongs to another assembly of the same sense and is left out.
        Returns the grid points that were filled, in order.
        """
        gaps = ~np.isfinite(rows[0])
        probes = _probes(gaps)
        if not len(probes):
            return probes
        found = self._found_at(probes)
        left_out: list[Array] = []  # what tells them from others at the probes, (entry, probe)
        for k, (probe, ways) in enumerate(zip(probes, found, strict=True)):
            if np.isfinite(rows[0, probe]) or not ways.q.size:
                continue
            known = np.flatnonzero(np.isfinite(rows[0]))
            before = rows[:, known[np.argmin(np.abs(known - probe))]]
            nearest = int(np.argmin(self._apart(ways.q, before)))
            if any(np.max(np.abs(ways.key[:, nearest] - other[:, k])) <= SAME for other in left_out):
                continue  # to follow it again would end as before
            fresh = np.full_like(rows, np.nan)
            fresh[:, probe] = ways.q[:, nearest]
            self.both_ways(fresh, int(probe), periodic)
            filled = np.isfinite(fresh[0])
            if np.any(filled & np.isfinite(rows[0])):
                left_out.append(self._keys(fresh, probes))
            else:
                rows[:, filled] = fresh[:, filled]
        return np.flatnonzero(gaps & np.isfinite(rows[0]))

    def _keys(self, rows: Array, probes: NDArray[np.intp]) -> Array:
        """What tells a track from others at each grid point, (entry, probe); NaN where it does not reach."""
        pose = self.group.position(at(self.elements, probes), list(rows[:, probes]), self._drive_at(probes))
        return self._key(pose, probes.shape)

    def _key(self, pose: Any, shape: tuple[int, ...]) -> Array:
        """Numbers (entry, lane) that are the same where the links are in the same places."""
        signature = self.group.signature(pose, extent(self.group, self.elements))
        return np.array([np.broadcast_to(n, shape) for n in signature])

    def _drive_at(self, index: NDArray[np.intp]) -> list[Number]:
        return [lane_of(n, index) for n in self.drive]

    def _found_at(self, probes: NDArray[np.intp]) -> list[Ways]:
        """Assemblies of the right sense at each grid point, found from FEW guesses each."""
        rng = np.random.default_rng(SEED)
        spread = extent(self.group, self.elements)
        lanes = np.repeat(probes, FEW)
        guesses = [far * rng.uniform(-1, 1, len(lanes)) for far in guess_reaches(self.group, spread)]
        pose = self.group.position(at(self.elements, lanes), guesses, self._drive_at(lanes))
        sound = np.broadcast_to(pose.orientation, lanes.shape) == self.orientation
        sound &= np.broadcast_to(pose.condition, lanes.shape) < MOST_CONDITION
        q = np.array([np.broadcast_to(pose.q[i], lanes.shape) for i in self.group.kept])
        sound &= np.isfinite(q).all(axis=0)
        key = self._key(pose, lanes.shape)
        own = [k * FEW + np.flatnonzero(sound[k * FEW : (k + 1) * FEW]) for k in range(len(probes))]
        return [Ways(q[:, some], key[:, some]) for some in own]

    def _apart(self, ways: Array, before: Array) -> Array:
        """How far assemblies (free, way) are from another, turns and slides counted against their sizes."""
        kinds = np.array(self.group.kept_kinds)[:, None]
        change = ways - before[:, None]
        turned = np.arctan2(np.sin(change), np.cos(change))
        size = np.where(kinds == "slide", extent(self.group, self.elements), 1.0)
        return np.asarray(np.sum(np.where(kinds == "turn", turned, change / size) ** 2, axis=0))

    def _leap(self, q: Array, slope: Array, piece: Sequence[int]) -> Array:
        """Coordinates (free, k) at the first k points of a piece after its first, where they are q and change by slope.

        Some far apart are followed first, then all are solved at once from what lies between these. They are kept by
        the same test as those of a block: where the wide steps went astray, narrow ones find the way.
        """
        wide = np.asarray(piece[::STRIDE])
        found, change = q[:, None], STRIDE * slope[:, None]
        while found.shape[1] < len(wide):
            ahead = wide[found.shape[1] : found.shape[1] + WIDE]
            more, good, _ = self._at(ahead, found[:, -1:] + change * np.arange(1, len(ahead) + 1))
            kept = len(ahead) if good.all() else int(np.argmin(good))
            if not kept:
                break
            found = np.append(found, more[:, :kept], axis=1)
            change = found[:, -1:] - found[:, -2:-1]
        if found.shape[1] < 3:
            return found[:, :0]
        inside = np.asarray(piece[1 : 1 + STRIDE * (found.shape[1] - 1)])
        return self._followed(q, inside, _through(found, np.arange(1, len(inside) + 1) / STRIDE))

    def _followed(self, q: Array, ahead: NDArray[np.intp], guess: Array) -> Array:
        """Coordinates (free, k) at the first k of some grid points, k as far as they follow q smoothly."""
        found, good, size = self._at(ahead, guess)
        change = np.diff(found, axis=1, prepend=q[:, None])
        bend = np.abs(np.diff(change, axis=1, prepend=change[:, :1]))
        limits = self._limits(size)[:, None]
        good = good & np.all((np.abs(change) <= limits) & (bend <= limits / 4), axis=0)
        return found[:, : len(ahead) if good.all() else int(np.argmin(good))]

    def _at(self, places: NDArray[np.intp], guess: Array) -> tuple[Array, NDArray[np.bool_], float]:
        """Coordinates (free, place) at some grid points, where they are of the right sense, and the size there.

        Points that a few rounds do not settle are left to a shorter block, in the end to `_advance`: past the end of a
        branch Newton wanders as long as it is let.
        """
        elements = at(self.elements, places)
        pose = self.group.position(elements, list(guess), self._drive_at(places), late=0)
        found = np.array([np.broadcast_to(pose.q[i], places.shape) for i in self.group.kept])
        good = np.broadcast_to(pose.orientation, places.shape) == self.orientation
        return found, good, extent(self.group, elements)

    def _limits(self, size: float) -> Array:
        """Largest change of each free coordinate between neighbours of the grid, rad or m."""
        return limits(self.group, size)

    def _advance(self, q: Array, slope: Array, here: int, there: int, low: int, high: int) -> Array | None:
        """From `low` to `high`, in shortest steps between two grid points, halving the way where Newton strays.

        The whole way and all its halvings are tried at once: Newton costs about as much for many lanes as for one.
        """
        shortest = 1 << HALVINGS
        ends = low + (high - low) // 2 ** np.arange((high - low).bit_length())
        found, good = self._solve(q, slope[:, None] * ((ends - low) / shortest), here, there, ends / shortest)
        if not np.any(good):
            return None
        first = int(np.argmax(good))
        reached: Array | None = found[:, first]
        for begin, end in pairwise(ends[first::-1]):
            if reached is not None:
                reached = self._advance(reached, slope, here, there, int(begin), int(end))
        return reached

    def _solve(self, before: Array, change: Array, here: int, there: int, shares: Array) -> tuple[Array, Array]:
        """Coordinates (free, share) at shares of the way between two grid points, and which follow those before.

        change: of the coordinates, as guessed, (free, share).
        """
        elements = [_mixed(one, here, there, shares) for one in self.elements]
        drive = [_between(q, here, there, shares) for q in self.drive]
        pose = self.group.position(elements, list(before[:, None] + change), drive, late=NEAR_LIMIT)
        found = np.array([np.broadcast_to(pose.q[i], shares.shape) for i in self.group.kept])
        limits = self._limits(extent(self.group, elements))[:, None]
        good = np.all(np.abs(found - before[:, None]) <= limits, axis=0)
        return found, good & (np.broadcast_to(pose.orientation, shares.shape) == self.orientation)


def _between(number: Number, here: int, there: int, share: Array) -> Number:
    return number[here] + share * (number[there] - number[here]) if np.ndim(number) else number


def _mixed(pair: Any, here: int, there: int, share: Array) -> Any:
    """Both elements of a joint part of the way between two grid points; axes stay of length one."""
    mixed = each(pair, lambda n: _between(n, here, there, share))
    parts: list[Any] = [one.normalised() if hasattr(one, "normalised") else one for one in mixed]
    return type(pair)(*parts) if hasattr(pair, "_fields") else tuple(parts)


def limits(group: Followed, size: float) -> Array:
    """Largest change of each coordinate that an assembly states, between neighbours of the grid, rad or m."""
    most = {"turn": TURN_JUMP, "slide": SLIDE_JUMP * size, "part": TURN_JUMP / 2}
    return np.array([most[kind] for kind in group.kept_kinds])
