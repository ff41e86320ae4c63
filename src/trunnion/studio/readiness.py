"""What a model can be asked already, and what it still lacks for the rest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import Finding, Severity, Status, counted
from trunnion.model.joint_parts import has_play
from trunnion.model.mechanism import Mechanism
from trunnion.solve.run import prepare
from trunnion.solve.system import rubbing
from trunnion.studio.words import spoken

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["readiness"]


def readiness(
    mechanism: Mechanism | None, result: xr.Dataset | None, findings: Sequence[Finding], lacks: Sequence[str] = ()
) -> list[dict[str, Any]]:
    """For motion, forces, friction, play, tolerance and time: whether there is what it takes, and why.

    lacks: what is not drawn yet.
    """
    rows = zip(
        ("motion", "forces", "friction", "play", "tolerance", "time"),
        _said(mechanism, result, findings, lacks),
        strict=True,
    )
    return [{"what": what, "ok": ok, "why": why} for what, (ok, why) in rows]


def _said(
    mechanism: Mechanism | None, result: xr.Dataset | None, findings: Sequence[Finding], lacks: Sequence[str]
) -> Iterator[tuple[bool, str]]:
    errors = [one for one in findings if one.severity is Severity.ERROR]
    if mechanism is None or result is None:
        why = f"{spoken(errors[0].where)} {errors[0].what}".strip() if errors else "Draw links and drive a joint."
        yield False, " ".join(lacks) or why
        yield from [(False, "The motion comes first.")] * 5
        return
    if not mechanism.drivers:
        yield False, " ".join(lacks) or "No joint is driven: it stands still."
    status = result["status"].values
    stands, count = int(np.sum(status >= Status.SINGULAR)), len(status)
    if mechanism.drivers:
        yield stands < count, _moves(count - stands, count)
    values = mechanism.parameters()
    acts = bool(mechanism.loads) or any(
        path.endswith((".mass", ".stiffness")) and bool(np.any(np.asarray(value) != 0))
        for path, value in values.items()
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


def _moves(reached: int, count: int) -> str:
    if reached in (0, count):
        return f"Moves through {counted(count, 'position')}." if reached else f"No position in {count} can be reached."
    return f"Moves through {reached} of {count} positions; the other {count - reached} cannot be reached."
