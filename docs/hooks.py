"""What the build of the pages adds to their text, so that no table or picture can drift from the code.

- `<!-- generated: NAME -->` in a page becomes the table of that name, made from the code's own tables.
- The figures and reports that a page refers to are drawn; see `figures.py`.
- The line that says that a page has no tables in the repository is left out.
- The gallery is made of the examples and of `tests/gallery/facts.py`; see `gallery_page.py`.
- `$x$` and `$$x$$` become MathML, which browsers set without any script.

With TRUNNION_DOCS=text in the environment every figure is an empty one and the gallery's figures are not computed:
text, links and tables are checked within seconds, as `make test` does.
"""

from __future__ import annotations

import gc
import importlib.util
import inspect
import os
import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints
from xml.etree.ElementTree import Element

import yaml
from latex2mathml.converter import convert
from markdown.extensions import Extension
from markdown.inlinepatterns import InlineProcessor
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from pydantic import BaseModel
from pydantic_core import PydanticUndefined

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
EXAMPLES = ROOT / "examples"

TEXT_ONLY = os.environ.get("TRUNNION_DOCS") == "text"

# The matrices are small: further threads of the linear algebra would only spin. Said before NumPy is loaded.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
gc.set_threshold(50_000, 50, 50)  # pages and drawings are many small objects that live to the end


# ---- mathematics ----------------------------------------------------------------------------------------------


class _Formula(InlineProcessor):
    """A formula between dollar signs, as MathML."""

    def handleMatch(self, m: re.Match[str], data: str) -> tuple[str | Element | None, int | None, int | None]:  # noqa: N802
        """MathML, kept away from the other patterns."""
        display = "block" if m.group(1) == "$$" else "inline"
        return self.md.htmlStash.store(convert(m.group(2).strip(), display=display)), m.start(0), m.end(0)


class Mathematics(Extension):
    """`$…$` in a line and `$$…$$` on its own."""

    def extendMarkdown(self, md: Any) -> None:  # noqa: N802
        """After code spans, before escapes: a backslash belongs to the formula."""
        md.inlinePatterns.register(_Formula(r"(?<!\\)(\$\$?)(?!\s)(.+?)(?<!\s)\1", md), "mathematics", 185)


def on_config(config: Any) -> Any:
    """Add the formulas to the Markdown extensions."""
    config["markdown_extensions"].append(Mathematics())
    return config


# ---- files that no page has -----------------------------------------------------------------------------------


def on_files(files: Files, config: Any) -> Files:
    """Draw what the pages refer to; put the examples and the schema beside them."""
    pages = [path.read_text("utf-8") for path in sorted(DOCS.rglob("*.md"))]
    for place, content in _beside("figures").drawn(pages, _gallery()):
        files.append(File.generated(config, place, content=content))
    for path in sorted(EXAMPLES.glob("*.yaml")):
        files.append(File.generated(config, f"examples/{path.name}", abs_src_path=str(path)))
    schema = ROOT / "src" / "trunnion" / "model" / "mechanism.schema.json"
    files.append(File.generated(config, f"reference/{schema.name}", abs_src_path=str(schema)))
    return files


@cache
def _beside(name: str) -> Any:
    """A module in this folder, which MkDocs has on the path while it loads this one only."""
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _gallery() -> Any:
    return _beside("gallery_page")


