"""Whether a mechanism whose joints constrain more than its links have freedoms can be put together as it is built.

Its loops close only if the axes fit exactly. Where they do not, pins lie in their holes as the closure asks: of the
offsets of their ends the smallest are looked for that close every loop, position by position (`space.cone`).
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from trunnion import __version__
from trunnion.algebra.dual import primal
from trunnion.algebra.nested import flat
from trunnion.analysis import shifts
from trunnion.analysis.account import finding_row
from trunnion.analysis.analyse import check_steps
from trunnion.analysis.branches import choose
from trunnion.analysis.engine import build
from trunnion.analysis.kinematics import forward
from trunnion.analysis.space.cone import CLOSED, Ask, Found, least_play
from trunnion.analysis.space.loops import End, Loops, ends_of
from trunnion.analysis.space.starts import Start, start_of
from trunnion.analysis.space.system import SpatialSystem
from trunnion.analysis.system import Cycle, System, Values
from trunnion.errors import Finding, MechanismError, Severity
from trunnion.joints.clearance import CLEARANCE_MODELS
from trunnion.model.mechanism import Mechanism

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FIGURES", "Fit", "assemble", "assembled"]

Array = NDArray[np.float64]
Uniform = Literal["pins", "all"]
ENOUGH = 1 + 1e-9  # of the stated clearances: all of it is enough
CLOSE = 0.9  # of the largest need: maxima between the positions are looked for beside those above it
BETWEEN, NARROWED = 9, 5  # points in the interval around a maximum, and how often it is narrowed to a quarter
TOLD = 0.05  # a joint's part in the need that is worth telling
SOURCE = "P. J. Goulart and Y. Chen, Clarabel: an interior-point solver for conic programs, arXiv:2405.12762"


class Fit(IntEnum):
    """What a position came to."""

    text: str

    def __new__(cls, value: int, text: str) -> Fit:
        """An integer code that carries its sentence."""
        one = int.__new__(cls, value)
        one._value_ = value
        one.text = text
        return one

    FITS = 0, "it can be assembled"
    SHORT = 1, "the stated clearances do not suffice"
    RIGID = 2, "no play is stated that could close the loops, however large"
    UNSETTLED = 3, "the least clearance was not found"
    APART = 4, "it cannot be assembled, with or without errors"


class Figure(NamedTuple):
    """Dimensions before `position`, unit, long name."""

    dims: tuple[str, ...]
    units: str
    long_name: str


ENDS = ("joint", "end", "axis")
FIGURES: dict[str, Figure] = {
    "drive_coordinate": Figure(("driver",), "", "coordinate of the driver, rad or m"),
    "needed_share": Figure((), "1", "least share of the stated clearances that closes every loop; more than 1: they do not"),
    "needed_clearance": Figure((), "m", "smallest radial clearance, the same in every pin, that closes every loop"),
    "open_angle": Figure((), "rad", "how far the loops stay open without play, in angle"),
    "open_length": Figure((), "m", "how far the loops stay open without play, in length"),
    "stated_offset": Figure(ENDS, "m", "offset of a pin's end at the least share of the stated clearances, hole's frame"),
    "uniform_offset": Figure(ENDS, "m", "offset of a pin's end at the smallest clearance, hole's frame"),
    "stated_part": Figure(("joint", "end"), "1", "part of an end's clearance in the need; the parts add up to 1"),
    "uniform_part": Figure(("joint", "end"), "1", "the same at the smallest clearance of all pins"),
    "closure_residual": Figure((), "1", "largest exact opening of a loop at these offsets, rad or of the size"),
    "certificate": Figure((), "1", "how far the proven lower bound of the need lies below it, relative"),
    "status": Figure((), "1", "code of what the position came to; see the attribute flag_meanings"),
}  # fmt: skip


def assemble(
    mechanism: Mechanism,
    steps: int = 72,
    uniform: Uniform = "pins",
    progress: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """Whether the stated clearances take up the errors of a mechanism, and the smallest clearance that would.

    steps: equally spaced positions of the cycle. uniform: what has one and the same clearance where the smallest is
    looked for: all pins with a play (all pins, if none has), other plays as stated; or "all" kinds of play.
    Returns a Dataset with the variables of `FIGURES`, dims joint, end, axis, position; the attribute
    `smallest_clearance` (m) is the largest need of the whole cycle, between the positions too. `status`: see `Fit`.
    progress: called with the number of positions done.
    Raises MechanismError for a play without a length, or a structure that leaves a freedom undetermined.
    """
    stated = mechanism.parameters()
    return assembled(mechanism, stated, _ideal(mechanism, stated), steps, uniform, progress)


def _ideal(mechanism: Mechanism, values: Values) -> Values:
    """The values without errors."""
    if hasattr(mechanism, "ideal_parameters"):
        return cast(Values, mechanism.ideal_parameters())
    return {path: 0.0 if path.endswith((".misalignment.tilt", ".misalignment.offset")) else value
            for path, value in values.items()}  # fmt: skip


def assembled(
    mechanism: Mechanism,
    values: Values,
    ideal: Values,
    steps: int = 72,
    uniform: Uniform = "pins",
    progress: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """What `assemble` does, with the numbers as built and those without errors given."""
    check_steps(steps)
    system = build(mechanism)
    cycle = system.cycle(ideal)
    time = cycle.times(steps if cycle.duration > 0 else 1)
    if not any(module.redundant for module in system.plan.modules):
        result = _regular(system, values, cycle, time)
    else:
        study = Study.of(cast(SpatialSystem, system), values, ideal, cycle, uniform)
        result = study.result(time)
    if progress:
        progress(len(time))
    return _dataset(system, values, time, result)


@dataclass
class Result:
    """Arrays by the names of FIGURES, findings, and what the whole cycle comes to: (value, time) of the largest need."""

    arrays: dict[str, NDArray[Any]]
    findings: list[Finding] = field(default_factory=list)
    share: tuple[float, float] = (0.0, 0.0)
    clearance: tuple[float, float] = (0.0, 0.0)
    of: str = ""


def _blank(system: System, time: Array) -> dict[str, NDArray[Any]]:
    sizes = {"driver": len(system.mechanism.drivers), **{dim: len(one) for dim, one in _labels(system).items()}}
    arrays: dict[str, NDArray[Any]] = {
        name: np.full((*(sizes[dim] for dim in one.dims), len(time)), np.nan) for name, one in FIGURES.items()
    }
    arrays["status"] = np.zeros(len(time), np.int8)
    for name in ("stated_part", "uniform_part"):
        arrays[name][:] = 0.0
    return arrays


def _labels(system: System) -> dict[str, list[str]]:
    return {"joint": list(system.joints), "end": ["1", "2", "3", "4"], "axis": ["x", "y", "z"]}


# ---- no more constraints than freedoms ------------------------------------------------------------------------


def _regular(system: System, values: Values, cycle: Cycle, time: Array) -> Result:
    """Every loop has as many equations as coordinates: it closes as it is, or not at all."""
    chosen = choose(system, values, cycle)
    walk = forward(system, values, chosen.assembly, time)
    there = np.ones(len(time), bool)
    for pose in walk.poses:
        for frame in pose.frames:
            there &= np.isfinite(sum(primal(number) for number in flat(frame)))
    arrays = _blank(system, time)
    for name in ("needed_share", "needed_clearance", "open_angle", "open_length", "certificate", "closure_residual"):
        arrays[name] = np.where(there, 0.0, np.nan)
    arrays["status"] = np.where(there, Fit.FITS, Fit.APART).astype(np.int8)
    plane = "in the plane no joint constrains twice" if system.mechanism.space == "planar" else ""
    what = plane or "its joints constrain no more than its links have freedoms"
    said = Finding(f"{what}: errors shift its links, and it needs no clearance", "joints", severity=Severity.NOTE)
    return Result(arrays, [*chosen.findings, said, *_apart(system, values, time, arrays)])


def _apart(system: System, values: Values, time: Array, arrays: Mapping[str, NDArray[Any]]) -> list[Finding]:
    places = np.flatnonzero(arrays["status"] == Fit.APART)
    if not len(places):
        return []
    where = system.dial(values, time).intervals(places)
    return [Finding(f"{Fit.APART.text} {where}", "links", "check the lengths, or limit the range of the driver")]


# ---- more constraints than freedoms ---------------------------------------------------------------------------


@dataclass(frozen=True)
class Study:
    """An over-constrained mechanism with its errors, the plays that it states, and those of the smallest clearance.

    evened: for each end of `pins`, whether its play is the clearance that is looked for; the others stay.
    """

    system: SpatialSystem
    values: Values
    cycle: Cycle
    start: Start
    stated: tuple[End, ...]
    pins: tuple[End, ...]
    evened: tuple[bool, ...]
    findings: tuple[Finding, ...]

    @classmethod
    def of(cls, system: SpatialSystem, values: Values, ideal: Values, cycle: Cycle, uniform: Uniform) -> Study:
        stated = tuple(ends_of(system, values, every_pin=False))
        every = not any(end.pin for end in stated) and not (uniform == "all" and stated)
        pins = tuple(ends_of(system, values, every_pin=every))
        _check_lengths(system, values, pins)
        evened = tuple(end.pin or uniform == "all" for end in pins)
        start, findings = start_of(system, values, ideal, cycle)
        return cls(system, values, cycle, start, stated, pins, evened, tuple(findings))

    def solve(self, time: Array, stated: bool) -> Found:
        """The least share of the stated plays, or the smallest clearance, at times."""
        ends = self.stated if stated else self.pins
        radii = np.array([end.radius for end in ends])
        evened = np.array(self.evened, float)
        base, share = (np.zeros(len(ends)), radii) if stated else (radii * (1 - evened), evened)
        ask = Ask(base, share, tuple(len(end.axes) for end in ends))
        loops, none = Loops.of(self.system, self.values, ends, time), np.zeros((len(time), sum(ask.widths)))
        with np.errstate(all="ignore"):
            q, gap = loops.least_open(self.start(time), none)
            if not ends:
                least = np.where(np.isnan(gap), np.nan, np.where(gap <= CLOSED, 0.0, np.inf))
                return Found(least, least, q, none, none, gap, 0)
            found = least_play(loops, q, none, ask)
        fits = gap <= CLOSED  # as it is: what is found beside it is rounding
        found.least[fits], found.bound[fits], found.offsets[fits], found.weights[fits] = 0.0, 0.0, 0.0, 0.0
        return found

    def result(self, time: Array) -> Result:
        """The whole answer."""
        arrays = _blank(self.system, time)
        q = self.start(time)
        there = np.isfinite(q).all(axis=1)
        arrays["open_angle"], arrays["open_length"] = self._open(time, q)
        shares, needs = self.solve(time, stated=True), self.solve(time, stated=False)
        for found, ends, name in ((shares, self.stated, "stated"), (needs, self.pins, "uniform")):
            self._place(found, ends, arrays[f"{name}_offset"], arrays[f"{name}_part"])
        arrays["needed_share"], arrays["needed_clearance"] = shares.least, needs.least
        arrays["closure_residual"] = _worst(shares, needs, lambda one: one.opening)
        arrays["certificate"] = _worst(
            shares, needs, lambda one: (one.least - one.bound) / np.where(one.least > 0, one.least, 1.0)
        )
        share = shares.least
        status = np.where(np.isinf(share), Fit.RIGID, np.where(share > ENOUGH, Fit.SHORT, Fit.FITS))
        status = np.where(np.isnan(share) | np.isnan(needs.least), Fit.UNSETTLED, status)
        arrays["status"] = np.where(there, status, Fit.APART).astype(np.int8)
        result = Result(arrays, list(self.findings), of=_names(self.pins, self.evened))
        result.share = self._largest(time, share, stated=True)
        result.clearance = self._largest(time, needs.least, stated=False)
        result.findings += _told(self, time, result)
        return result

    def _open(self, time: Array, q: Array) -> tuple[Array, Array]:
        """How far the loops are open, in angle, rad, and in length, m, where they are open least without play."""
        loops, none = Loops.of(self.system, self.values, (), time), np.zeros((len(time), 0))
        q, _ = loops.least_open(q, none)
        with np.errstate(all="ignore"):
            rows = loops.linear(q, none).gap[:, : 6 * len(loops.group.chords)].reshape(len(time), -1, 2, 3)
        sizes = np.max(np.linalg.norm(rows, axis=-1), axis=1)
        return sizes[:, 0], sizes[:, 1] * loops.size

    def _place(self, found: Found, ends: Sequence[End], offsets: Array, parts: Array) -> None:
        """Offsets and parts of the ends at their places in the result."""
        labels, column = _labels(self.system), 0
        solved = np.isfinite(found.least)
        for k, end in enumerate(ends):
            joint = labels["joint"].index(end.joint)
            parts[joint, end.number] = np.where(solved, found.weights[:, k], np.nan)
            for axis in end.axes:
                row = offsets[joint, end.number, "xyz".index(axis)]
                row[:] = np.where(solved, found.offsets[:, column], np.nan)
                column += 1

    def _largest(self, time: Array, needs: Array, stated: bool) -> tuple[float, float]:
        """The largest need of the cycle and its time: between the positions too, beside the largest of them."""
        known = np.where(np.isfinite(needs), needs, -np.inf)
        if not np.all(np.isfinite(needs)) or len(time) < 3 or np.max(known) <= 0:
            place = int(np.argmax(np.where(np.isnan(needs), -np.inf, needs)))
            return float(np.max(needs)), float(time[place])
        before, after = np.roll(known, 1), np.roll(known, -1)
        tops = np.flatnonzero((known >= before) & (known >= after) & (known >= CLOSE * np.max(known)))
        tops = tops[np.argsort(-known[tops], kind="stable")][:4]
        reach = float(time[1] - time[0])
        best, most = time[tops], known[tops]
        for _ in range(NARROWED):
            near = best[:, None] + reach * np.linspace(-1, 1, BETWEEN)
            near = near if self.cycle.periodic else np.clip(near, 0.0, self.cycle.duration)
            found = np.nan_to_num(self.solve(near.ravel(), stated).least.reshape(near.shape), nan=-np.inf)
            place = np.argmax(found, axis=1)[:, None]
            better = np.take_along_axis(found, place, 1)[:, 0]
            best = np.where(better > most, np.take_along_axis(near, place, 1)[:, 0], best)
            most, reach = np.maximum(most, better), reach / 4
        top = int(np.argmax(most))
        return float(most[top]), float(best[top])


def _worst(one: Found, other: Found, of: Callable[[Found], Array]) -> Array:
    """The larger of a number of two searches, of those that have an answer."""
    with np.errstate(invalid="ignore"):
        rows = [np.where(np.isfinite(found.least), of(found), -np.inf) for found in (one, other)]
    most = np.maximum(*rows)
    return np.where(np.isfinite(most), most, np.nan)


def _check_lengths(system: SpatialSystem, values: Values, ends: Sequence[End]) -> None:
    """MechanismError for every play that has no length over which a pin or guide could lean."""
    findings = []
    for name in dict.fromkeys(end.joint for end in ends):
        model = CLEARANCE_MODELS["spatial"][system.joints[name][0]]
        if model.size and not np.all(primal(shifts.length_of(model, values, name)) > 0):
            part, keys = model.size
            what = f"how far a {part} can lean in its play depends on its length, which is not stated"
            findings.append(Finding(what, f"joints.{name}.{part}", f"state {' or '.join(keys)}: 20 mm"))
    if findings:
        raise MechanismError(findings)


def _names(pins: Sequence[End], evened: Sequence[bool]) -> str:
    return ", ".join(dict.fromkeys(end.joint for end, even in zip(pins, evened, strict=True) if even))


# ---- what there is to say -------------------------------------------------------------------------------------


def _told(study: Study, time: Array, result: Result) -> list[Finding]:
    """Where the clearances suffice and where not, and what would."""
    arrays, system, values = result.arrays, study.system, study.values
    status, dial = arrays["status"], system.dial(values, time)
    told = _apart(system, values, time, arrays)
    enough = _remedy(study, result)
    (share, at), short = result.share, np.flatnonzero(status == Fit.SHORT)
    if len(short):
        what = f"the stated clearances do not close the loops {dial.intervals(short)}"
        told.append(Finding(f"{what}: at {_say(study, at)} it takes {share:.4g} times as much", "joints", enough))
    elif np.isfinite(share) and share > ENOUGH:
        what = f"the stated clearances do not close the loops near {_say(study, at)}: it takes {share:.6g} times as much"
        told.append(Finding(what, "joints", enough))
    rigid = np.flatnonzero(status == Fit.RIGID)
    if len(rigid):
        angle, length = (float(np.nanmax(arrays[name])) for name in ("open_angle", "open_length"))
        open_ = f"the loops stay open by up to {1e3 * length:.4g} mm and {np.degrees(angle):.4g}°"
        none = "no play is stated" if not study.stated else "the stated play cannot close it, however large"
        told.append(Finding(f"{none}: {open_} {dial.intervals(rigid)}", "joints", enough))
    unsettled = np.flatnonzero(status == Fit.UNSETTLED)
    if len(unsettled):
        what = f"{Fit.UNSETTLED.text} {dial.intervals(unsettled)}"
        remedy = "pins that share an axis hold each other along it: give them an end float, or let one be cylindrical"
        told.append(Finding(what, "joints", remedy))
    if not told and share > 0:
        what = f"the stated clearances take up the errors; {share:.4g} of them is needed, at {_say(study, at)}"
        told.append(Finding(what, "joints", severity=Severity.NOTE))
    return told


def _remedy(study: Study, result: Result) -> str:
    need, at = result.clearance
    if not np.isfinite(need):
        return "give pins a clearance, and an end float to those that are held along their axis; or mend the axes"
    alike = "the pins " if all(end.pin for end, even in zip(study.pins, study.evened, strict=True) if even) else ""
    return f"the smallest radial clearance, the same in {alike}{result.of}, is {_length(need)}, needed at {_say(study, at)}"


def _length(value: float) -> str:
    return f"{1e3 * value:.5g} mm" if value >= 1e-4 else f"{1e6 * value:.5g} um"


def _say(study: Study, time: float) -> str:
    dial = study.system.dial(study.values, np.array([time]))
    return f"{dial.at(0)} of {dial.of}" if dial.of else dial.at(0)


def _summary(system: System, result: Result, at: Callable[[float], str]) -> list[dict[str, Any]]:
    """The figures one looks at first."""
    (share, share_at), (need, need_at) = result.share, result.clearance
    rows: list[dict[str, Any]] = [{"label": "positions", "value": float(len(result.arrays["status"])), "unit": "1"}]
    if not result.of:
        return [*rows, {"label": "smallest clearance", "value": 0.0, "unit": "mm"}]
    angle, length = (float(np.nanmax(result.arrays[name], initial=0.0)) for name in ("open_angle", "open_length"))
    rows.append({"label": "loops open without play, angle", "value": float(np.degrees(angle)), "unit": "deg"})
    rows.append({"label": "loops open without play, length", "value": 1e3 * length, "unit": "mm"})
    stated = "none closes it" if np.isinf(share) else share if np.isfinite(share) else None
    rows.append({"label": "needed share of the stated clearances", "value": stated, "unit": "1"})
    if np.isfinite(share) and share > 0:
        rows.append({"label": "  at", "value": at(share_at), "unit": ""})
    rows.append({"label": f"smallest clearance, the same in {result.of}",
                 "value": 1e3 * need if np.isfinite(need) else None, "unit": "mm"})  # fmt: skip
    if np.isfinite(need) and need > 0:
        rows.append({"label": "  at", "value": at(need_at), "unit": ""})
        place = int(np.nanargmax(result.arrays["needed_clearance"]))
        parts = result.arrays["uniform_part"][:, :, place].sum(axis=1)
        carried = sorted(zip(parts, system.joints, strict=True), reverse=True)
        text = ", ".join(f"{name} {100 * part:.0f} %" for part, name in carried if part > TOLD)
        rows.append({"label": "  part of each joint's clearance", "value": text, "unit": ""})
    return rows


def _dataset(system: System, values: Values, time: Array, result: Result) -> xr.Dataset:
    import xarray as xr

    mechanism = system.mechanism
    for i, driver in enumerate(mechanism.drivers):
        result.arrays["drive_coordinate"][i] = primal(system.drive(values, driver, time)[0])

    def at(moment: float) -> str:
        dial = system.dial(values, np.array([moment]))
        return f"{dial.at(0)} of {dial.of}" if dial.of else dial.at(0)

    variables = {
        name: xr.Variable((*one.dims, "position"), result.arrays[name], {"units": one.units, "long_name": one.long_name})
        for name, one in FIGURES.items()
    }
    labels = {"driver": list(mechanism.drivers), **_labels(system)}
    coordinates: dict[str, Any] = {dim: (dim, np.asarray(names, dtype=str)) for dim, names in labels.items()}
    coordinates["time"] = ("position", time, {"units": "s", "long_name": "time"})
    units = ["rad" if system.turns(name) else "m" for name in mechanism.drivers]
    attributes: dict[str, Any] = {
        "name": mechanism.name,
        "formula": system.plan.formula,
        "assembling": result.of,
        "smallest_clearance": result.clearance[0],
        "needed_share": result.share[0],
        "summary": json.dumps(_summary(system, result, at), ensure_ascii=False),
        "findings": json.dumps([finding_row(one) for one in result.findings], ensure_ascii=False),
        "coordinate_units": json.dumps(units),
        "periodic": int(system.cycle(values).periodic),
        "model_hash": mechanism.digest,
        "trunnion_version": __version__,
        "references": "\n".join([SOURCE, *mechanism.references]),
        "flag_values": " ".join(str(int(code)) for code in Fit),
        "flag_meanings": " ".join(code.name.lower() for code in Fit),
    }
    return xr.Dataset(variables, coordinates, attributes)
