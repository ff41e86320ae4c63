"""What is to be known of a model and of how it is assembled, before any position of its cycle is solved."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from trunnion.errors import Finding, Severity
from trunnion.joints.pairs import PAIRS
from trunnion.model.joint_parts import clearance
from trunnion.model.mechanism import Mechanism
from trunnion.model.quantity import Quantity
from trunnion.model.units import KINDS
from trunnion.solve.system import System

if TYPE_CHECKING:
    from trunnion.solve.run import Run

__all__ = ["model_notes", "of_run", "shared_dimensions"]

MOST_PLACES = 8  # named in one sentence
ZERO_INERTIA = Quantity(0, KINDS["moment of inertia"])


def of_run(run: Run, notes: bool = True) -> list[Finding]:
    """What there is to say before any position is solved. notes: of the model, too."""
    model = run.once("notes", lambda: model_notes(run.system.mechanism, run.system))
    graver = [finding for finding in model if notes or finding.severity is not Severity.NOTE]
    return [*graver, *run.chosen.findings, *(run.determinacy.findings() if run.determinacy else [])]


def model_notes(mechanism: Mechanism, system: System) -> list[Finding]:
    """What the model says that this analysis leaves out, and warnings about the data."""
    notes = list(mechanism.checked)
    values = mechanism.parameters()
    play = {name: clearance(name, values) for name in mechanism.effective_joints if name not in mechanism.seated}
    playing = [name for name, gap in play.items() if gap is not None and gap > 0]
    bodies = {name: link for name, link in mechanism.effective_links.items() if name != mechanism.fixed_link}
    heavy = [name for name, link in bodies.items() if link.mass.source != 0]
    if heavy and mechanism.gravity is None:
        down, none = ("[0, -9.81]", "[0, 0]") if mechanism.space == "planar" else ("[0, 0, -9.81]", "[0, 0, 0]")
        what = f"gravity is not stated and taken as zero, although {', '.join(heavy)} have mass"
        remedy = f"state gravity: {down}, or gravity: {none}"
        notes.append(Finding.note("model.gravity", "gravity", what, remedy, links=heavy))
    if not heavy and any(part.source != 0 for part in mechanism.gravity or ()):
        what = "has no effect: no link has a mass"
        remedy = "state mass: … and centre: … of the links, or no gravity"
        notes.append(Finding.note("model.no_mass", "gravity", what, remedy))
    sliding = {link for joint in mechanism.joints.values() if PAIRS[joint.type].guided for link in joint.links}
    points = [name for name in heavy if bodies[name].inertia == ZERO_INERTIA and name not in sliding]
    if points:
        what = f"{', '.join(points)} have a mass but no inertia: each is a point mass at its centre"
        notes.append(Finding.note("model.point_mass", "links", what, "state inertia: …", links=points))
    if playing:
        # no seats are taken where links are over-constrained
        redundant_joints = {name for module in system.plan.modules if module.redundant for name in module.joints}
        seatable = [name for name in playing if name not in redundant_joints]
        of = f" of {', '.join(seatable)}" if len(seatable) < len(playing) else ", or analyse with --seat loaded"
        remedy = f"for pins pressed to one side by their loads state seat: loaded{of}"
        if not seatable:
            remedy = "see `trunnion play` for the effect of the play, `trunnion assemble` for whether the links fit "
            remedy += "together"
        what = f"the pins of {', '.join(playing)} are at the middle of their play"
        notes.append(Finding.note("model.play_centred", "joints", what, remedy, joints=playing, seatable=seatable))
    return notes


def shared_dimensions(mechanism: Mechanism) -> Iterator[Finding]:
    """Of each toleranced dimension that alone sets points of more than one link: as one they vary together, as parts do
    not.

    Where it stands beside other dimensions, as the radius of a roller between two links does, it is one part's own.
    """
    placed = [
        (path, entry.depends)
        for path, entry in mechanism.parameter_set.entries.items()
        if path.startswith("links.") and ".points." in path
    ]
    for tolerance in mechanism.tolerated():
        used = [path for path, depends in placed if depends == (tolerance.path,)]
        links = list(dict.fromkeys(path.split(".")[1] for path in used))
        if tolerance.path.startswith("dimensions.") and len(links) > 1:
            name = tolerance.path.removeprefix("dimensions.")
            names = [path.removeprefix("links.").replace(".points.", ".") for path in used]
            more = f" and {len(names) - MOST_PLACES} more" if len(names) > MOST_PLACES else ""
            what = f"one tolerance sets points of {', '.join(links)} ({', '.join(names[:MOST_PLACES])}{more}): these "
            what += "links deviate together, by the same amount"
            remedy = "if the links are made separately, give each a dimension of its own with its own tolerance"
            yield Finding.note("tolerance.shared_dimension", tolerance.path, what, remedy, name=name, links=links)
