"""Tables of what results hold: variables, statuses, codes of findings, plots, formats."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import trunnion
from page_tables.cells import code, rows_of, unit

UNITS = {
    "effort": "N m or N", "coordinate": "rad or m", "rate": "rad/s or m/s", "spring_force": "N or N m",
    "spring_elongation": "m or rad", "transmission_error": "rad or m", "measure": "of the measure",
    "sensitivity": "of the measure, over m", "parameter": "of the parameter", "ratio": "one by the other",
    "drive": "deg, mm, s", "saving": "1 by that of the measure", "curve": "of the curve",
    "curve ratio": "curve by parameter",
}  # fmt: skip
PARTS = {"": "", "bearings": "where sizes are stated", "seats": "with a seat", "errors": "with an error"}


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
            rows.append((code(name), there, ", ".join((*one.dims, "position")), _unit(one), one.long_name))
    rows.append((code("efficiency"), "", "", "1", "useful work over drive work of the cycle"))
    rows.append((code("efficiency_ideal"), PARTS["errors"], "", "1", "efficiency of the mechanism without errors"))
    return rows_of(("variable", "only in", "dimensions", "unit", "meaning"), rows)


def _in_order(first: list[str], second: list[str]) -> list[str]:
    """The names of both lists, those of the second alone behind the one they follow there."""
    merged = list(first)
    for before, name in zip([None, *second], second, strict=False):
        if name not in merged:
            merged.insert(merged.index(before) + 1 if before else 0, name)
    return merged


def moving_table() -> str:
    """Every variable of a motion in time beside those of a cycle."""
    from trunnion.dynamics.result import MOTION

    return _described("dimensions", MOTION)


def _described(dimensions: str, variables: Mapping[str, Any]) -> str:
    rows = [(code(name), ", ".join(one.dims), _unit(one), one.long_name) for name, one in variables.items()]
    return rows_of(("variable", dimensions, "unit", "meaning"), rows)


def _unit(variable: Any) -> str:
    """The unit of a variable, or what the word in its place means."""
    return UNITS.get(variable.units) or unit(variable.units)


def sweeps_table() -> str:
    """Every figure of a sweep."""
    from trunnion.studies.sweep_grid import FIGURES

    return _described("dimension before the swept ones", FIGURES)


def plays_table() -> str:
    """Every variable of the play of joints."""
    from trunnion.studies.play import VARIABLES

    return _described("dimension", VARIABLES)


def tolerances_table() -> str:
    """Every variable of a tolerance analysis."""
    from trunnion.studies.tolerance.result import VARIABLES

    return _described("dimensions", VARIABLES)


def identification_table() -> str:
    """Every variable of an identification."""
    from trunnion.rig.identification.identify import VARIABLES

    return _described("dimension", VARIABLES)


def allocations_table() -> str:
    """Every variable of an allocation beside those of the tolerance analysis."""
    from trunnion.studies.allocation.result import VARIABLES

    return _described("dimensions", VARIABLES)


def comparisons_table() -> str:
    """Every variable of a comparison with a measurement."""
    from trunnion.rig.comparison import VARIABLES

    told = {"": "of the channel", "set": "of what is set", "drive": "rad, m or s"}
    rows = [
        (code(name), ", ".join(one.dims), told.get(one.units) or unit(one.units), one.long_name)
        for name, one in VARIABLES.items()
    ]
    return rows_of(("variable", "dimensions", "unit", "meaning"), rows)


def assembling_table() -> str:
    """Every variable of whether a mechanism goes together."""
    from trunnion.studies.assembly import FIGURES

    return _described("dimensions", FIGURES)


def status_table() -> str:
    """Every status."""
    from trunnion.errors import Status

    shown = {True: "all", False: "motion only"}
    rows = [
        (
            int(one),
            code(one.name.lower()),
            "nothing"
            if one is Status.NOT_ASSEMBLED
            else "positions only"
            if one is Status.SINGULAR
            else shown[one.solved],
            one.text,
        )
        for one in Status
    ]
    return rows_of(("code", "name", "numbers given", "meaning"), rows)


def plots_table() -> str:
    """Every plot."""
    from trunnion.views.cycle import PLOTS

    return rows_of(
        ("kind", "shows"), [(code(name), (inspect.getdoc(f) or "").splitlines()[0]) for name, f in PLOTS.items()]
    )


def formats_table() -> str:
    """Every format a result is written in."""
    from trunnion.results.save import FORMATS

    rows = [
        (code(name), f"`pip install 'trunnion[{extra}]'`" if extra else "") for name, (_, _, extra) in FORMATS.items()
    ]
    return rows_of(("extension", "needs"), rows)


def codes_table() -> str:
    """The codes of findings about results, with the sentence that the code writes; … where a figure is filled in."""
    rows: dict[str, tuple[str, str]] = {}
    for file in sorted(Path(trunnion.__file__).parent.rglob("*.py")):
        rows |= _codes_in(file)
    return rows_of(("code", "is", "says"), [(code(name), *row) for name, row in sorted(rows.items())])


KINDS = {".note": "note", ".warn": "warning", ".warning": "warning", ".error": "error"}  # by the method that makes it


def _codes_in(file: Path) -> dict[str, tuple[str, str]]:
    """Severity and sentence of the findings that a module makes, by their code."""
    rows = {}
    functions = [node for node in ast.walk(ast.parse(file.read_text("utf-8"))) if isinstance(node, ast.FunctionDef)]
    for function in functions:
        weights = sorted({
            node.attr.lower() for node in ast.walk(function)
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "Severity"
        })  # fmt: skip
        for call in ast.walk(function):
            if not isinstance(call, ast.Call):
                continue
            maker = ast.unparse(call.func)
            named = {one.arg: one.value for one in call.keywords}
            if maker == "Finding" and isinstance(name := named.get("code"), ast.Constant):
                text, kind = call.args[0], " or ".join(weights) or "error"
            elif maker == "Finding.weighed" and isinstance(name := call.args[1], ast.Constant):
                text, kind = call.args[3], " or ".join(weights)
            elif maker.endswith(tuple(KINDS)) and len(call.args) > 2 and isinstance(name := call.args[0], ast.Constant):
                text, kind = call.args[2], KINDS[f".{maker.rpartition('.')[2]}"]
            else:
                continue
            said = _text(text, function)
            rows[str(name.value)] = (kind, said if said.strip("… :;,.") else "")
    return rows


def _text(node: ast.expr, function: ast.FunctionDef) -> str:
    """A string of the code, … for what is filled in; of a name the last that it is set to before."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(str(part.value) if isinstance(part, ast.Constant) else "…" for part in node.values)
    if isinstance(node, ast.Name):
        said = ""
        settings = [one for one in ast.walk(function) if isinstance(one, (ast.Assign, ast.AugAssign))]
        for setting in sorted(settings, key=lambda one: one.lineno):
            target = setting.targets[0] if isinstance(setting, ast.Assign) else setting.target
            if setting.lineno < node.lineno and isinstance(target, ast.Name) and target.id == node.id:
                said = (
                    _text(setting.value, function)
                    if isinstance(setting, ast.Assign)
                    else said + _text(setting.value, function)
                )
        return said
    return "…"