# ---- tables ---------------------------------------------------------------------------------------------------


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Put the generated tables into a page."""

    def table(found: re.Match[str]) -> str:
        name, _, argument = found[1].partition(" ")
        if name not in TABLES:
            raise PluginError(f"there is no generated table '{name}'; known: {', '.join(TABLES)}")
        return TABLES[name](argument) if argument else TABLES[name]()

    markdown = re.sub(r"^> In the repository the tables .*\n\n", "", markdown, flags=re.M)  # not so in the built pages
    return re.sub(r"<!-- generated: (.+?) -->", table, markdown)


def _rows(head: tuple[str, ...], rows: list[tuple[object, ...]]) -> str:
    def line(cells: tuple[object, ...]) -> str:
        return "| " + " | ".join(str(cell).replace("|", "&#124;").replace("\n", " ") for cell in cells) + " |"

    return "\n".join([line(head), line(("---",) * len(head)), *(line(row) for row in rows)]) + "\n"


def _code(text: object) -> str:
    return f"`{text}`" if text not in ("", None) else ""


def _unit(text: str) -> str:
    return re.sub(r"\^([0-9])", lambda found: "⁰¹²³⁴⁵⁶⁷⁸⁹"[int(found[1])], text).replace(" ", " ")


PARTS = {"": "", "seats": "with a seat", "errors": "with an error"}


def results_table() -> str:
    """Every variable of a result, in the plane and in space: one row where it is the same in both."""
    from trunnion.results.variables import variables

    plane, space = variables("planar"), variables("spatial")
    rows: list[tuple[object, ...]] = []
    for name in _in_order(list(plane), list(space)):
        forms = [(where, known[name]) for where, known in (("plane", plane), ("space", space)) if name in known]
        if len(forms) == 2 and forms[0][1] == forms[1][1]:
            forms = [("", forms[0][1])]
        for where, one in forms:
            there = ", ".join(word for word in (where, PARTS[one.part]) if word)
            rows.append((_code(name), there, ", ".join((*one.dims, "position")), _unit(one.units), one.long_name))
    rows.append((_code("efficiency"), "", "", "1", "useful work over drive work of the cycle"))
    rows.append((_code("efficiency_ideal"), PARTS["errors"], "", "1", "efficiency of the mechanism without errors"))
    return _rows(("variable", "only in", "dimensions", "unit", "meaning"), rows)


def _in_order(first: list[str], second: list[str]) -> list[str]:
    """The names of both lists, those of the second alone behind the one they follow there."""
    merged = list(first)
    for before, name in zip([None, *second], second, strict=False):
        if name not in merged:
            merged.insert(merged.index(before) + 1 if before else 0, name)
    return merged


def sweeps_table() -> str:
    """Every figure of a sweep."""
    from trunnion.studies.sweep.study import FIGURES

    rows = [(_code(name), ", ".join(one.dims), _unit(one.units), one.long_name) for name, one in FIGURES.items()]
    return _rows(("variable", "dimension before the swept ones", "unit", "meaning"), rows)


def plays_table() -> str:
    """Every variable of the play of joints."""
    from trunnion.studies.play.result import VARIABLES

    rows = [
        (_code(name), ", ".join(one.dims), _unit(one.units) if one.units else "of the measure", one.long_name)
        for name, one in VARIABLES.items()
    ]
    return _rows(("variable", "dimension", "unit", "meaning"), rows)


def tolerances_table() -> str:
    """Every variable of a tolerance analysis."""
    from trunnion.studies.tolerance.result import VARIABLES

    return _toleranced(VARIABLES)


def identification_table() -> str:
    """Every variable of an identification."""
    from trunnion.rig.identification.result import VARIABLES

    rows = [(_code(name), ", ".join(one.dims), _unit(one.units), one.long_name) for name, one in VARIABLES.items()]
    return _rows(("variable", "dimension", "unit", "meaning"), rows)


def allocations_table() -> str:
    """Every variable of an allocation beside those of the tolerance analysis."""
    from trunnion.studies.allocation.result import VARIABLES

    return _toleranced(VARIABLES)


def _toleranced(variables: Mapping[str, Any]) -> str:
    told = {
        "": "of the measure", "parameter": "of the parameter", "ratio": "one by the other", "drive": "deg, mm, s",
        "1/": "1 by that of the measure", "course": "of the course", "course ratio": "course by parameter",
    }  # fmt: skip
    rows = [
        (
            _code(name),
            ", ".join(one.dims),
            "" if name == "choice" else told.get(one.units) or _unit(one.units),
            one.long_name,
        )
        for name, one in variables.items()
    ]
    return _rows(("variable", "dimensions", "unit", "meaning"), rows)


def measures_table() -> str:
    """Every kind of measure."""
    from trunnion.model.measure_table import MEASURES

    figures = {
        "deviation": "largest deviation from nominal",
        "line": "width about its least-squares line",
        "ratio": "over the cycle; of `instant` the largest deviation",
        "dead centre": "place where the joint turns back",
        "work": "over the cycle or range",
    }  # fmt: skip
    rows = [
        (
            _code(name),
            " or ".join(quantity.unit for quantity in one.quantities),
            "places" if one.needs == "places" else "motion and forces" if one.of_forces else "motion",
            figures.get(one.rule, one.rule),
            one.long_name,
        )
        for name, one in MEASURES.items()
    ]
    return _rows(("subject", "unit", "needs", "figure if nothing is stated", "what"), rows)


def distributions_table() -> str:
    """Every distribution of a deviation."""
    from trunnion.statistics.distributions import DISTRIBUTIONS

    def option(name: str, default: float | None) -> str:
        return _code(name) if default is None else f"{_code(name)} ({default:g})"

    rows = [
        (
            _code(name),
            ", ".join(option(*pair) for pair in one.parameters.items()),
            "yes" if one.bounded else "no",
            one.long_name,
        )
        for name, one in DISTRIBUTIONS.items()
    ]
    return _rows(("`distribution`", "takes (default)", "within its limits", "what"), rows)


def costs_table() -> str:
    """Every model of what a tolerance costs."""
    from trunnion.statistics.costs import COST_MODELS

    rows = [
        (
            _code(name),
            _code(model.formula),
            ", ".join(f"{_code(key)}: {one.meaning}" for key, one in model.parameters.items()),
            model.source,
        )
        for name, model in COST_MODELS.items()
    ]
    return _rows(("`model`", "cost of the half width t", "parameters", "source"), rows)


def comparisons_table() -> str:
    """Every variable of a comparison with a measurement."""
    from trunnion.rig.comparison.result import VARIABLES

    told = {"": "of the channel", "set": "of what is set", "drive": "rad, m or s"}
    rows = [
        (_code(name), ", ".join(one.dims), told.get(one.units) or _unit(one.units), one.long_name)
        for name, one in VARIABLES.items()
    ]
    return _rows(("variable", "dimensions", "unit", "meaning"), rows)


def assembling_table() -> str:
    """Every variable of whether a mechanism goes together."""
    from trunnion.studies.assembly.study import FIGURES

    rows = [(_code(name), ", ".join(one.dims), _unit(one.units), one.long_name) for name, one in FIGURES.items()]
    return _rows(("variable", "dimensions", "unit", "meaning"), rows)


def status_table() -> str:
    """Every status."""
    from trunnion.errors import Status

    shown = {True: "all", False: "motion only"}
    rows = [
        (
            int(one),
            _code(one.name.lower()),
            "nothing"
            if one is Status.NOT_ASSEMBLED
            else "positions only"
            if one is Status.SINGULAR
            else shown[one.solved],
            one.text,
        )
        for one in Status
    ]
    return _rows(("code", "name", "numbers given", "meaning"), rows)


def laws_table() -> str:
    """Every friction law with its parameters."""
    from trunnion.joints.friction import FRICTION_LAWS

    parts = []
    for name, law in FRICTION_LAWS.items():
        rows = [
            (
                _code(key),
                _unit(one.unit) or "1",
                "must be given" if one.default is None else f"{one.default:g}",
                f"{one.minimum:g} … {one.maximum:g}".replace("inf", "∞"),
                one.meaning,
            )
            for key, one in law.parameters.items()
        ]
        head = (
            f"**`{name}`** — {law.validity}. Source: {law.source}. Function: `joints.friction.{law.function.__name__}`."
        )
        parts.append(head + "\n\n" + _rows(("parameter", "unit", "default", "range", "meaning"), rows))
    return "\n".join(parts)


def motion_table() -> str:
    """Every motion law of a driver."""
    from trunnion.joints.motion import MOTION_LAWS

    rows = [
        (
            _code(name),
            ", ".join(_code(key) for key in law.needs),
            ", ".join(_code(key) for key in law.takes),
            f"{law.peak_rate:.4f}, {law.peak_second:.4f}" if law.profile else "",
            law.validity,
            law.source,
        )
        for name, law in MOTION_LAWS.items()
    ]
    head = ("`law`", "needs", "takes", "peak of s′, s″", "validity", "source")
    return _rows(head, rows)


def pairs_table() -> str:
    """Every pair of the model file: where it exists and what it needs."""
    from trunnion.joints.clearance import CLEARANCE_MODELS
    from trunnion.joints.pairs import PAIRS
    from trunnion.model.contact import contact_lacks, has_guide, has_pin, motions
    from trunnion.model.parts import Joint

    where = {("planar", "spatial"): "always", ("spatial",): "in space", (): "no"}
    rows = []
    for name, one in PAIRS.items():
        part = "pin" if has_pin(name) else "guide" if has_guide(name) else ""
        lacks = contact_lacks(Joint(type=name, links=("first", "second")), spatial=True) if part else ()
        rubs = ", ".join(_code(f"{part}.{size}") for size in lacks) if part else "" if not one.count else "not modelled"
        moves = MOVES.get(name) or " and ".join(motions(name))
        driven = motions(name)[0] if one.drivable else "no"
        plane = "yes" if one.planar else "no"
        play = {("planar", "spatial"): "yes", ("spatial",): "in space", (): "no"}[
            tuple(space for space, models in CLEARANCE_MODELS.items() if name in models)
        ]
        rows.append((_code(name), one.symbol, one.count, moves, plane, where[one.needs_axis], driven, rubs, play))
    head = ("`type`", "letter", "freedoms", "motion", "in the plane", "needs an `axis`", "driven", "friction needs",
            "play")  # fmt: skip
    return _rows(head, rows)


MOVES = {
    "helical": "rotation, and with it the slide by its `pitch`",
    "spherical": "any rotation",
    "universal": "rotation about a pin in each link, at right angles",
    "planar": "two slides across its axis, rotation about it",
    "fixed": "none",
}


def groups_table() -> str:
    """Every module with a closed form, and what solves the others."""
    from trunnion.groups import GROUPS, cylindrical_dyad

    rows = []
    for name, group in GROUPS.items():
        is_module = inspect.ismodule(group)
        home = group.__name__ if is_module else type(group).__module__
        about = inspect.getdoc(group if is_module else inspect.getmodule(type(group))) or ""
        rows.append((_code(name), _code(home.removeprefix("trunnion.")), about.splitlines()[0]))
    about = inspect.getdoc(cylindrical_dyad) or ""
    rows.append(("`CCC`, in space", "`groups.cylindrical_dyad`", about.splitlines()[0]))
    rows.append(("every other", "`groups.general`", "Any planar group, by Newton's method and one Jacobian"))
    rows.append(("every other, in space", "`groups.spatial`", "Any spatial group, likewise; drivers too"))
    return _rows(("module", "where", "what"), rows)


def plots_table() -> str:
    """Every plot."""
    from trunnion.views.cycle.plots import PLOTS

    return _rows(
        ("kind", "shows"), [(_code(name), (inspect.getdoc(f) or "").splitlines()[0]) for name, f in PLOTS.items()]
    )


def formats_table() -> str:
    """Every format a result is written in."""
    from trunnion.results.export import FORMATS

    rows = [
        (_code(name), f"`pip install 'trunnion[{extra}]'`" if extra else "") for name, (_, _, extra) in FORMATS.items()
    ]
    return _rows(("extension", "needs"), rows)


def codes_table() -> str:
    """The codes of findings about results, with the sentence where it is a plain text."""
    from trunnion.results.sentences.codes import SENTENCES

    rows = [(_code(code), str(one.severity), one.what if isinstance(one.what, str) else "")
            for code, one in sorted(SENTENCES.items())]  # fmt: skip
    return _rows(("code", "is", "says"), rows)


def units_table() -> str:
    """Every kind of quantity."""
    from trunnion.model.units import KINDS

    return _rows(
        ("kind", "a plain number is in", "for example"),
        [(kind.name, _unit(kind.unit), _code(kind.example)) for kind in KINDS.values()],
    )


def command_line() -> str:
    """Every verb with its arguments and options."""
    from trunnion.cli.app import app

    parts = []
    for command in app.registered_commands:
        call = command.callback
        assert call is not None
        rows = []
        for parameter in inspect.signature(call).parameters.values():
            hint = get_type_hints(call, include_extras=True)[parameter.name]
            base, info = get_args(hint)[0], hint.__metadata__[0]
            names = [name for name in (info.default, *(info.param_decls or ())) if str(name).startswith("--")]
            argument = type(info).__name__ == "ArgumentInfo"
            default = parameter.default
            if default is inspect.Parameter.empty:
                default = "must be given"
            elif default is None or default is False:
                default = ""
            elif str(default) == ".":
                default = "here"
            rows.append(
                (
                    _code(parameter.name.upper() if argument else names[0] if names else f"--{parameter.name}"),
                    "" if base is bool else _kind_of(base),
                    default,
                    info.help or "",
                )
            )
        name = command.name or call.__name__
        parts.append(
            f"## trunnion {name}\n\n{inspect.getdoc(call)}\n\n" + _rows(("", "takes", "default", "meaning"), rows)
        )
    return "\n".join(parts)


def _kind_of(base: Any) -> str:
    text = str(base)
    words = {"int": "whole number", "float": "number", "Path": "path", "str": "text"}
    return next((word for key, word in words.items() if key in text), text)


def public_names() -> str:
    """mkdocstrings' directive for every public name; a module among them has a section of its own."""
    import trunnion

    places = [one for one in (getattr(trunnion, name) for name in trunnion.__all__) if not inspect.ismodule(one)]
    return "\n\n".join(f"::: {one.__module__}.{one.__qualname__}" for one in places)


