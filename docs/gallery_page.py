"""The gallery page: small pictures of all examples, then for each its drawing, notes, formula and checked fact.

`tests/gallery/facts.py` lists the examples in their order, each with its fact.
"""

from __future__ import annotations

import html
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples"
STEPS = 72  # positions of figures that only the gallery shows: those that the facts are read from


def facts() -> Any:
    """The module `gallery.facts` of the tests."""
    folder = str(ROOT / "tests")
    if folder not in sys.path:
        sys.path.append(folder)
    from gallery import facts

    return facts


@cache
def model(name: str) -> Any:
    """An example as read, once for the whole page."""
    import trunnion

    return trunnion.read(EXAMPLES / f"{name}.yaml")


def brief(mechanism: Any, steps: int) -> Any:
    """What `analyse` returns, without the means over the cycle: figures show none, and they ask for most positions."""
    from trunnion.cycle.positions import positions
    from trunnion.cycle.summary import result_of
    from trunnion.solve.run import prepare

    with np.errstate(all="ignore"):  # a position that is not solved is NaN
        run = prepare(mechanism)
        return result_of(run, positions(run, steps, averaged=False)).dataset


@cache
def shown(name: str) -> Any:
    """The brief result of an example over `STEPS` positions, for its fact and all its figures."""
    return brief(model(name), STEPS)


def wanted() -> set[tuple[str, str, str]]:
    """The drawings that the page refers to: model, kind, suffix."""
    return {(name, kind, "svg") for name, entry in facts().ENTRIES.items() for kind in entry.figures}


def page(keep: Any, reports: set[str], text_only: bool = False) -> str:
    """The page as Markdown, by section.

    keep: `figures.kept`; reports: models whose report another page shows; text_only: without what has to be computed.
    """
    known = facts()
    missing = {path.stem for path in EXAMPLES.glob("*.yaml")} ^ {*known.ENTRIES, *known.REFUSED}
    if missing:
        raise ValueError(f"tests/gallery/facts.py and examples/ do not name the same models: {sorted(missing)}")
    parts = [_thumbnails(known.ENTRIES)]
    for title, entries in known.SECTIONS.items():
        parts += [
            f"## {title}",
            *(_entry(name, one, keep, name in reports, text_only) for name, one in entries.items()),
        ]
    parts += ["## Diagnosed and refused", *(() if text_only else map(_refused, known.REFUSED))]
    return "\n\n".join(parts) + "\n"


def _thumbnails(entries: Any) -> str:
    """A grid of small drawings, each a link to its entry."""
    cells = []
    for name, entry in entries.items():
        title = html.escape(model(name).name)
        picture = f"![](figures/{name}/{entry.figures[0]}.svg){{ loading=lazy }}"
        cells.append(f"[{picture} <span>{title}</span>](#{name})")
    return '<div class="thumbnails" markdown>\n' + "\n".join(cells) + "\n</div>"


def _entry(name: str, entry: Any, keep: Any, report: bool, text_only: bool) -> str:
    mechanism = model(name)
    drawings = [f"![{_alt(kind)}](figures/{name}/{kind}.svg){{ loading=lazy }}" for kind in entry.figures]
    checked, formula = "", ""
    if not text_only:
        text = (EXAMPLES / f"{name}.yaml").read_text("utf-8")
        checked, formula = keep(("gallery", text), lambda: _computed(name, entry, mechanism)).decode().split("\n\n")
    parts = [
        f"### {mechanism.name} {{ #{name} }}",
        " ".join(mechanism.notes.split()),
        '<div class="gallery" markdown>',
        *drawings,
        "</div>",
        checked,
        *_sources(mechanism),
        (f"`{formula}` · " if formula else "")
        + f"[{name}.yaml](examples/{name}.yaml)"
        + (f" · [report](figures/{name}/report.html)" if report else ""),
    ]
    return "\n\n".join(parts)


def _computed(name: str, entry: Any, mechanism: Any) -> bytes:
    """What an entry says that has to be computed, as two paragraphs: the checked fact, the formula."""
    from gallery.entry import Outcome
    from trunnion import analyse

    try:
        checked = _checked(entry, Outcome(mechanism, shown(name)))
    except ValueError:  # a fact about means, or one that does not hold
        checked = _checked(entry, Outcome(mechanism, analyse(mechanism, STEPS)))
    return f"{checked}\n\n{shown(name).attrs['formula']}".encode()


def _refused(name: str) -> str:
    """An example that is there for its diagnosis."""
    import trunnion

    mechanism = model(name)
    found = trunnion.check(mechanism, 72).findings
    errors = [one for one in found if one.severity == "error"]
    findings = [f"**Finding.** {one.what[0].upper()}{one.what[1:]}. Remedy: {one.remedy}." for one in errors]
    told = [" ".join(mechanism.notes.split()), *findings, *_sources(mechanism), f"[{name}.yaml](examples/{name}.yaml)"]
    return "\n\n".join([f"### {mechanism.name} {{ #{name} }}", *told])


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
