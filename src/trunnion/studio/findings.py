"""What the page says of a model: its figures and its locking margin; findings in the words of the sheet, what can be
tried against them, what the model can be asked and what it still lacks.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import Finding, Severity, Status, counted
from trunnion.measures.many import figures_of
from trunnion.measures.measures import Measure, outputs
from trunnion.model.joint_parts import has_play
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import MORE_THAN, Figure, summary_of, units_of
from trunnion.results.quantities import quantity
from trunnion.results.variables import VARIABLES
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.run import prepare
from trunnion.solve.system import felt, rubbing
from trunnion.studio.loaded import Asked, Loaded
from trunnion.studio.sketch import Sketch
from trunnion.views.axis import abscissa, names

if TYPE_CHECKING:
    import xarray as xr

MOST_RATIOS = 12  # of a longer row nobody reads them
ENOUGH = 0.9  # of the friction at which it just runs: what is tried
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


# ---- figures and margin --------------------------------------------------------------------------------------------


def figures(question: Asked) -> list[dict[str, Any]]:
    """The figures one looks at first, without those of the solution: of the result, and time ratios.

    Without friction nothing is lost: what would be an efficiency is what weights and springs give and take.

    Returns
    -------
    list
        name: by which that of another model is found; label; title: without its place; text: with its unit; value: SI,
        None where there is none, or nothing but a bound.
    """
    units = units_of(question.cycle.result)
    figures = [row for row in summary_of(question.cycle.result) if not row.numerical]
    figures = [row for row in figures if question.friction or not row.name.startswith("efficiency")]
    figures += [Figure(f"{name}.time_ratio", f"time ratio of {name}", ratio) for name, ratio in _ratios(question.state)]
    rows = []
    for row in figures:
        bound = row.aspect == MORE_THAN
        text = row.value if isinstance(row.value, str) else quantity(row.value, row.unit, units) or "—"
        rows.append({
            "name": row.name,
            "label": row.label,
            "title": ", ".join(part for part in (row.subject, "minimum" if bound else row.aspect) if part),
            "text": f"> {text}" if bound else text,
            "value": None if bound or isinstance(row.value, str) else row.value,
        })  # fmt: skip
    return rows


@lru_cache(maxsize=8)
def _ratios(state: Loaded) -> tuple[tuple[str, float], ...]:
    """Time ratios of what slides on the ground, or where nothing does of what turns back on it."""
    run = state.run
    driven = [] if run.seats or run.cycle.duration <= 0 else outputs(run.system)
    driven = [output for output in driven if output.kind == "slide"] or driven
    if len(driven) > MOST_RATIOS:
        return ()
    measures = [Measure(output.subject, "time_ratio", output.subject) for output in driven]
    ratios = figures_of(run, measures, FrictionMethod()) if measures else {}
    return tuple((joint, float(ratio)) for joint, ratio in ratios.items() if np.isfinite(ratio))


def margin_of(result: xr.Dataset, rubs: bool) -> dict[str, Any]:
    """The locking margin over the cycle, the least and where it is; where there is none, `margin_why` says why.

    It is the multiple of the friction at which a position locks: 1 and less where it locks, at most MARGIN; `beyond`:
    it is more everywhere. Positions that cannot be assembled have none, nor has a mechanism whose joints carry nothing.
    The least is the figure of the cycle where the result has that, else that of the positions.
    """
    margin = np.where(result["status"].values <= Status.LOCKED, result["locking_margin"].values, np.nan)
    reactions = np.concatenate([np.ravel(result[name].values) for name in ("reaction_force", "reaction_moment")])
    why = None
    if not rubs:
        why = "no friction"
    elif not names(result, "driver"):
        why = "no driver"
    elif np.all(np.isnan(margin)):
        why = "no position is solved"
    elif not np.any(np.nan_to_num(reactions)):
        why = "nothing loads its joints"
    if why is not None:
        return {"margin": None, "margin_least": None, "margin_why": why}
    index = int(np.flatnonzero(margin == np.nanmin(margin))[0])  # `nanargmin` takes a nan for inf
    unbounded, margins = bool(margin[index] > MARGIN), np.minimum(margin, MARGIN)
    least = {"value": float(margins[index]), "beyond": unbounded, "at": abscissa(result).say(index)}
    figure = next((row for row in summary_of(result) if row.name == "locking_margin" and row.value is not None), None)
    if figure is not None and figure.aspect != MORE_THAN:
        least = {"value": figure.value, "beyond": False, "at": figure.place.removeprefix("at ")}
    return {"margin": margins, "margin_least": least, "margin_why": None}


# ---- in words -----------------------------------------------------------------------------------------------------


def spoken(where: str) -> str:
    """A path of the file in words, as "mass of link crank" for `links.crank.mass`; what is no path stays."""
    if not PATH.fullmatch(where):
        return where
    section, name, *inner = where.split(".")
    part = f"{NOUNS[section]} {name}" if section in NOUNS else ""
    if section == "joint_defaults":
        part, inner = "all joints", [name, *inner]
    elif section == "assembly":
        return f"start of {'.'.join([name, *inner])}"
    elif section == "dimensions" and not inner:
        part = name
    elif section not in NOUNS:
        inner = [section, name, *inner]
    elif section == "links" and len(inner) > 1 and inner[0] == "points":
        part = f"point {inner[1]} of {part}"
        inner = [dict(zip("012", "xyz", strict=True)).get(key, key) for key in inner[2:] if key not in "xyz at"]
    return " of ".join(text for text in (" ".join(inner).replace("_", " "), part) if text)


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


# ---- what can be tried --------------------------------------------------------------------------------------------


def cures(state: Loaded, finding: Finding) -> list[dict[str, Any]]:
    """What the remedy of a locked position comes to in numbers: gestures that write it, with the words for them."""
    facts, entries, numbers = finding.figures, dict(state.entries or {}), state.run.values
    joints = entries.get("joints")
    if finding.code != "friction.locked" or not isinstance(joints, Mapping):
        return []
    before = {path: float(np.ravel(value)[0]) for path, value in numbers.items() if path.startswith("joints.")}
    usual = [joint for joint in felt(state.run.system, numbers) if f"joints.{joint}.friction.coefficient" in before]
    alike = facts["whole"] >= (1 - 1e-3) * facts["share"]  # else other joints lock where these no longer do
    trials = [(list(facts["joints"]) if alike else usual, min(facts["share"], facts["whole"]))]
    decides, multiple = facts["decides"], facts["multiple"]
    if decides and multiple and trials[0][0] != [decides]:
        trials.insert(0, ([decides], multiple))
    listed = []
    for chosen, times in trials:
        if times <= 0 or not all(joint in usual and isinstance(joints.get(joint), Mapping) for joint in chosen):
            continue
        owners = {joint: (["joints", joint], joints[joint], joint) for joint in chosen}
        if set(chosen) == set(usual) and not any("friction" in joints[joint] for joint in chosen):  # it is stated once
            owners = {"all joints": (["joint_defaults"], entries.get("joint_defaults", {}), chosen[0])}
        gestures = []
        for section, entry, joint in owners.values():
            inside = ["coefficient"] if isinstance(entry.get("friction", {}), Mapping) else []
            value = float(f"{ENOUGH * times * before[f'joints.{joint}.friction.coefficient']:.3g}")
            gestures.append({"do": "set", "path": [*section, "friction", *inside], "value": value})
        change = f"× {ENOUGH * times:.3g}"
        if len(owners) == 1:
            change = f"{before[f'joints.{chosen[0]}.friction.coefficient']:.3g} → {gestures[0]['value']:.3g}"
        what = f"friction coefficient{'s' * (len(owners) > 1)} of {', '.join(owners)}"
        listed.append({"label": f"{what} {change}", "gestures": gestures})
    shorter = ENOUGH * multiple if decides and multiple else None  # of the radius: a longer guide does as much
    for part, key, times in (("pin", "radius", shorter), ("guide", "length", shorter and 1.0 / shorter)):
        path, stated = f"joints.{decides}.{part}.{key}", joints.get(decides, {}).get(part, {})
        if times and path in before and isinstance(stated, Mapping) and "fit" not in stated:  # a fit states the radius
            sketch, after = Sketch(entries), float(f"{times * before[path]:.3g}")
            was, length = sketch.length(before[path]), sketch.length(after)
            gesture = {"do": "set", "path": path.split("."), "value": length}
            listed.append({"label": f"{part} {key} of {decides} {was} → {length}", "gestures": [gesture]})
    return listed


# ---- what it can be asked -----------------------------------------------------------------------------------------


def readiness(
    mechanism: Mechanism | None, result: xr.Dataset | None, findings: Sequence[Finding], lacks: Sequence[str] = ()
) -> list[dict[str, Any]]:
    """For motion, forces, friction, play, tolerance and time: whether there is what it takes, and why.

    lacks: what is not drawn yet.
    """
    subjects = ("motion", "forces", "friction", "play", "tolerance", "time")
    if mechanism is None or result is None:
        errors = [finding for finding in findings if finding.severity is Severity.ERROR]
        why = f"{spoken(errors[0].where)} {errors[0].what}".strip() if errors else "Draw links and drive a joint."
        reasons = [" ".join(lacks) or why, *["The motion comes first."] * 5]
        return [{"what": what, "ok": False, "why": why} for what, why in zip(subjects, reasons, strict=True)]
    count, able = result.sizes["position"], int(np.sum(result["status"].values < Status.SINGULAR))
    rest = f"; the other {count - able} cannot be reached" if able < count else ""
    still = " ".join(lacks) or "No joint is driven: it stands still."
    moves = f"Moves through {able} of {counted(count, 'position')}{rest}." if mechanism.drivers else still
    numbers = mechanism.parameters()
    weighs = any(path.endswith((".mass", ".stiffness")) and bool(np.any(numbers[path])) for path in numbers)
    answers = (
        (bool(mechanism.drivers) and able > 0, moves, moves),
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
    return [{"what": what, "ok": ok, "why": done if ok else remedy}
            for what, (ok, done, remedy) in zip(subjects, answers, strict=True)]  # fmt: skip


# ---- what it lacks ------------------------------------------------------------------------------------------------


def missing(sketch: Sketch, findings: Sequence[Finding]) -> list[str]:
    """The next step of the hand, where nothing but steps of drawing is missing; none where something is wrong."""
    errors = [finding for finding in findings if finding.severity is Severity.ERROR]
    if not errors and sketch.joints and not sketch.of("drivers"):
        return ["It stands still: its joints let no link move. Take one away, or let an end slide."]
    steps = [error for error in errors if error.what.startswith(("there are no", "no joint connects"))
             or (error.where == "drivers" and error.remedy.startswith("drive a joint"))]  # fmt: skip
    complete = len(steps) < len(errors)
    return [f"{error.what[:1].upper()}{error.what[1:]}: {remedied(error.remedy)}." for error in steps[: not complete]]