# ---- the model file -------------------------------------------------------------------------------------------

SECTIONS = ("Link", "Point", "PolarPoint", "InertiaTensor", "Joint", "Pin", "Guide", "Friction", "JointDefaults",
            "Misalignment", "Seat", "LoopJoint", "Driver", "Load", "Measure", "Variation", "VariationDefaults",
            "Correlation", "Cost", "CostOption")  # fmt: skip


def meanings() -> dict[str, dict[str, str]]:
    """What each key means, by class and key, where its class has no descriptions of its own.

    The tables below refuse to be built if one is missing or too many.
    """
    return yaml.safe_load((DOCS / "meanings.yaml").read_text("utf-8"))


def section(name: str) -> str:
    """The keys of one section: what each takes, its default, its meaning."""
    fields = {field.alias or key: field for key, field in _class(name).model_fields.items()}
    told = meanings().get(name) or {key: field.description for key, field in fields.items() if field.description}
    stray = set(told) ^ set(fields)
    if stray:
        raise PluginError(f"{name}: {', '.join(sorted(stray))} is told or stated, not both")
    rows = [(_code(key), _takes(field), _default(field), told[key]) for key, field in fields.items()]
    return _rows(("key", "takes", "default", "meaning"), rows)


def _class(name: str) -> type[BaseModel]:
    from trunnion.model import mechanism, parts

    return mechanism.Mechanism if name == "Mechanism" else getattr(parts, name)


