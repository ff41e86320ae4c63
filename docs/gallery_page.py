"""The gallery page: an entry for every example, with its drawing, notes, formula and checked fact.

Which examples there are, in which order and with which fact, is told in `tests/gallery/facts.py`.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples"
STEPS = 180  # positions of figures and reports that only the gallery shows


def facts() -> Any:
    """The module `gallery.facts` of the tests."""
    folder = str(ROOT / "tests")
    if folder not in sys.path:
        sys.path.append(folder)
    from gallery import facts

    return facts


def wanted() -> set[tuple[str, str, str]]:
    """The drawings and reports that the page refers to: model, kind, suffix."""
    entries = facts().ENTRIES.items()
    return {(name, kind, "svg") for name, entry in entries for kind in entry.figures} | {
        (name, "report", "html") for name, entry in entries if entry.report
    }


def page(text_only: bool = False) -> str:
    """The entries as Markdown, by section. text_only: without what has to be computed."""
    known = facts()
    missing = {path.stem for path in EXAMPLES.glob("*.yaml")} ^ {*known.ENTRIES, *known.REFUSED}
    if missing:
        raise ValueError(f"tests/gallery/facts.py and examples/ do not name the same models: {sorted(missing)}")
    parts = []
    for title, entries in known.SECTIONS.items():
        parts += [f"## {title}", *(_entry(name, entry, text_only) for name, entry in entries.items())]
    parts += ["## Diagnosed and refused", *(() if text_only else map(_refused, known.REFUSED))]
    return "\n\n".join(parts) + "\n"


def _entry(name: str, entry: Any, text_only: bool) -> str:
    import trunnion
    from gallery.entry import STEPS, Outcome

    mechanism = trunnion.read(EXAMPLES / f"{name}.yaml")
    result = None if text_only else trunnion.analyse(mechanism, STEPS)
    drawings = [f"![{_alt(kind)}](figures/{name}/{kind}.svg)" for kind in entry.figures]
    report = f" · [report](figures/{name}/report.html)" if entry.report else ""
    parts = [
        f"### {mechanism.name}",
        " ".join(mechanism.notes.split()),
        '<div class="gallery" markdown>',
        *drawings,
        "</div>",
        "" if result is None else _checked(entry, Outcome(mechanism, result)),
        *_sources(mechanism),
        ("" if result is None else f"`{result.attrs['formula']}` · ") + f"[{name}.yaml](examples/{name}.yaml){report}",
    ]
    return "\n\n".join(parts)


def _refused(name: str) -> str:
    """An example that is there for its diagnosis."""
    import trunnion

    mechanism = trunnion.read(EXAMPLES / f"{name}.yaml")
    found = trunnion.check(mechanism, 72).findings
    errors = [one for one in found if one.severity == "error"]
    findings = [f"**Finding.** {one.what[0].upper()}{one.what[1:]}. Remedy: {one.remedy}." for one in errors]
    told = [" ".join(mechanism.notes.split()), *findings, *_sources(mechanism), f"[{name}.yaml](examples/{name}.yaml)"]
    return "\n\n".join([f"### {mechanism.name}", *told])


def _alt(kind: str) -> str:
    told = {"mechanism": "Mechanism with the paths of its points", "assemble": "Clearance that it takes to assemble"}
    return told.get(kind, kind.replace("-", " ").capitalize())


def _sources(mechanism: Any) -> list[str]:
    return ["Data: " + "; ".join(source.rstrip(".") for source in mechanism.references) + "."] * bool(
        mechanism.references
    )


def _checked(entry: Any, one: Any) -> str:
    """The fact with both figures; refuses a page whose fact does not hold."""
    from trunnion.results.quantities import number, prefixed

    found, expected = entry.found(one), entry.expected()
    if not abs(found - expected) <= entry.tolerance:
        raise ValueError(f"{entry.says}: {found!r} {entry.unit}, expected {expected!r}")
    factor, unit = prefixed(expected or 1.0, entry.unit)
    unit = "°" if unit == "°" else f" {unit}".rstrip()
    digits = 7 if expected else 1  # what is left of a figure that vanishes has no digits worth telling
    told = f"**Checked.** {entry.says}: **{number(found * factor, digits)}{unit}**. By {entry.source}: "
    if not expected:
        return told + "0."
    apart = number(abs(found / expected - 1), 1)
    return told + ("the same to the last digit." if found == expected else f"the same within {apart} of it.")
