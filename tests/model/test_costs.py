"""What tolerances and plays cost: formulas, processes by IT grade, options; and how that can be stated wrongly."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from varied import VARIED

from trunnion.errors import MechanismError, Severity
from trunnion.joints.fits import GRADES, limits, standard_tolerance
from trunnion.model.checks.check import check_model
from trunnion.model.mechanism import Mechanism
from trunnion.model.tolerance_parts import COST_MODELS
from trunnion.model.tolerances import FORMULA, Price

Mistake = Callable[..., None]
EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def varied(tmp_path: Path) -> Mechanism:
    path = tmp_path / "varied.yaml"
    path.write_text(VARIED, encoding="utf-8")
    return Mechanism.read(path)


def test_prices(varied: Mechanism) -> None:
    """In the order of the file, in SI; without that of a number that varies as measured."""
    found = {one.path: one for one in varied.prices()}
    assert list(found) == [f"dimensions.{name}" for name in ("AB", "BC", "CD", "AD")] + ["joints.A.clearance"]
    assert found["dimensions.AB"] == Price(
        "dimensions.AB",
        model="power",
        parameters={"A": 0.0, "B": 1.0, "k": 0.45, "unit": 1e-3},
        least=5e-6,
        most=1e-4,
        group="bores",
    )
    assert found["dimensions.BC"].parameters == {"A": 1.0, "B": 20.0, "k": 30.0, "unit": 1e-3}
    assert (found["dimensions.BC"].least, found["dimensions.BC"].most) == (0.0, np.inf)
    play = found["joints.A.clearance"]
    assert (play.play, play.model, play.parameters["unit"]) == (True, "power", 1.0)


def test_choices_are_from_the_cheapest_on(varied: Mechanism) -> None:
    found = {one.path: one.choices for one in varied.prices()}
    grades = [(one.name, one.tolerance, one.cost) for one in found["dimensions.CD"]]
    assert grades == [("IT8", 23e-6, 6.0), ("IT7", 15e-6, 9.0)]  # of 70 mm: IT7 30 µm, IT8 46 µm
    ways = [(one.name, one.tolerance, one.cost) for one in found["dimensions.AD"]]
    assert ways == [("milled", 5e-5, 3.0), ("ground", 1e-5, 9.0)]


def test_a_price_of_the_defaults_is_one_of_each_joint(varied: Mechanism) -> None:
    data = varied.data()
    data["costs"] = {"joint_defaults.friction.coefficient": {"model": "power", "B": 1, "k": 1}}
    found = [one.path for one in Mechanism(**data).prices()]
    assert found == [f"joints.{name}.friction.coefficient" for name in "BCD"]


@pytest.mark.parametrize("grade", GRADES)
def test_the_width_of_a_grade(grade: int) -> None:
    """From limit to limit, of a hole H likewise; the row of the table by ISO 286 at 100 mm."""
    lower, upper = limits(0.1, f"H{grade}")
    assert standard_tolerance(0.1, grade) == pytest.approx(upper - lower, abs=1e-15)
    assert standard_tolerance(0.1, grade) == pytest.approx(GRADES[grade][7] * 1e-6, abs=1e-15)


def test_bought_by_the_grade() -> None:
    mechanism = Mechanism.read(EXAMPLES / "fourbar-by-grades.yaml")
    prices = {one.path: one for one in mechanism.prices()}
    assert [one.name for one in prices["dimensions.l1"].choices] == ["IT11", "IT10", "IT9", "IT8", "IT7", "IT6"]
    assert {one.group for one in prices.values() if one.play} == {"pins"}
    chosen = mechanism.with_tolerances({one.path: one.choices[0].tolerance for one in prices.values()})
    assert chosen.parameters()["joints.B.pin.clearance"] == 20e-6
    assert {one.path: one.upper for one in chosen.tolerated()}["dimensions.l1"] == pytest.approx(110e-6)


def test_the_keys_of_a_formula_are_those_of_its_model() -> None:
    costs = pytest.importorskip("trunnion.statistics.costs")
    assert set(costs.COST_MODELS) == set(COST_MODELS)
    for one in costs.COST_MODELS.values():
        assert set(one.parameters) == {*FORMULA, "unit"}


C = VARIED.splitlines().index("costs:") + 2  # line of the first cost
CASES = [
    ("model: power, B: 1, k: 0.45", "B: 1, k: 0.45", C, "costs.AB", "states no cost", "model: power"),
    ("model: power, B: 1, k: 0.45", "model: power, process: boring, B: 1, k: 1", C, "costs.AB", "model and process",
     ""),
    ("model: power, B: 1, k: 0.45", "model: powr, B: 1, k: 0.45", C, "costs.AB.model", "'powr' is not a cost", "power"),
    ("model: power, B: 1, k: 0.45", "model: power, k: 0.45", C, "costs.AB", "'B' is missing", "A + B/(t/unit)^k"),
    ("model: power, B: 1, k: 0.45", "model: power, B: -1, k: 0.45", C, "costs.AB.B", "wider tolerance would cost", "0"),
    ("model: power, B: 1, k: 0.45", "model: power, B: 1, k: 0", C, "costs.AB.k", "is 0", "above 0"),
    ("model: power, B: 1, k: 0.45", "model: power, B: 1 mm, k: 1", C, "costs.AB.B", "a length where a number", "0.1"),
    ("k: 0.45, unit: mm", "k: 0.45", C, "costs.AB", "states no unit", "unit: mm"),
    ("k: 0.45, unit: mm", "k: 0.45, unit: kg", C, "costs.AB.unit", "'kg' is the unit of a mass", "length"),
    ("k: 0.45, unit: mm", "k: 0.45, unit: mmm", C, "costs.AB.unit", "'mmm' is not known", "mm"),
    ("least: 5 um", "least: 5 deg", C, "costs.AB.least", "an angle where a length", "60 mm"),
    ("least: 5 um", "least: 1 mm", C, "costs.AB.least", "above the most", "exchange"),
    ("least: 5 um", "least: -1 mm", C, "costs.AB.least", "not negative", "above 0"),
    ("most: 2 * t", "most: 2 * tt", C, "costs.AB.most", "'tt', which is not one of", "'t'"),
    ("  AB: {model", "  XY: {model", C, "costs.XY", "no number named 'XY'", "'AB'"),
    ("  AB: {model", "  t: {model", C, "costs.t", "'dimensions.t' has no tolerance", "as a start"),
    ("  A.clearance: {model", "  D.clearance: {model", C + 4, "costs.D.clearance", "states no clearance", "clearance:"),
    ("  A.clearance: {model", "  C.clearance: {model", C + 4, "costs.C.clearance", "the fit 12 mm H7/g6", "state pin"),
    ("  A.clearance: {model", "  B.pin.clearance: {model", C + 4, "costs.B.pin", "has no tolerance", "joints.B.clear"),
    ("  A.clearance: {model", "  AB.x: 1\n  A.clearance: {model", C + 4, "costs.AB.x", "not a group", ""),
    ("  A.clearance: {model", "  dimensions.AB: {model", C + 4, "costs.dimensions.AB", "are the same", "keep one"),
    ("model: power, B: 1, k: 1", "process: boring", C + 4, "costs.A.clearance.process", "a play has no IT", "options"),
    ("{process: boring}", "{process: borring}", C + 2, "costs.CD.process", "no process 'borring'", "'boring'"),
    ("{process: boring}", "{process: boring, B: 1}", C + 2, "costs.CD.B", "no effect on a choice", "model"),
    ("{process: boring}", "{process: boring, group: bores}", C, "costs.AB.group", "has formulas and choices", "same"),
    ("IT7: 9", "IT17: 9", C + 6, "processes.boring", "'IT17' is no IT grade", "1 to 16"),
    ("IT7: 9", "fine: 9", C + 6, "processes.boring", "'fine' is no IT grade", "1 to 16"),
    ("IT7: 9", "IT7: 9 mm", C + 6, "processes.boring", "a length where a number", "0.1"),
    ("tolerance: t, cost: 3", "tolerance: 0, cost: 3", C + 3, "options.milled.tolerance", "has a tolerance of 0", ""),
    ("tolerance: t, cost: 3", "cost: 3", C + 3, "costs.AD.options.milled", "'tolerance' is missing", "add"),
    ("tolerance: t, cost: 3", "tolerance: 1 kg, cost: 3", C + 3, "milled.tolerance", "a mass where a length", "mm"),
    ("CD: 70 mm ±", "CD: 700 mm ±", C + 2, "costs.CD.process", "the size 700 mm is not in the tables", "options"),
]  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_one_mistake_is_found_where_it_is(mistake: Mistake, case: tuple[Any, ...]) -> None:
    mistake(VARIED, case)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"AD": {"group": "g"}, "CD": {"group": "g"}}, "'g' \\(CD, AD\\) has no choice in common"),
        ({"BC": {"group": "bores", "least": "1 mm"}}, "bounds of the group 'bores' \\(AB, BC\\) exclude one another"),
    ],
)
def test_members_of_a_group_can_be_alike(varied: Mechanism, changes: dict[str, dict[str, str]], said: str) -> None:
    data = varied.data()
    for name, change in changes.items():
        data["costs"][name] |= change
    with pytest.raises(MechanismError, match=said):
        Mechanism(**data)


def test_a_cost_of_what_varies_as_measured_is_doubted(varied: Mechanism, tmp_path: Path) -> None:
    path = tmp_path / "sample.csv"
    path.write_text("0.01\n0.02\n", encoding="utf-8")
    changed = varied.with_samples("AB", path)
    assert "dimensions.AB" not in {one.path for one in changed.prices()}
    found = [one for one in check_model(changed) if one.where == "costs.AB"]
    assert [one.severity for one in found] == [Severity.WARNING]


def test_a_play_of_a_radius_is_not_for_sale() -> None:
    data = Mechanism.read(EXAMPLES / "fourbar-by-grades.yaml").data()
    data["joints"]["B"]["pin"] = {"radius": "6 mm", "hole_radius": "6.01 mm"}
    with pytest.raises(MechanismError, match=r"'B.clearance' cannot have a cost: its play is derived from the radii"):
        Mechanism(**data)
