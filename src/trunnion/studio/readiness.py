"""What a model can be asked already, and what it still lacks for the rest; what a linkage that is half drawn lacks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import Finding, Severity, Status, counted
from trunnion.model.joint_parts import has_play
from trunnion.model.mechanism import Mechanism
from trunnion.solve.run import prepare
from trunnion.solve.system import rubbing
from trunnion.studio.sketch import Sketch
from trunnion.studio.words import spoken

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["missing", "readiness"]


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
        answers = list(_of_motion(mechanism, result, lacks))
    subjects = ("motion", "forces", "friction", "play", "tolerance", "time")
    return [{"what": what, "ok": ok, "why": why} for what, (ok, why) in zip(subjects, answers, strict=True)]


def _of_motion(mechanism: Mechanism, result: xr.Dataset, lacks: Sequence[str]) -> Iterator[tuple[bool, str]]:
    status = result["status"].values
    count, reached = len(status), int(np.sum(status < Status.SINGULAR))
    if not mechanism.drivers:
        yield False, " ".join(lacks) or "No joint is driven: it stands still."
    elif reached == count:
        yield True, f"Moves through {counted(count, 'position')}."
    elif reached:
        yield True, f"Moves through {reached} of {count} positions; the other {count - reached} cannot be reached."
    else:
        yield False, f"No position in {count} can be reached."
    acts = bool(mechanism.loads) or any(
        path.endswith((".mass", ".stiffness")) and bool(np.any(np.asarray(value) != 0))
        for path, value in mechanism.parameters().items()
    )
    yield acts, "Loads or masses act on it." if acts else "Add a load, a mass or a spring."
    rubs = bool(rubbing(prepare(mechanism).system))
    joints = mechanism.effective_joints.values()
    sized = any(
        (one.pin and one.pin.radius is not None) or (one.guide and one.guide.length is not None) for one in joints
    )
    lacks_size = "" if sized else ", and the radius of its pin"  # a step that is done is not asked for again
    yield rubs, "Joints rub." if rubs else f"State friction of a joint{lacks_size}."
    plays = any(map(has_play, joints))
    yield plays, "Pins have play: the study shows what it does." if plays else "State a clearance or fit of a pin."
    tolerated = bool(mechanism.tolerated())
    done = "Numbers have tolerances: the study shows what they do."
    yield tolerated, done if tolerated else "Write a tolerance, such as 60 mm ± 0.05 mm."
    free = any(driver.found for driver in mechanism.drivers.values())
    driver = next(iter(mechanism.drivers), "A")
    how = f"In the text give a driver a motor, as drivers: {{{driver}: {{motor: {{kind: constant, effort: 5 N m}}}}}}"
    runs = "the study Motion in time lets it run"
    yield free, f"A motor drives it: {runs}." if free else f"{how}; then {runs}."


# ---- half drawn ---------------------------------------------------------------------------------------------------


def missing(sketch: Sketch, findings: Sequence[Finding]) -> list[str]:
    """The next steps of the hand, where nothing but steps of drawing is missing; none where something is wrong."""
    errors = [one for one in findings if one.severity is Severity.ERROR]
    if not errors and sketch.joints and not sketch.of("drivers"):
        return ["It stands still: its joints let no link move. Take one away, or let an end slide."]
    drawn = sketch.rows or sketch.entries.get("space") != "spatial"  # by hand, or in a table
    unfinished = [
        error.what.startswith(("there are no", "no joint connects"))
        or (error.where == "drivers" and error.remedy.startswith("drive a joint"))
        for error in errors
    ]
    return _next_steps(sketch) if unfinished and drawn and all(unfinished) else []


def _next_steps(sketch: Sketch) -> list[str]:
    if sketch.rows:
        driven = "The loop can move in more ways than one" if sketch.of("drivers") else "Nothing drives the loop"
        return [f"{driven}: change the type of a joint, or choose one and drive it."]
    links = [name for name in sketch.of("links") if name != sketch.ground]
    if not links:
        return ["Draw a link."]
    pairs = [joint["links"] for joint in sketch.joints.values()]
    counts = {name: sum(name in pair for pair in pairs) for name in links}
    steps = []
    if not any(sketch.ground in pair for pair in pairs):
        steps = ["Nothing is held yet: pin an end of a link to the ground."]
    loose = [name for name, count in counts.items() if not count]
    if pairs or len(loose) > 1:
        steps += [f"{name} is joined to nothing: draw from one of its ends, or pin it." for name in loose]
    if steps or not pairs:
        return steps
    # by Grübler's formula, of pins, slides and gear pairs in the plane
    mobility, drivers = 3 * len(links) - 2 * len(pairs) - len(sketch.of("gears")), len(sketch.of("drivers"))
    hanging = [name for name, count in counts.items() if count == 1]
    points = [point for name in hanging for point in sketch.points(name) if point not in sketch.joints]
    ends = " or ".join(filter(None, (", ".join(points[:-1]), *points[-1:])))
    moves = f"It can move in {counted(mobility, 'way')}{f', of which {drivers} is driven' if drivers else ''}"
    if mobility == 1:
        return [f"{moves}: drive a joint{f', or draw on from {ends}' if ends else ''}."]
    return [f"{moves}: {f'draw on from {ends}, pin or guide it' if ends else 'pin, guide or drive another joint'}."]