def _takes(field: Any) -> str:
    found = list(
        dict.fromkeys(_forms(Annotated[field.annotation, *field.metadata] if field.metadata else field.annotation))
    )
    return " or ".join(found)


def _forms(hint: Any, metadata: tuple[Any, ...] = ()) -> Iterator[str]:
    """In words, every form that a type hint allows."""
    origin, arguments = get_origin(hint), get_args(hint)
    kinds = [one.kind for one in metadata if hasattr(one, "kind")]
    enums = [one.json_schema for one in metadata if hasattr(one, "json_schema")]
    if kinds:
        yield f"{kinds[0].name} ({_unit(kinds[0].unit)})" if kinds[0].dimensions else "any quantity"
    elif enums:
        yield " or ".join(f"`{one}`" for one in enums[0].get("enum", enums[0].get("examples", [])))
    elif origin is Annotated:
        yield from _forms(arguments[0], hint.__metadata__)
    elif origin is Literal:
        yield " or ".join(f"`{one}`" for one in arguments)
    elif origin is tuple:
        inside = [next(_forms(one)) for one in arguments if one is not Ellipsis]
        yield "list of " + inside[0] if len(set(inside)) == 1 else f"[{', '.join(inside)}]"
    elif isinstance(origin, type) and "Mapping" in origin.__name__:
        yield "by name: " + " or ".join(_forms(arguments[1]))
    elif arguments:
        for one in arguments:
            yield from _forms(one, ())
    elif isinstance(hint, type) and issubclass(hint, BaseModel):
        yield f"[{hint.__name__}](#{hint.__name__.lower()})"
    elif hint is bool:
        yield "`true` or `false`"
    elif hint is str:
        yield "text"


