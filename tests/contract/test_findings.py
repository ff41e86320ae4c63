"""What the sources keep to: findings have codes and figures, kernels know no engine."""

import ast
import json
import re
from pathlib import Path

import pytest

import trunnion
from trunnion.errors import Finding, Severity
from trunnion.results.attributes import finding_rows

# place of the code
MAKERS = {
    "Finding.note": 0, "Finding.warning": 0, "Finding.error": 0, "Finding.weighed": 1, "draft.note": 0, "draft.warn": 0,
}  # fmt: skip


def made():
    """Every call that makes a finding with a code: the module, the place of the code, the call."""
    for path in sorted(Path(trunnion.__file__).parent.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Call) and (place := MAKERS.get(ast.unparse(node.func))) is not None:
                yield path.name, place, node


def test_every_code_is_written_out():
    """So that the list of codes in the manual, which is read of the source, is whole."""
    calls = [(file, call.args[place], call) for file, place, call in made() if file not in ("errors.py", "draft.py")]
    assert len(calls) > 100
    for file, code, call in calls:
        assert isinstance(code, ast.Constant), f"{file}:{call.lineno}"
        assert re.fullmatch(r"[a-z_]+(\.[a-z_]+){1,2}", str(code.value)), code.value


@pytest.mark.parametrize("severity", Severity)
def test_a_finding_has_code_place_and_figures(severity):
    make = {Severity.NOTE: Finding.note, Severity.WARNING: Finding.warning, Severity.ERROR: Finding.error}[severity]
    finding = make("contact.lost", "loads.F", "this load supplies 2 J", "leave it out", work=2.0)
    assert (finding.code, finding.where, finding.severity) == ("contact.lost", "loads.F", severity)
    assert str(finding) == f"{severity}: loads.F: this load supplies 2 J — leave it out"
    assert finding.figures == {"work": 2.0}
    assert finding == Finding.weighed(severity, "contact.lost", "loads.F", finding.what, finding.remedy, work=2.0)


def test_figures_can_be_written_as_json():
    import numpy as np

    finding = Finding.note("a.b", "", "x", condition=np.inf, count=np.int64(3), work=np.float64(0.5))
    assert type(finding.figures["count"]) is int
    row = json.loads(json.dumps(finding_rows([finding]), allow_nan=False))[0]
    assert row["figures"] == {"condition": None, "count": 3, "work": 0.5}


def test_what_was_put_in_has_a_code_by_its_section():
    codes = [Finding("is wrong", where).code for where in ("links.crank.mass", "--kind", "parameter x", "")]
    assert codes == ["input.links", "input.kind", "input.parameter", "input.file"]


SOURCE = Path(__file__).parents[2] / "src" / "trunnion"
KERNELS = [
    path.relative_to(SOURCE)
    for folder in ("algebra", "joints", "groups", "solve")
    for path in sorted((SOURCE / folder).rglob("*.py"))
]
ENTRANCES = {Path("solve/walk_kernel.py"), Path("solve/row_code.py")}  # where a walk goes to an engine
VOCABULARY = Path("algebra/namespace.py")
RECORDED = {"Traced", "Recorded", "UntraceableError"}


@pytest.mark.parametrize("path", [path for path in KERNELS if path not in ENTRANCES], ids=str)
def test_a_kernel_knows_no_engine(path):
    for node in ast.walk(ast.parse((SOURCE / path).read_text("utf-8"))):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import | ast.ImportFrom) else []
        modules = [node.module or "", *names] if isinstance(node, ast.ImportFrom) else names
        assert not any(module.startswith("trunnion.engines") for module in modules), f"{path}:{node.lineno}"
        used = {*names, getattr(node, "id", ""), getattr(node, "attr", "")}
        assert path == VOCABULARY or not used & RECORDED, f"{path}:{node.lineno} asks whether numbers are recorded"
