"""Work that enters a mechanism beside its drives, which an efficiency does not count as input."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.quadrature import integrals
from trunnion.cycle.means import MOST_SUPPOSED, Means
from trunnion.errors import Finding, Status
from trunnion.model.mechanism import Mechanism
from trunnion.results.quantities import readable
from trunnion.results.sentences import finding_for
from trunnion.solve.loads import NOTHING_USEFUL, STATE_USEFUL, useful_loads, useful_springs
from trunnion.solve.run import Run

__all__ = ["beside_the_drive", "findings", "meaning"]

MUCH = 0.02  # of the drive work: what a spring keeps at the end of a range
LEAST = 0.01  # of the drive work: what supplies less is not worth a word
ROUNDED = 1e-6  # beside its error: an efficiency is above 1 by more, for seats settle to as much of their clearance


def meaning(mechanism: Mechanism, means: Means, status: NDArray[Any]) -> str:
    """What an efficiency of 0, or below it, or none, means. status: of the positions."""
    value = means.efficiency
    if not means.has_useful_work:
        return f"{NOTHING_USEFUL}: {STATE_USEFUL}"
    if value == 0:
        return "the useful loads do no net work"
    if np.isfinite(value):
        return "the useful loads supply work" * bool(value < 0)
    if np.any(status >= Status.NOT_CONVERGED):
        return "not every position is solved"
    if means.supposed > MOST_SUPPOSED:
        return f"pins do not settle, which may change {means.supposed:.0%} of the work"
    if not np.isfinite(means.drive_power.value):
        return "not every position between the steps is solved"
    return "the loads drive, the driver absorbs work" if means.drive_power.net < 0 else "the driver does no net work"


def beside_the_drive(mechanism: Mechanism) -> list[str]:
    """Loads on a driven link that are not useful where others are, such as a hand's force beside its drive torque."""
    useful = useful_loads(mechanism)
    driven = {link for name in mechanism.drivers for link in mechanism.effective_joints[name].links}
    driven.discard(mechanism.fixed_link)
    return [name for name, load in mechanism.loads.items() if load.link in driven and name not in useful]


def findings(run: Run, means: Means) -> Iterator[Finding]:
    """A warning of an efficiency above 1, with the work of each source beside the drives; else notes of springs that
    keep work at the end of a range, and of loads that act beside the drive and supply work. means: of the cycle."""
    mechanism = run.system.mechanism
    beside, useful = beside_the_drive(mechanism), useful_springs(mechanism)
    storing = [name for name in mechanism.springs if name not in useful] if not run.cycle.periodic else []
    above = means.efficiency > 1 + ROUNDED + means.efficiency_error
    if not (above or beside or storing) or run.cycle.duration <= 0 or not np.isfinite(means.drive_power.value):
        return
    drive = means.drive_power.net * run.cycle.duration
    every = _work(run, means)
    work = {name: value for name, value in every.items() if value > LEAST * abs(drive)}
    if above:
        work = work or dict([max(every.items(), key=lambda one: one[1])])
        supplies = ", ".join(f"{name} {readable(value, 'J')}" for name, value in work.items())
        yield finding_for(
            "efficiency.above_one", efficiency=means.efficiency, drive=drive, work=work, phrases={"supplies": supplies}
        )
        return
    for name in storing:
        if (stored := -every[f"spring {name}"]) > MUCH * drive > 0:
            yield finding_for("spring.stores", f"springs.{name}", stored=stored, drive=drive)
    for name in beside:
        if (supplied := work.get(f"load {name}")) is not None:
            yield finding_for("load.not_counted", f"loads.{name}", work=supplied, drive=drive)


def _work(run: Run, means: Means) -> dict[str, float]:
    """Work over the cycle, J, into the mechanism by each load and spring that is not useful, and by its masses."""
    mechanism, duration = run.system.mechanism, run.cycle.duration
    loads = [name for name in mechanism.loads if name not in useful_loads(mechanism)]
    springs = [name for name in mechanism.springs if name not in useful_springs(mechanism)]

    def powers(rows: NDArray[np.intp], time: NDArray[np.float64]) -> NDArray[np.float64]:
        back = run.solve(time.ravel())
        every = [*(back.load_powers[name] for name in loads), *(back.springs[name].power for name in springs)]
        return np.array([np.broadcast_to(primal(one), time.size) for one in every]).reshape(len(every), *time.shape)

    found = integrals(powers, [run.edges]).value[:, 0].tolist() if loads or springs else []
    names = [*(f"load {name}" for name in loads), *(f"spring {name}" for name in springs)]
    rest = means.useful_power.net + means.friction_power.net - means.drive_power.net
    return {**dict(zip(names, found, strict=True)), "weight and inertia": rest * duration - sum(found)}