def _default(field: Any) -> str:
    from trunnion.model.quantity import Quantity

    value = field.default
    if value is PydanticUndefined:
        return "must be given" if field.is_required() else ""
    if isinstance(value, Quantity):
        return str(value.source)
    if isinstance(value, bool):
        return str(value).lower()
    return _code(value) if isinstance(value, (str, int)) and value != "" else ""


def gallery() -> str:
    """The entries of the gallery; those whose report a page shows link to it."""
    pages = "".join(path.read_text("utf-8") for path in DOCS.rglob("*.md"))
    reports = set(re.findall(r"figures/([\w-]+)/report\.html", pages))
    return _gallery().page(_beside("figures").kept, reports, TEXT_ONLY)


TABLES: dict[str, Callable[..., str]] = {
    "results": results_table,
    "sweeps": sweeps_table,
    "plays": plays_table,
    "tolerances": tolerances_table,
    "allocations": allocations_table,
    "identification": identification_table,
    "measures": measures_table,
    "distributions": distributions_table,
    "cost-models": costs_table,
    "assembling": assembling_table,
    "comparisons": comparisons_table,
    "statuses": status_table,
    "laws": laws_table,
    "motion": motion_table,
    "pairs": pairs_table,
    "groups": groups_table,
    "plots": plots_table,
    "formats": formats_table,
    "codes": codes_table,
    "units": units_table,
    "command-line": command_line,
    "public-names": public_names,
    "section": section,
    "gallery": gallery,
}
