"""What a mechanism is before any question is asked of it: findings, mobility, structural formula, plan."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from trunnion.algebra.dual import primal, single
from trunnion.cycle.findings import Cycle, findings, shared_dimensions
from trunnion.cycle.positions import positions
from trunnion.errors import Finding, MechanismError, Severity
from trunnion.measures.measures import named
from trunnion.measures.positions import ends_by_name
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.solve.assembly_modes import GroupModes, choices
from trunnion.solve.forward import Forward, forward
from trunnion.solve.run import prepare
from trunnion.structure.decompose import Plan, mobility_by_rank


@dataclass(frozen=True)
class Check:
    """The outcome of `check`.

    rank_mobility: by the rank of the joints' constraints, None where no position can be assembled.
    assemblies: number found for each module; choices: the groups that have several, with their ways; findings:
    everything to know, worst first.
    """

    plan: Plan
    rank_mobility: int | None
    assemblies: tuple[int, ...]
    choices: tuple[GroupModes, ...]
    findings: tuple[Finding, ...]

    @property
    def formula(self) -> str:
        """Structural formula, e.g. I(0,1)R → II(2,3)RRR."""
        return self.plan.formula

    @property
    def mobility(self) -> int:
        """Mobility by Grübler's formula."""
        return self.plan.mobility


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def check(mechanism: Mechanism, steps: int = 360, progress: Callable[[int], None] | None = None) -> Check:
    """Structure and findings of a mechanism, looked at over `steps` positions of its cycle.

    progress: called with the number of positions done.
    Raises MechanismError if the structure does not determine the motion.
    """
    run = prepare(mechanism)
    notes = findings(Cycle(run, positions(run, steps, progress=progress, averaged=False)))
    walk = forward(run.system, run.values, run.chosen.assembly, run.cycle.times(steps))
    rank = run.determinacy.mobility if run.determinacy else _rank(walk)
    if run.determinacy is None and rank is not None and rank != run.system.plan.mobility:
        what = f"the mobility is {run.system.plan.mobility} by Grübler's formula and {rank} by the rank of the "
        what += "constraints"
        remedy = "the geometry is special: reactions or motion are not determined"
        figures = {"formula": run.system.plan.mobility, "rank": rank}
        notes.append(Finding.warning("mobility.special", "joints", what, remedy, **figures))
    notes += shared_dimensions(mechanism)
    for measure in named(mechanism, list(mechanism.measures), run.values):
        if not measure.in_time and (measure.at is not None or measure.over is not None):
            try:
                ends_by_name(run, [measure])
            except MechanismError as error:  # a place, or a range, that the cycle has not: no study can have them
                notes += [replace(finding, severity=Severity.WARNING) for finding in error.findings]
    order = list(Severity)
    notes.sort(key=lambda finding: order.index(finding.severity))
    return Check(run.system.plan, rank, run.chosen.found, choices(run), tuple(notes))


def _rank(walk: Forward) -> int | None:
    """Mobility by rank at the first assembled position."""
    system = walk.system
    places = {
        name: np.stack(np.broadcast_arrays(*(np.atleast_1d(primal(n)) for n in walk.element(joint.links[1], name))))
        for name, joint in system.joints.items()
    }
    length = max((place.shape[1] for place in places.values()), default=1)
    places = {name: np.broadcast_to(place, (len(place), length)) for name, place in places.items()}
    solved = np.all([np.isfinite(place).all(axis=0) for place in places.values()], axis=0)
    if not np.any(solved):
        return None
    at = {name: tuple(place[:, np.argmax(solved)].tolist()) for name, place in places.items()}
    gears = {
        name: (system.mechanism.coupled(name), single(system.ratio(walk.values, name)))
        for name in system.mechanism.gears
    }
    links = [link for module in system.plan.modules for link in module.links]
    joints = {name: (joint.type, joint.links) for name, joint in system.joints.items()}
    try:
        return mobility_by_rank(links, system.mechanism.fixed_link, joints, at, gears, system.plan.modules)
    except np.linalg.LinAlgError:  # of numbers near the end of the floats
        return None
