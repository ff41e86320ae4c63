"""What the page says of a model: findings in the words of the sheet, what it can be asked, what it still lacks."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import Finding, Severity, Status, counted
from trunnion.model.joint_parts import has_play
from trunnion.model.mechanism import Mechanism
from trunnion.results.variables import VARIABLES
from trunnion.solve.run import prepare
from trunnion.solve.system import rubbing
from trunnion.studio.sketch import Sketch

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["missing", "reached", "readiness", "remedied", "sentence", "spoken"]

NOUNS = {
    "links": "link", "joints": "joint", "loads": "load", "springs": "spring", "drivers": "driver", "gears": "gear pair",
    "dimensions": "dimension", "loop": "joint", "measures": "measure", "tables": "table",
}  # fmt: skip
NESTED = re.compile(r"\b([a-z_]+): \{([a-z_]+): ([^{},]*)\}")
STATED = re.compile(r"\b([a-z_]+): (?=-?\d|…)")
PATH = re.compile(r"[^\s.,]+(\.[^\s.,]+)+")
# what positions have that findings speak of
REACHED = {
    "friction.interval": Status.ZERO_SLIP, "position.near_singular": Status.NEAR_SINGULAR,
    "contact.lost": Status.CONTACT_LOST, "friction.not_converged": Status.NOT_CONVERGED,
    "friction.locked": Status.LOCKED, "load.undefined": Status.LOAD_UNDEFINED,
    "spring.undefined": Status.LOAD_UNDEFINED, "position.singular": Status.SINGULAR,
    "assembly.open": Status.NOT_ASSEMBLED,
}  # fmt: skip


# ---- in words -----------------------------------------------------------------------------------------------------


def spoken(where: str) -> str:
    """A path of the file in words, as "mass of link crank" for `links.crank.mass`; what is no path stays."""
    if not PATH.fullmatch(where):
        return where
    section, name, *inner = where.split(".")
    if section == "joint_defaults":
        return _plain([name, *inner], "all joints")
    if section not in NOUNS:
        return f"start of {'.'.join([name, *inner])}" if section == "assembly" else _plain([section, name, *inner])
    part = name if section == "dimensions" and not inner else f"{NOUNS[section]} {name}"
    if section == "links" and len(inner) > 1 and inner[0] == "points":
        part = f"point {inner[1]} of {part}"
        inner = [dict(zip("012", "xyz", strict=True)).get(key, key) for key in inner[2:] if key not in "xyz at"]
    return _plain(inner, part)


def _plain(keys: Sequence[str], part: str = "") -> str:
    return " of ".join(text for text in (" ".join(keys).replace("_", " "), part) if text)


def remedied(remedy: str) -> str:
    """A remedy without the signs of the file: "state pin radius" where it says `state pin: {radius: …}`."""
    if " --" in remedy and "trunnion " not in remedy:  # options: the page has none; whole commands stay
        remedy = re.sub(r"[,;][^,;]* --.*", "", remedy)
    if (" --" in remedy and "trunnion " not in remedy) or any("_" in name and name in remedy for name in VARIABLES):
        return ""  # it names columns of the result, or is about an option alone
    plain = STATED.sub(r"\1 ", NESTED.sub(r"\1 \2 \3", remedy))
    return plain.replace(": {…}", "").replace(" …", "")


def sentence(finding: Finding) -> str:
    """A finding as one sentence."""
    remedy = remedied(finding.remedy)
    return " ".join(part for part in (spoken(finding.where), finding.what, remedy and f"— {remedy}") if part)


def reached(finding: Finding, result: xr.Dataset) -> int | None:
    """The position at which a finding holds: of those that lock the worst, else the first."""
    places = np.flatnonzero(result["status"].values == REACHED.get(finding.code, -1))
    if not len(places):
        return None
    margins = np.nan_to_num(result["locking_margin"].values[places], nan=np.inf)
    return int(places[np.argmin(margins) if finding.code == "friction.locked" else 0])


# ---- what it can be asked -----------------------------------------------------------------------------------------


def readiness(
    mechanism: Mechanism | None, result: xr.Dataset | None, findings: Sequence[Finding], lacks: Sequence[str] = ()
) -> list[dict[str, Any]]:
    """For motion, forces, friction, play, tolerance and time: whether there is what it takes, and why.

    lacks: what is not drawn yet.
    """
    if mechanism is None or result is None:
        errors = [finding for finding in findings if finding.severity is Severity.ERROR]
        why = f"{spoken(errors[0].where)} {errors[0].what}".strip() if errors else "Draw links and drive a joint."
        answers = [(False, " ".join(lacks) or why), *[(False, "The motion comes first.")] * 5]
    else:
        answers = [_moves(mechanism, result, lacks), *_acts(mechanism)]
    subjects = ("motion", "forces", "friction", "play", "tolerance", "time")
    return [{"what": what, "ok": ok, "why": why} for what, (ok, why) in zip(subjects, answers, strict=True)]


def _moves(mechanism: Mechanism, result: xr.Dataset, lacks: Sequence[str]) -> tuple[bool, str]:
    count, able = result.sizes["position"], int(np.sum(result["status"].values < Status.SINGULAR))
    if not mechanism.drivers:
        return False, " ".join(lacks) or "No joint is driven: it stands still."
    rest = f"; the other {count - able} cannot be reached" if able < count else ""
    return able > 0, f"Moves through {able} of {counted(count, 'position')}{rest}."


def _acts(mechanism: Mechanism) -> Iterator[tuple[bool, str]]:
    numbers = mechanism.parameters()
    weighs = any(path.endswith((".mass", ".stiffness")) and bool(np.any(numbers[path])) for path in numbers)
    subjects = (
        (bool(mechanism.loads) or weighs, "Loads or masses act on it.", "Add a load, a mass or a spring."),
        (bool(rubbing(prepare(mechanism).system)), "Joints rub.",
         "State friction of a joint, and the radius of its pin."),
        (any(map(has_play, mechanism.effective_joints.values())), "Pins have play: the study shows what it does.",
         "State a clearance or fit of a pin."),
        (bool(mechanism.tolerated()), "Numbers have tolerances: the study shows what they do.",
         "Write a tolerance, such as 60 mm ± 0.05 mm."),
        (any(driver.found for driver in mechanism.drivers.values()), "A motor drives it: the study lets it run.",
         "Give a driver a motor in the text, as motor: {kind: constant, effort: 5 N m}."),
    )  # fmt: skip
    for ok, done, remedy in subjects:
        yield ok, done if ok else remedy


# ---- what it lacks ------------------------------------------------------------------------------------------------


def missing(sketch: Sketch, findings: Sequence[Finding]) -> list[str]:
    """The next step of the hand, where nothing but steps of drawing is missing; none where something is wrong."""
    errors = [one for one in findings if one.severity is Severity.ERROR]
    if not errors and sketch.joints and not sketch.of("drivers"):
        return ["It stands still: its joints let no link move. Take one away, or let an end slide."]
    unfinished = [
        error.what.startswith(("there are no", "no joint connects"))
        or (error.where == "drivers" and error.remedy.startswith("drive a joint"))
        for error in errors
    ]
    if not errors or not all(unfinished):
        return []
    return [f"{errors[0].what[:1].upper()}{errors[0].what[1:]}: {remedied(errors[0].remedy)}."]
