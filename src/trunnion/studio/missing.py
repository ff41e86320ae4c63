"""What a linkage that is half drawn still lacks, which is no error: said as the next step of the hand."""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.errors import Finding, Severity, counted
from trunnion.studio.sketch import Sketch

__all__ = ["missing"]


def missing(sketch: Sketch, findings: Sequence[Finding]) -> list[str]:
    """The next steps, where nothing but steps of drawing is missing; none where something is wrong."""
    errors = [one for one in findings if one.severity is Severity.ERROR]
    if not errors and sketch.joints and not sketch.of("drivers"):
        return ["It stands still: its joints let no link move. Take one away, or let an end slide."]
    drawn = sketch.rows or sketch.entries.get("space") != "spatial"  # by hand, or in a table
    if not errors or not drawn or not all(map(_unfinished, errors)):
        return []
    return _steps(sketch)


def _unfinished(finding: Finding) -> bool:
    """Whether a finding is about what is not drawn yet."""
    lacks = finding.what.startswith(("there are no", "no joint connects"))
    return lacks or (finding.where == "drivers" and finding.remedy.startswith("drive a joint"))


def _steps(sketch: Sketch) -> list[str]:
    if sketch.rows:
        driven = "The loop can move in more ways than one" if sketch.of("drivers") else "Nothing drives the loop"
        return [f"{driven}: change the type of a joint, or choose one and drive it."]
    links = [name for name in sketch.of("links") if name != sketch.ground]
    if not links:
        return ["Draw a link."]
    held = any(sketch.ground in joint["links"] for joint in sketch.joints.values())
    steps = [] if held else ["Nothing is held yet: pin an end of a link to the ground."]
    loose = [name for name in links if not any(name in joint["links"] for joint in sketch.joints.values())]
    if sketch.joints or len(loose) > 1:
        steps += [f"{name} is joined to nothing: draw from one of its ends, or pin it." for name in loose]
    if steps or not sketch.joints:
        return steps
    ways, drivers = _mobility(sketch), len(sketch.of("drivers"))
    ends = _list(_open_ends(sketch, links))
    moves = f"It can move in {counted(ways, 'way')}{f', of which {drivers} is driven' if drivers else ''}"
    if ways == 1:
        return [f"{moves}: drive a joint{f', or draw on from {ends}' if ends else ''}."]
    return [f"{moves}: {f'draw on from {ends}, pin or guide it' if ends else 'pin, guide or drive another joint'}."]


def _mobility(sketch: Sketch) -> int:
    """By Grübler's formula: of pins, slides and gear pairs in the plane."""
    moving = sum(name != sketch.ground for name in sketch.of("links"))
    return 3 * moving - 2 * len(sketch.joints) - len(sketch.of("gears"))


def _open_ends(sketch: Sketch, links: list[str]) -> list[str]:
    """Free points of links that hang on one joint."""
    hanging = [name for name in links if sum(name in joint["links"] for joint in sketch.joints.values()) == 1]
    return [point for name in hanging for point in sketch.points(name) if point not in sketch.joints]


def _list(names: list[str]) -> str:
    return " or ".join((", ".join(names[:-1]), names[-1]) if len(names) > 1 else names)
