"""What the answer to "does it go together?" consists of, what it says, and how it is handed out."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.cycle.summary import inputs, member_units
from trunnion.errors import Coded, Finding
from trunnion.results.attributes import cited, finding_rows, origin
from trunnion.results.dataset import Variable, dataset_of, described, driven
from trunnion.results.figure import Figure
from trunnion.results.scales import EVERYWHERE, Scales
from trunnion.solve.system import System, Values

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["ENOUGH", "FIGURES", "AssemblyStatus", "Result", "labels"]

Array = NDArray[np.float64]
ENOUGH = 1 + 1e-9  # of the stated clearances: all of it is enough
SAME = 1e-6  # of a need: one that varies by less has no place
TOLD = 0.05  # a joint's part in the need that is worth telling
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


def labels(system: System) -> dict[str, list[str]]:
    """Names along the dimensions."""
    ends = {"end": ["1", "2", "3", "4"], "axis": ["x", "y", "z"]}
    return {"driver": list(system.mechanism.drivers), "joint": list(system.joints), **ends}


@dataclass
class Result:
    """What was found, at times, s: arrays by the names of FIGURES, and what there is to say.

    share, clearance: the largest needs of the cycle, each with its time; of: joints whose clearance is looked for;
    pins: whether they are pins alone; played: whether any play is stated; nil: whether a clearance of 0 is.
    """

    system: System
    values: Values
    time: Array
    arrays: dict[str, NDArray[Any]] = field(init=False)
    findings: list[Finding] = field(default_factory=list)
    share: tuple[float, float] = (0.0, 0.0)
    clearance: tuple[float, float] = (0.0, 0.0)
    of: str = ""
    pins: bool = True
    played: bool = False
    nil: bool = False

    def __post_init__(self) -> None:
        sizes = {"position": len(self.time), **{dim: len(names) for dim, names in labels(self.system).items()}}
        self.arrays = {
            name: np.full([sizes[dim] for dim in one.dims], 0.0 if one.dims == PARTS else np.nan)
            for name, one in FIGURES.items()
        }
        self.arrays["status"] = np.zeros(len(self.time), np.int8)
        for i, driver in enumerate(self.system.mechanism.drivers):
            self.arrays["drive_coordinate"][i] = primal(self.system.drive(self.values, driver, self.time)[0])

    def where(self, time: float) -> str:
        """A time in words: the drive coordinate, if there is one."""
        dial = self.system.dial(self.values, np.array([time]))
        return f"{dial.at(0)} of {dial.of}" if dial.of else dial.at(0)

    def _place(self, most: tuple[float, float], name: str) -> str:
        """Where the largest need, with its time, is among those of the positions: everywhere, if it is one number."""
        (need, time), needs = most, self.arrays[name]
        same = len(needs) > 1 and bool(np.all(np.isfinite(needs))) and need - float(np.min(needs)) <= SAME * need
        return EVERYWHERE if same else self.where(time)

    def _share_place(self) -> str:
        return _at(self._place(self.share, "needed_share"))

    def _need_place(self) -> str:
        return _at(self._place(self.clearance, "needed_clearance"))

    # ---- what there is to say -------------------------------------------------------------------------------

    def tell(self) -> None:
        """Add where the clearances suffice and where not, and what would."""
        count = len(self.findings)
        self._apart()
        self._short()
        self._rigid()
        unsettled = np.flatnonzero(self.arrays["status"] == AssemblyStatus.UNSETTLED)
        if len(unsettled):
            what = f"{AssemblyStatus.UNSETTLED.text} {self._intervals(unsettled)}"
            remedy = "pins on a common axis block each other along it: give one an end float, or make it cylindrical"
            self.findings.append(Finding.error("assembly.unsettled", "joints", what, remedy))
        if len(self.findings) > count or not self.of:
            return
        share = self.share[0]
        if share > 0:
            needed = f"{_share(share)} times their size is needed, {self._share_place()}"
            what = f"the stated clearances are sufficient: {needed}"
            self.findings.append(Finding.note("assembly.clearance_enough", "joints", what, share=share))
        else:
            what = "the loops close without any clearance"
            self.findings.append(Finding.note("assembly.fits", "joints", what))

    def _intervals(self, places: NDArray[np.intp]) -> str:
        return self.system.dial(self.values, self.time).intervals(places)

    def _apart(self) -> None:
        places = np.flatnonzero(self.arrays["status"] == AssemblyStatus.APART)
        if len(places):
            what = f"{AssemblyStatus.APART.text} {self._intervals(places)}"
            remedy = "check the lengths, or limit the range of the driver"
            self.findings.append(Finding.error("assembly.apart", "links", what, remedy))

    def _short(self) -> None:
        (share, at), short = self.share, np.flatnonzero(self.arrays["status"] == AssemblyStatus.SHORT)
        times = f"{_share(share)} times their size is needed"
        if len(short):
            place = self._share_place()
            takes = f"{times} {place}" if place == EVERYWHERE else f"{place} {times}"
            takes = f"{self._intervals(short)}: {takes}"
        elif np.isfinite(share) and share > ENOUGH:  # between the positions
            takes = f"near {self.where(at)}: {times}"
        else:
            return
        what, figures = f"the stated clearances are too small to close the loops {takes}", {"share": share}
        figures["clearance"] = self.clearance[0]
        self.findings.append(Finding.error("assembly.clearance_short", "joints", what, self._remedy(), **figures))

    def _rigid(self) -> None:
        places = np.flatnonzero(self.arrays["status"] == AssemblyStatus.RIGID)
        if not len(places):
            return
        angle, length = (float(np.nanmax(self.arrays[name])) for name in ("open_angle", "open_length"))
        sizes = [f"{1e3 * length:.4g} mm"] * (length > 0) + [f"{np.degrees(angle):.4g}°"] * (angle > 0)
        by = f"{' and '.join(sizes)} {self._intervals(places)}"
        none = "a stated clearance of 0 gives no play: the loops" if self.nil else "no play is stated: the loops"
        if self.played:
            zero = " (a clearance of 0 gives no play)" if self.nil else ""
            none = f"the joints with play cannot close the loops, however large the play{zero}: they"
        what, figures = f"{none} stay open by up to {by}", {"angle": angle, "length": length}
        figures["clearance"] = self.clearance[0]
        self.findings.append(Finding.error("assembly.no_play", "joints", what, self._remedy(), **figures))

    def _remedy(self) -> str:
        need = self.clearance[0]
        if not np.isfinite(need):
            return "state a clearance of pins, an end float of pins without axial freedom, or correct the axes"
        size = f"{_enough(1e3 * need)} mm" if need >= 1e-4 else f"{_enough(1e6 * need)} um"
        pins = "the pins " if self.pins else ""
        return f"the smallest radial clearance, the same in {pins}{self.of}, is {size}, needed {self._need_place()}"

    # ---- figures --------------------------------------------------------------------------------------------

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
        if self.played:
            # what six digits show as 1 is shown with as many as distinguish it from 1
            needed = _share(share) if f"{share:.6g}" == "1" or np.isinf(share) else share
            figures.append(Figure("largest_share", "needed share of the stated clearances", needed))
            if 0 < share < np.inf:
                figures.append(Figure("largest_share.place", "  at", self._place(self.share, "needed_share"), ""))
        subject = f"smallest clearance, the same in {self.of}"
        figures.append(Figure("smallest_clearance", subject, 1e3 * need, "mm"))
        if 0 < need < np.inf:
            at = self._place(self.clearance, "needed_clearance")
            figures.append(Figure("smallest_clearance.place", "  at", at, ""))
            figures.append(Figure("smallest_clearance.parts", "  share of each joint's clearance", self._parts(), ""))
        return figures

    def _parts(self) -> str:
        """Joints by their part in the largest need."""
        place = int(np.nanargmax(self.arrays["needed_clearance"]))
        parts = self.arrays["uniform_part"][:, :, place].sum(axis=1)
        carried = sorted(zip(parts, self.system.joints, strict=True), reverse=True)
        return ", ".join(f"{name} {100 * part:.0f} %" for part, name in carried if part > TOLD)

    def dataset(self) -> xr.Dataset:
        """The result with names, units and provenance."""
        mechanism = self.system.mechanism
        self.arrays["smallest_clearance"] = np.array(self.clearance[0])
        self.arrays["largest_share"] = np.array(self.share[0])
        attributes = origin(
            mechanism,
            self.system.plan.formula,
            assembling=self.of,
            inputs=inputs(mechanism),
            **Scales(float(np.max(self.system.size(self.values))), 1.0, 0.0).summary(self.summary()),
            findings=finding_rows(self.findings),
            periodic=int(self.system.cycle(self.values).periodic),
        ) | cited([SOURCE, *mechanism.references], AssemblyStatus)
        along = driven(self.time, *self.system.dial(self.values, self.time))
        along["time"].attrs["long_name"] = "time"
        variables = described({name: self.arrays[name] for name in FIGURES}, FIGURES, member_units(self.system))
        return dataset_of("assembly", variables, labels(self.system), attributes, along)


def _at(place: str) -> str:
    return place if place == EVERYWHERE else f"at {place}"


def _share(share: float) -> str:
    """Four digits, or as many as it takes to tell it from 1; ∞."""
    if np.isinf(share):
        return "∞"
    told = (f"{share:.{digits}g}" for digits in range(4, 11))
    return next((text for text in told if float(text) != 1), "1")


def _enough(size: float) -> str:
    """Five digits, rounded up: the number that is written suffices."""
    step = 10.0 ** (np.floor(np.log10(size)) - 4)
    return f"{np.ceil(size / step * (1 - 1e-12)) * step:.5g}" if size > 0 else "0"
