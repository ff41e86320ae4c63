"""Whether a mechanism whose joints constrain more than its links have freedoms can be put together as it is built.

Its loops close only if the axes fit exactly. Where they do not, pins lie in their holes as the closure asks: of the
offsets of their ends the smallest are looked for that close every loop, position by position (`solve.space.loops`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import flat
from trunnion.cycle.positions import check_steps
from trunnion.cycle.summary import inputs, member_units
from trunnion.errors import Coded, Finding, MechanismError
from trunnion.joints.clearance import CLEARANCE_MODELS
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import Figure, cited, finding_rows, origin
from trunnion.results.dataset import EVERYWHERE, Scales, Variable, dataset_of, described, driven
from trunnion.solve import shifts
from trunnion.solve.assembly import choose
from trunnion.solve.forward import forward
from trunnion.solve.run import built
from trunnion.solve.space.loops import CLOSED, Ask, End, LeastPlay, Loops, ends_of, least_play, start_of
from trunnion.solve.system import Cycle, System, Values

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Uniform = Literal["pins", "all"]
ROUNDING = 1e-9  # rad, or of the size: an opening below it beside a larger one of the other kind is none
CLOSE = 0.9  # of the largest need: maxima between the positions are looked for beside those above it
MOST_TOPS = 4
BETWEEN, NARROWED = 9, 5  # points in the interval around a maximum, and how often it is narrowed to a quarter
ENOUGH = 1 + 1e-9  # of the stated clearances: all of it is enough
SAME = 1e-6  # of a need: one that varies by less has no place
LEAST_PART = 0.05  # a joint's part in the need that is worth a word
SOURCE = (
    "P. J. Goulart and Y. Chen, Clarabel: an interior-point solver for conic programs with quadratic objectives, "
    "arXiv:2405.12762"
)


class AssemblyStatus(Coded):
    """What a position came to."""

    FITS = 0, "it can be assembled"
    SHORT = 1, "the stated clearances do not suffice"
    RIGID = 2, "no play is stated that could close the loops, however large"
    UNSETTLED = 3, "the least clearance was not found"
    APART = 4, "it cannot be assembled, with or without errors"


LANES = ("position",)
OFFSETS = ("joint", "end", "axis", "position")
PARTS = ("joint", "end", "position")
FIGURES: dict[str, Variable] = {
    "smallest_clearance": Variable((), "m", "the largest needed clearance of the cycle, between the positions too"),
    "largest_share": Variable((), "1", "the largest needed share of the cycle, between the positions too"),
    "drive_coordinate": Variable(("driver", "position"), "coordinate", "coordinate of the driver"),
    "needed_share": Variable(
        LANES, "1", "share of the stated clearances that is needed to close the loops; above 1: too small"
    ),
    "needed_clearance": Variable(LANES, "m", "smallest radial clearance, the same in every pin, that closes the loops"),
    "open_angle": Variable(LANES, "rad", "opening of the loops without play, angle"),
    "open_length": Variable(LANES, "m", "opening of the loops without play, length"),
    "stated_offset": Variable(OFFSETS, "m", "offset of the pin's end at the needed share, in the hole's frame"),
    "uniform_offset": Variable(OFFSETS, "m", "offset of the pin's end at the needed clearance, in the hole's frame"),
    "stated_part": Variable(PARTS, "1", "share of an end's play in the needed share; the sum is 1"),
    "uniform_part": Variable(PARTS, "1", "share of an end's play in the needed clearance; the sum is 1"),
    "closure_residual": Variable(LANES, "1", "largest exact opening of a loop at these offsets, rad or of the size"),
    "certificate": Variable(LANES, "1", "relative gap between the needed share and its proven lower bound"),
    "status": Variable(LANES, "1", "status code of the position; see the attribute flag_meanings", np.int8),
}


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def assemble(
    mechanism: Mechanism,
    steps: int = 360,
    uniform: Uniform = "pins",
    progress: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """Whether the stated clearances take up the errors of a mechanism, and the smallest clearance that would.

    Parameters
    ----------
    steps
        Equally spaced positions of the cycle.
    uniform
        What has one and the same clearance where the smallest is looked for: all pins with a play (all pins, if no
        play is stated), other plays as stated; or "all" kinds of play.
    progress
        Called with the number of positions done.

    Returns
    -------
    Dataset
        The variables of `FIGURES`; `smallest_clearance` (m) is the largest need of the whole cycle, between the
        positions too. `status`: see `AssemblyStatus`.

    Raises
    ------
    MechanismError
        For a play without a length, or a structure that leaves a freedom undetermined.
    """
    check_steps(steps)
    system, values = built(mechanism), mechanism.parameters()
    cycle = system.cycle(values)
    time = cycle.times(steps if cycle.duration > 0 else 1)
    study = AssemblyStudy(system, values, cycle, time)
    if any(module.redundant for module in system.plan.modules):
        study.search(mechanism.ideal_parameters(), uniform)
    else:
        study.regular()
    if progress:
        progress(len(time))
    return study.dataset()


@dataclass
class AssemblyStudy:
    """A mechanism with its errors, and what is found at times, s: `arrays` by the names of FIGURES.

    stated: ends of the plays that it states; pins: those of the smallest clearance, of which it is that of those that
    are `evened`, while the others stay; share, clearance: the largest needs of the cycle, each with its time.
    """

    system: System
    values: Values
    cycle: Cycle
    time: Array

    def __post_init__(self) -> None:
        self.stated, self.pins = tuple[End, ...](), tuple[End, ...]()
        self.evened, self.notes = tuple[bool, ...](), list[Finding]()
        self.share = self.clearance = 0.0, 0.0
        self.labels = {
            "driver": list(self.system.mechanism.drivers),
            "joint": list(self.system.joints),
            "end": ["1", "2", "3", "4"],
            "axis": ["x", "y", "z"],
        }
        sizes = {"position": len(self.time), **{dim: len(names) for dim, names in self.labels.items()}}
        self.arrays: dict[str, NDArray[Any]] = {
            name: np.full([sizes[dim] for dim in variable.dims], 0.0 if variable.dims == PARTS else np.nan)
            for name, variable in FIGURES.items()
        }
        self.arrays["smallest_clearance"], self.arrays["largest_share"] = np.zeros(()), np.zeros(())
        for i, driver in enumerate(self.system.mechanism.drivers):
            self.arrays["drive_coordinate"][i] = primal(self.system.drive(self.values, driver, self.time)[0])

    @property
    def of(self) -> str:
        """Joints whose clearance is looked for."""
        even = (end.joint for end, evened in zip(self.pins, self.evened, strict=True) if evened)
        return ", ".join(dict.fromkeys(even))

    # ---- the search -------------------------------------------------------------------------------------------

    def regular(self) -> None:
        """Every loop has as many equations as coordinates: it closes as it is, or not at all."""
        chosen = choose(self.system, self.values, self.cycle)
        poses = forward(self.system, self.values, chosen.assembly, self.time).poses
        numbers = [primal(number) for pose in poses for frame in pose.frames for number in flat(frame)]
        closes = np.isfinite(np.zeros(len(self.time)) + sum(numbers))
        for name in (name for name, variable in FIGURES.items() if variable.dims == LANES):
            self.arrays[name] = np.where(closes, 0.0, np.nan)
        self.arrays["status"] = np.where(closes, AssemblyStatus.FITS, AssemblyStatus.APART).astype(np.int8)
        plane = "in the plane no joint constrains twice" if self.system.mechanism.space == "planar" else ""
        why = plane or "its joints constrain no more than its links have freedoms"
        what = f"{why}: errors only shift its links, so it needs no clearance"
        self.notes += [*chosen.findings, Finding.note("assembly.no_need", "joints", what)]

    def search(self, ideal: Values, uniform: Uniform) -> None:
        """Find needs, openings, offsets and statuses, and the largest needs of the cycle. ideal: numbers without
        errors."""
        system, values, time, arrays = self.system, self.values, self.time, self.arrays
        self.stated = tuple(ends_of(system, values, every_pin=False))
        every = not any(end.pin for end in self.stated) and not (uniform == "all" and self.stated)
        self.pins = tuple(ends_of(system, values, every_pin=every))
        self.evened = tuple(end.pin or uniform == "all" for end in self.pins)
        self.start, findings = start_of(system, values, ideal, self.cycle)
        self.notes += findings
        # how far the loops are open where they are so least without play, in angle and in length
        loops, none = Loops.of(system, values, (), time), np.zeros((len(time), 0))
        q, gap = loops.least_open(self.start(time), none)
        rows = loops.linear(q, none).gap[:, : 6 * len(loops.group.chords)].reshape(len(time), -1, 2, 3)
        exists, opened = np.isfinite(gap), gap > CLOSED
        rows = np.where((gap <= CLOSED)[:, None, None, None], 0.0, rows)  # rounding
        sizes = np.max(np.linalg.norm(rows, axis=-1), axis=1)
        sizes[(sizes < ROUNDING) & (sizes < np.max(sizes, axis=1, keepdims=True))] = 0.0
        arrays["open_angle"], arrays["open_length"] = sizes[:, 0], sizes[:, 1] * loops.size
        zero, count = np.where(exists, 0.0, np.nan), len(time)
        shares, needs = (  # as they are where the loops close without any play
            LeastPlay(zero, zero, zero, np.zeros((count, width)), np.zeros((count, len(ends))), zero, 0)
            for ends in (self.stated, self.pins)
            for width in [sum(len(end.axes) for end in ends)]
        )
        if np.any(opened):
            findings = []
            for name in dict.fromkeys(end.joint for end in self.pins):
                model = CLEARANCE_MODELS["spatial"][system.joints[name].type]
                if model.size and not np.all(primal(shifts.length_of(model, values, name)) > 0):
                    part, keys = model.size
                    what = f"how far the {part} can lean in its play depends on its length, which is not stated"
                    findings.append(Finding(what, f"joints.{name}.{part}", f"state {' or '.join(keys)}: 20 mm"))
            if findings:
                raise MechanismError(findings)
            shares, needs = self.solve(time, stated=True), self.solve(time, stated=False)

        def larger(of: Callable[[LeastPlay], Array]) -> Array:
            """The larger of a number of both searches, of those that have an answer."""
            rows = [np.where(np.isfinite(search.least), of(search), -np.inf) for search in (shares, needs)]
            most = np.maximum(*rows)
            return np.where(np.isfinite(most), most, np.nan)

        arrays["closure_residual"] = larger(lambda search: search.opening)
        arrays["certificate"] = larger(
            lambda search: (search.least - search.bound) / np.where(search.least > 0, search.least, 1.0)
        )
        arrays["needed_share"], arrays["needed_clearance"] = shares.least, needs.least
        self._place(shares, self.stated, arrays["stated_offset"], arrays["stated_part"])
        self._place(needs, self.pins, arrays["uniform_offset"], arrays["uniform_part"])
        status = np.where(
            np.isinf(shares.least),
            AssemblyStatus.RIGID,
            np.where(shares.least > ENOUGH, AssemblyStatus.SHORT, AssemblyStatus.FITS),
        )
        status = np.where(np.isnan(shares.least) | np.isnan(needs.least), AssemblyStatus.UNSETTLED, status)
        arrays["status"] = np.where(exists, status, AssemblyStatus.APART).astype(np.int8)
        if np.any(opened):
            self.share, self.clearance = (self._largest(of.least, of is shares) for of in (shares, needs))
        arrays["largest_share"], arrays["smallest_clearance"] = np.array(self.share[0]), np.array(self.clearance[0])

    def solve(self, time: Array, stated: bool) -> LeastPlay:
        """The least share of the stated plays, or the smallest clearance, at times; ∞ where no play is there."""
        ends = self.stated if stated else self.pins
        radii = np.array([end.radius for end in ends])
        evened = np.array(self.evened, float)
        base, share = (np.zeros(len(ends)), radii) if stated else (radii * (1 - evened), evened)
        ask = Ask(base, share, tuple(len(end.axes) for end in ends))
        loops, none = Loops.of(self.system, self.values, ends, time), np.zeros((len(time), sum(ask.widths)))
        q, gap = loops.least_open(self.start(time), none)
        fits = gap <= CLOSED
        if not ends or np.all(fits | np.isnan(gap)):
            least = np.where(np.isnan(gap), np.nan, np.where(fits, 0.0, np.inf))
            return LeastPlay(least, least, q, none, np.zeros((len(time), len(ends))), gap, 0)
        least_plays = least_play(loops, q, none, ask)
        # what is found where it closes as it is is rounding
        for array in (least_plays.least, least_plays.bound, least_plays.offsets, least_plays.weights):
            array[fits] = 0.0
        return least_plays

    def _place(self, search: LeastPlay, ends: Sequence[End], offsets: Array, parts: Array) -> None:
        """Offsets and parts of the ends at their places in the result."""
        joints, column = list(self.system.joints), 0
        solved = np.isfinite(search.least)
        for k, end in enumerate(ends):
            joint = joints.index(end.joint)
            parts[joint, end.number] = np.where(solved, search.weights[:, k], np.nan)
            for axis in end.axes:
                offsets[joint, end.number, "xyz".index(axis)] = np.where(solved, search.offsets[:, column], np.nan)
                column += 1

    def _largest(self, needs: Array, stated: bool) -> tuple[float, float]:
        """The largest need of the cycle and its time: between the positions too, beside the largest of them."""
        time = self.time
        heights = np.where(np.isnan(needs), -np.inf, needs)
        top = int(np.argmax(heights))
        if not np.all(np.isfinite(needs)) or len(time) < 3 or not heights[top] > 0:
            return float(needs[top]) if np.all(~np.isnan(needs)) else float("nan"), float(time[top])
        high = (heights >= np.roll(heights, 1)) & (heights >= np.roll(heights, -1)) & (heights >= CLOSE * heights[top])
        tops = np.flatnonzero(high)
        tops = tops[np.argsort(-heights[tops], kind="stable")][:MOST_TOPS]
        best, most, reach = time[tops], heights[tops], float(time[1] - time[0])
        for _ in range(NARROWED):
            near = best[:, None] + reach * np.linspace(-1, 1, BETWEEN)
            near = near if self.cycle.periodic else np.clip(near, 0.0, self.cycle.duration)
            heights_near = np.nan_to_num(self.solve(near.ravel(), stated).least.reshape(near.shape), nan=-np.inf)
            place = np.argmax(heights_near, axis=1)[:, None]
            better = np.take_along_axis(heights_near, place, 1)[:, 0]
            best = np.where(better > most, np.take_along_axis(near, place, 1)[:, 0], best)
            most, reach = np.maximum(most, better), reach / 4
        top = int(np.argmax(most))
        return float(most[top]), float(best[top])

    # ---- the answer ---------------------------------------------------------------------------------------------

    def at(self, status: AssemblyStatus) -> str:
        """The positions that came to a status, in words; empty if none did."""
        places = np.flatnonzero(self.arrays["status"] == status)
        return self.system.dial(self.values, self.time).intervals(places) if len(places) else ""

    def place(self, name: str) -> str:
        """Where the largest need of a name is, in words: everywhere, if it is one number at all positions."""
        (need, time), needs = self.share if name == "needed_share" else self.clearance, self.arrays[name]
        if len(needs) > 1 and bool(np.all(np.isfinite(needs))) and need - float(np.min(needs)) <= SAME * need:
            return EVERYWHERE
        dial = self.system.dial(self.values, np.array([time]))
        return f"at {dial.at(0)} of {dial.of}" if dial.of else f"at {dial.at(0)}"

    def findings(self) -> Iterator[Finding]:
        """Where the clearances suffice and where not, and what would."""
        yield from self.notes
        share, need = self.share[0], self.clearance[0]
        place, digits = self.place("needed_share"), 4 if abs(share - 1) > 1e-3 else 10  # so many tell it from 1
        times = f"{share:.{digits}g} times their size is needed"
        faults, figures = list[Finding](), {"share": share, "clearance": need}
        if at := self.at(AssemblyStatus.APART):
            remedy = "check the lengths, or limit the range of the driver"
            faults.append(
                Finding.error("assembly.apart", "links", f"{AssemblyStatus.APART.text} {at}", remedy, **figures)
            )
        short = self.at(AssemblyStatus.SHORT)
        if short or (np.isfinite(share) and share > ENOUGH):  # or only between the positions
            within = f"{short}: " if short else ""
            what = f"the stated clearances are too small to close the loops {within}{place} {times}"
            faults.append(Finding.error("assembly.clearance_short", "joints", what, self._remedy(), **figures))
        if at := self.at(AssemblyStatus.RIGID):
            angle, length = (float(np.nanmax(self.arrays[name])) for name in ("open_angle", "open_length"))
            sizes = [f"{1e3 * length:.4g} mm"] * (length > 0) + [f"{np.degrees(angle):.4g}°"] * (angle > 0)
            which = "the joints with play cannot close the loops, however large the play (a clearance of 0 gives none)"
            which = which if self.stated else "no play is stated (a clearance of 0 gives none)"
            what = f"{which}: the loops stay open by up to {' and '.join(sizes)} {at}"
            faults.append(Finding.error("assembly.no_play", "joints", what, self._remedy(), **figures))
        if at := self.at(AssemblyStatus.UNSETTLED):
            remedy = "pins on a common axis block each other along it: give one an end float, or make it cylindrical"
            what = f"{AssemblyStatus.UNSETTLED.text} {at}"
            faults.append(Finding.error("assembly.unsettled", "joints", what, remedy, **figures))
        yield from faults
        if not faults and self.of:
            what = "the loops close without any clearance"
            what = f"the stated clearances are sufficient: {times}, {place}" if share > 0 else what
            yield Finding.note("assembly.fits", "joints", what, share=share)

    def _remedy(self) -> str:
        need = self.clearance[0]
        if not np.isfinite(need):
            return "state a clearance of pins, an end float of pins without axial freedom, or correct the axes"
        size = f"{_enough(1e3 * need)} mm" if need >= 1e-4 else f"{_enough(1e6 * need)} um"
        every = all(end.pin for end, evened in zip(self.pins, self.evened, strict=True) if evened)
        pins, place = "the pins " if every else "", self.place("needed_clearance")
        return f"the smallest radial clearance, the same in {pins}{self.of}, is {size}, needed {place}"

    def summary(self) -> list[Figure]:
        """The figures one looks at first."""
        share, need = self.share[0], self.clearance[0]
        if not self.of:
            return [Figure("smallest_clearance", "smallest clearance that is needed", 0.0, "mm")]
        angle, length = (float(np.nanmax(self.arrays[name], initial=0.0)) for name in ("open_angle", "open_length"))
        figures = [
            Figure("open_angle", "opening of the loops without play, angle", np.degrees(angle), "deg"),
            Figure("open_length", "opening of the loops without play, length", 1e3 * length, "mm"),
        ]
        if angle > 0 or length > 0:
            figures = [figure for figure, size in zip(figures, (angle, length), strict=True) if size > 0]
        if self.stated:
            needed = f"{share:.10g}" if f"{share:.6g}" == "1" else "∞" if np.isinf(share) else share
            figures.append(Figure("largest_share", "needed share of the stated clearances", needed))
            if 0 < share < np.inf:
                figures.append(
                    Figure("largest_share.place", "  at", self.place("needed_share").removeprefix("at "), "")
                )
        subject = f"smallest clearance, the same in {self.of}"
        figures.append(Figure("smallest_clearance", subject, 1e3 * need, "mm"))
        if 0 < need < np.inf:
            largest = int(np.nanargmax(self.arrays["needed_clearance"]))
            parts = self.arrays["uniform_part"][:, :, largest].sum(axis=1)
            carried = sorted(zip(parts.round(6), self.system.joints, strict=True), key=lambda each: -each[0])
            text = ", ".join(f"{name} {100 * part:.0f} %" for part, name in carried if part > LEAST_PART)
            figures.append(
                Figure("smallest_clearance.place", "  at", self.place("needed_clearance").removeprefix("at "), "")
            )
            figures.append(Figure("smallest_clearance.parts", "  share of each joint's clearance", text, ""))
        return figures

    def dataset(self) -> xr.Dataset:
        """The result with names, units and provenance."""
        system, values, mechanism = self.system, self.values, self.system.mechanism
        attributes = origin(
            mechanism,
            system.plan.formula,
            assembling=self.of,
            inputs=inputs(mechanism),
            **Scales(float(np.max(system.size(values))), 1.0, 0.0).summary(self.summary()),
            findings=finding_rows(self.findings()),
            periodic=int(system.cycle(values).periodic),
        ) | cited([SOURCE, *mechanism.references], AssemblyStatus)
        along = driven(self.time, *system.dial(values, self.time))
        along["time"].attrs["long_name"] = "time"
        variables = described({name: self.arrays[name] for name in FIGURES}, FIGURES, member_units(system))
        return dataset_of("assembly", variables, self.labels, attributes, along)


def _enough(size: float) -> str:
    """Five digits, rounded up: the number that is written suffices."""
    step = 10.0 ** (np.floor(np.log10(size)) - 4)
    return f"{np.ceil(size / step * (1 - 1e-12)) * step:.5g}" if size > 0 else "0"
