"""A walk forward and back over a long row of modules as machine code.

Of many modules NumPy's calls cost far more than the arithmetic. What `backward.solve` does is recorded once, cut where
modules end, and compiled; modules that are alike share their code. Positions that this does not decide for sure, as
those near locking, are solved by NumPy.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Hashable, Sequence
from dataclasses import fields, is_dataclass
from functools import cache, cached_property
from operator import itemgetter
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number, UntraceableError
from trunnion.engines.graph import BOTH, Graph
from trunnion.engines.parts import Parts
from trunnion.engines.recorded import STRUCTURAL, Recorded
from trunnion.solve.forward import Assembly, Forward, SpatialWalk, forward
from trunnion.solve.loads import closes
from trunnion.solve.system import System, Values

Array = NDArray[np.float64]
Pass = Callable[[Forward, Number], Any]  # gives a `Backward` of a walk in a direction, 1 or −1

MOST_CODES = 8  # of a system: numbers that are 0 or 1 are compiled in, and to record each choice of them takes seconds
LATEST = "latest"  # among the codes of a system: the numbers that were asked for last, and what of them is compiled in
MOST_FORMS = 16  # of mechanisms whose code is kept at hand
TIME, DIRECTION = "time", "direction"  # among the inputs of a code
TRIED = np.array([0.0, 0.0137, 0.137, 1.37])  # s, at which code that was recorded of another mechanism is tried
NUMBER = re.compile(r"[-+]?\.?\d[\d.]*([eE][-+]?\d+)?( [^-+*/^()]*)?$")  # with its unit, but no expression
POINT = re.compile(r"links\.[^.]*\.(points\.[^.]*|centre)\.[xyz]$")
BORDER = 99.0  # condition from which NumPy decides what a position is
PLAIN = frozenset({float, int, bool, str, np.float64})  # types of numbers that have one value and no derivatives
NUMBERS = (bool, int, float, np.generic, np.ndarray)
OF_WALK = ("motions", "frames", "poses", "_elements")
EAGER = ("body_power", "gear_power")  # what has a default is not made when it is asked for
STATED = ("walk", "travels", "margin_up_to", "margin")  # of a `Backward`, by whoever asks


_recorded: dict[Hashable, RowCode] = {}
_recording = Lock()  # who asks meanwhile waits: by NumPy it would take longer


def code_of(system: System, values: Values, assembly: Assembly, passed: Pass) -> RowCode | None:
    """The machine code for such numbers, recorded when it is first asked for; None where there is none.

    Parameters
    ----------
    passed
        What is to be compiled: it goes back over a walk that is passed in a direction.
    """
    of_values, literal = system.codes.get(LATEST, (None, None))
    if of_values is not values:  # of the same numbers more than one thing is asked
        literal = _structure(values)
        system.codes[LATEST] = values, literal
    if system.inverse or literal is None:
        return None
    key = literal, tuple(place if isinstance(place, int) else id(place) for place in assembly)
    if key not in system.codes and len(system.codes) > MOST_CODES:
        return None
    with _recording:
        if key not in system.codes:
            try:
                system.codes[key] = _of_form((_form(system), *key), system, values, assembly, passed)
            except UntraceableError:
                system.codes[key] = None
    code: RowCode | None = system.codes[key]
    return code


def _of_form(form: Hashable, system: System, values: Values, assembly: Assembly, passed: Pass) -> RowCode:
    """The code of another mechanism that differs by numbers alone, if it solves this one too; else one that is new."""
    code = _recorded.get(form)
    if code is not None:
        back, right = code.solved(system, values, TRIED), passed(forward(system, values, assembly, TRIED), 1.0)
        if back is not None and _same((back.reactions, back.walk.motions), (right.reactions, right.walk.motions)):
            return code
    if len(_recorded) >= MOST_FORMS:
        _recorded.clear()
    code = _recorded[form] = RowCode(system, values, assembly, passed)
    return code


def _structure(values: Values) -> tuple[tuple[str, Any], ...] | None:
    """What is compiled in: texts, and numbers by which kernels save work; None where a number has derivatives.

    Not places of points, which a hand moves away from 0 and back.
    """
    if not set(map(type, values.values())) <= PLAIN:
        return None
    return tuple((path, value) for path, value in values.items()
                 if (value in STRUCTURAL or isinstance(value, str)) and not _of_point(path))  # fmt: skip


@cache
def _of_point(path: str) -> bool:
    """Whether a number is a coordinate of a point or mass centre."""
    return POINT.match(path) is not None


def _form(system: System) -> str:
    """What a mechanism is but for its numbers."""

    def masked(entry: Any) -> Any:
        if isinstance(entry, dict):
            return {key: masked(item) for key, item in entry.items()}
        if isinstance(entry, list):
            return [masked(item) for item in entry]
        stated = isinstance(entry, str) and NUMBER.match(entry)
        return 0 if stated or (isinstance(entry, (int, float)) and not isinstance(entry, bool)) else entry

    entries = masked(system.mechanism.model_dump(mode="json"))
    closed = [closes(system.mechanism, name) for name in system.mechanism.tables]  # of numbers, and compiled in
    return json.dumps([closed, {key: entry for key, entry in entries.items() if key not in ("name", "assembly")}])


class RowCode:
    """Machine code of `backward.solve` for a system, its positions passed in either direction.

    Raises UntraceableError where the mechanism has what only NumPy does.
    """

    def __init__(self, system: System, values: Values, assembly: Assembly, passed: Pass) -> None:
        self.assembly, self.passed = assembly, passed
        graph, literal = Graph(in_parts=True), dict(_structure(values) or ())
        numbers = {path: Recorded(graph, graph.input(path, BOTH)) for path in values if path not in literal}
        time, direction = (Recorded(graph, graph.input(name, BOTH)) for name in (TIME, DIRECTION))
        conditions = list[Number]()
        with np.errstate(all="ignore"):
            walk = forward(system, {**literal, **numbers}, assembly, time)
            for group, pose in zip(system.groups, walk.poses, strict=True):
                conditions.append(group.condition(pose))
                graph.cut()
            back = passed(walk, direction)
        self._kind: Any = type("Solved", (_Filled, type(back)), {})
        self._of_back = [entry.name for entry in fields(back) if entry.name not in STATED]
        nests = {name: getattr(back.walk, name) for name in OF_WALK}
        nests |= {name: getattr(back, name) for name in self._of_back}
        certain, doubts = [settled.certain for settled in back.settled], [Recorded(graph, n) for n in graph.doubts]
        watched = [leaves_of(part) for part in (conditions, certain, doubts, [back.bound])]
        recorded = [leaf.node for leaf in leaves_of([nests, watched]) if isinstance(leaf, Recorded)]
        self._parts = Parts(graph, list(dict.fromkeys(recorded)))
        places = self._parts.rows
        self._conditions, self._certain, self._doubts, self._bound = (
            [places[leaf.node] for leaf in part if isinstance(leaf, Recorded)] for part in watched
        )
        # what is in the nests is in one list: the rows of the table, then what is true or false, then what is the same
        # at all times and for all numbers
        self._truths = [places[node] for node in dict.fromkeys(recorded) if graph.booleans[node]]
        truth_at = {row: len(places) + k for k, row in enumerate(self._truths)}
        self._same: list[Any] = []

        def place(leaf: Any) -> int:
            if isinstance(leaf, Recorded):
                row = places[leaf.node]
                return truth_at.get(row, row)
            self._same.append(leaf)
            return len(places) + len(self._truths) + len(self._same) - 1

        self._nests = {name: _Nest(_each(nest, place)) for name, nest in nests.items()}
        in_table = range(len(places))
        forces = [self._nests[name].leaves for name in ("reactions", "friction", "losses", "efforts")]
        self._forces = [row for rows in forces for row in rows if row in in_table]
        self._frames = [row for row in self._nests["frames"].leaves if row in in_table]
        moved = [row for row in self._nests["motions"].leaves if row in in_table]
        self._last = max([*moved, *self._conditions, *self._doubts], default=0)

    def solved(self, system: System, values: Values, time: Array, direction: float = 1.0) -> Any:
        """Motion and forces at some times, s, a `Backward`; None where NumPy is to find all of them."""
        table = self._table(values, time, direction)
        condition = np.max(table[self._conditions], axis=0, initial=1.0)
        doubtful = ~(condition <= BORDER) | np.any(table[self._certain] == 0.0, axis=0)
        doubtful |= ~np.isfinite(np.sum(table[self._forces], axis=0)) | np.any(table[self._doubts] != 0.0, axis=0)
        assembled = np.isfinite(np.sum(table[self._frames], axis=0))
        doubtful &= assembled  # elsewhere there are no forces to be found
        table[np.ix_(self._forces, ~assembled)] = np.nan
        if doubtful.all():
            return None
        entries = _Entries(self._nests, table, self._truths, self._same)
        bound = np.max(table[self._bound], axis=0, initial=0.0)
        walk = self._walked(system, values, time, entries, direction)
        filled = self._kind.__new__(self._kind)
        filled.__dict__ |= {"_entries": entries, "walk": walk, "travels": False, "margin": None}
        both: list[tuple[Any, Any]] = [(walk, {"condition": condition, "assembled": assembled}), (filled, {})]
        both[1][1].update(converged=~doubtful, share=np.where(doubtful, 0.0, 1.0), bound=bound)
        if doubtful.any():
            lanes = np.flatnonzero(doubtful)
            back = self.passed(forward(system, values, self.assembly, time[lanes]), direction)
            for name in (*OF_WALK, *self._of_back):
                if not entries.put(name, getattr(back.walk if name in OF_WALK else back, name), lanes):
                    return None
            for (_, worth), of in zip(both, (back.walk, back), strict=True):
                for name, number in worth.items():
                    number[lanes] = getattr(of, name)
        for holder, worth in both:
            holder.__dict__ |= worth
        for name in EAGER:
            setattr(filled, name, entries.made(name))
        return filled

    def walked(self, system: System, values: Values, time: Array) -> Forward:
        """Motion alone at some times, s, NaN where it cannot be assembled."""
        table = self._table(values, time, 1.0, self._last)
        walk = self._walked(system, values, time, _Entries(self._nests, table, self._truths, self._same), 1.0)
        walk.condition = np.max(table[self._conditions], axis=0, initial=1.0)
        walk.assembled = np.isfinite(np.sum(table[self._frames], axis=0))
        return walk

    def _walked(self, system: System, values: Values, time: Array, entries: _Entries, direction: float) -> Forward:
        made = _WalkedInSpace if system.spatial else _Walked
        walk = made.__new__(made)
        walk.__dict__ |= {"_entries": entries, "system": system, "values": values, "time": time}
        walk.direction, walk.assembly = direction, list(self.assembly)
        return walk

    def _table(self, values: Values, time: Array, direction: float, last: int | None = None) -> Array:
        given = [time if path == TIME else direction if path == DIRECTION else values[path]
                 for path in self._parts.inputs]  # fmt: skip
        return self._parts.run(given, len(time), last)[:, : len(time)]


class _Entries:
    """What the attributes of a walk and of its forces are made of."""

    def __init__(self, nests: dict[str, _Nest], table: Array, truths: list[int], same: list[Any]) -> None:
        self.nests, self.table, self.truths = nests, table, truths
        self.others = dict[int, Any]()  # in the place of what is the same elsewhere
        self._same = same

    def made(self, name: str) -> Any:
        """An attribute."""
        nest, rows, first = self.nests[name], len(self.table), len(self.table) + len(self.truths)
        row: dict[int, Any] = {}
        for place in nest.places:
            if place < rows:
                row[place] = self.table[place]
            elif place < first:
                row[place] = self.table[self.truths[place - rows]] != 0.0
            else:
                row[place] = self.others[place] if place in self.others else self._same[place - first]
        return nest.maker(row)

    def put(self, name: str, nest: Any, lanes: NDArray[np.intp]) -> bool:
        """Put what NumPy found into some lanes; False where it is of another form.

        Also in the place of what is the same elsewhere, as the share that is reached where a module locks.
        """
        leaves, numbers = self.nests[name].leaves, leaves_of(nest)
        rows, first = len(self.table), len(self.table) + len(self.truths)
        if len(numbers) != len(leaves):
            return False
        for place, number in zip(leaves, numbers, strict=True):
            if place < first:
                self.table[place if place < rows else self.truths[place - rows], lanes] = number
            elif isinstance(number, NUMBERS) and np.any(number != self._same[place - first]):
                same = self._same[place - first]
                kind = bool if isinstance(same, (bool, np.bool_)) else float
                self.others[place] = np.full(self.table.shape[1], same, kind)
                self.others[place][lanes] = number
        return True


class _Filled:
    """What has its numbers in a table: each attribute is made of them when it is first asked for."""

    def __getattr__(self, name: str) -> Any:
        entries: _Entries | None = self.__dict__.get("_entries")
        if entries is None or name not in entries.nests:
            raise AttributeError(name)
        self.__dict__[name] = value = entries.made(name)
        return value


class _Walked(_Filled, Forward):
    """Motion in the plane."""

    def __getattr__(self, name: str) -> Any:
        if name != "local":
            return super().__getattr__(name)
        self.local = self.system.elements(self.values)
        return self.local

    @cached_property
    def frames(self) -> dict[str, Any]:
        """Global frame of every link; the motions, of many more numbers, are not made for them."""
        frames: dict[str, Any] = self._entries.made("frames")
        return frames


class _WalkedInSpace(_Walked, SpatialWalk):
    """Motion in space."""


# ---- nests of tuples, lists, dictionaries and dataclasses ------------------------------------------------------------


class _Nest:
    """A nest whose leaves are places in a row of entries."""

    def __init__(self, placed: Any) -> None:
        self.placed = placed

    @cached_property
    def leaves(self) -> list[int]:
        """The places."""
        return leaves_of(self.placed)

    @cached_property
    def places(self) -> list[int]:
        """Each place once."""
        return list(dict.fromkeys(self.leaves))

    @cached_property
    def maker(self) -> Callable[[Any], Any]:
        """What makes such a nest of a row of entries."""
        return _maker(self.placed)


def _opened(nest: Any) -> tuple[Sequence[Any], Callable[[Any], Any]] | None:
    """The parts of a nest and what makes such a nest of a list of them; None of a leaf."""
    form = type(nest)
    if form is tuple or form is list:
        return nest, form
    if form is dict:
        return list(nest.values()), lambda parts: dict(zip(nest, parts, strict=True))
    if isinstance(nest, tuple):
        return nest, form._make
    if is_dataclass(form):
        return [getattr(nest, entry.name) for entry in fields(form)], lambda parts: form(*parts)
    return None


def _each(nest: Any, change: Callable[[Any], Any]) -> Any:
    """The same nest with `change` applied to what is in it."""
    opened = _opened(nest)
    return change(nest) if opened is None else opened[1]([_each(part, change) for part in opened[0]])


def leaves_of(nest: Any) -> list[Any]:
    """All that is in a nest, in order."""
    leaves, left = list[Any](), [nest]
    while left:
        opened = _opened(last := left.pop())
        if opened is None:
            leaves.append(last)
        else:
            left += reversed(opened[0])
    return leaves


def _same(nest: Any, other: Any) -> bool:
    """Whether two nests of numbers are the same but for rounding."""
    leaves, others = leaves_of(nest), leaves_of(other)
    if len(leaves) != len(others):
        return False
    rows = np.array([np.broadcast_arrays(*pair, TRIED)[:2] for pair in zip(leaves, others, strict=True)], float)
    size = np.nanmax(np.abs(rows), initial=0.0)
    return bool(np.allclose(rows[:, 0], rows[:, 1], 1e-8, 1e-10 * size, equal_nan=True))


def _maker(nest: Any) -> Callable[[Any], Any]:
    """What makes such a nest from a row of entries, of places in it."""
    opened = _opened(nest)
    if opened is None:
        return itemgetter(nest)
    parts, form = opened
    if len(parts) > 1 and all(isinstance(part, int) for part in parts):
        entries = itemgetter(*parts)  # by far the most often
        return entries if form is tuple else lambda row: form(entries(row))
    makers = [_maker(part) for part in parts]
    return lambda row: form([maker(row) for maker in makers])
