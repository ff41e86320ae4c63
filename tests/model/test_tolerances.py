"""What varies and how, and what it costs: limits, distributions, correlations, formulas, processes, options."""

import re
from pathlib import Path

import numpy as np
import pytest
from model_samples import VARIED
from pydantic_core import PydanticCustomError

from trunnion.algebra.dual import Dual, derivative
from trunnion.errors import MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.model.rewrite import rewrite_mechanism
from trunnion.model.tolerance_parts import COST_MODELS, DISTRIBUTIONS, OPTIONS, Limits, Variation
from trunnion.model.tolerances import FORMULA, Price
from trunnion.statistics import distributions

DEG = np.pi / 180


def of(mechanism):
    return {one.path: one for one in mechanism.tolerated()}


# limits
@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("±0.05 mm", (-5e-5, 5e-5)), ("± 50 um", (-5e-5, 5e-5)), ("+/-0.05 mm", (-5e-5, 5e-5)),
        ("+-0.05 mm", (-5e-5, 5e-5)), ("0.05 mm", (-5e-5, 5e-5)), (5e-5, (-5e-5, 5e-5)),
        ("+0.02/-0.01 mm", (-1e-5, 2e-5)), ("+0.02 mm / -10 um", (-1e-5, 2e-5)), ("-0.01/+0.02 mm", (-1e-5, 2e-5)),
        ("+0.02/0 mm", (0.0, 2e-5)), ("0/-0.05 mm", (-5e-5, 0.0)), ("-7/−20 um", (-2e-5, -7e-6)),
        ("+0.02/-0.01", (-0.01, 0.02)), ("±0.1 deg", (-0.1 * DEG, 0.1 * DEG)), ("±2 * 0.05 mm", (-1e-4, 1e-4)),
    ],
)  # fmt: skip
def test_limits_as_written(text, expected):
    found = Limits.read(text)
    assert (found.lower.evaluate(), found.upper.evaluate()) == pytest.approx(expected, rel=1e-15)
    assert found.source == text
    assert Limits.read(found) is found


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("+0.02 mm", "sign on one side only"), ("-0.02 mm", "sign on one side only"),
        ("±+0.02 mm", "sign on one side only"), (-0.1, "to either side has no sign"),
        ("0.1 mm ± 0.05 mm", "tolerance of their own"), ("±0.05 furlongz", "'furlongz' is not known"),
        ("+0.02 mm/-0.01 oddunit", "'oddunit' is not known"), (True, "a yes/no value"), ([1, 2], "is a list"),
        ("±", "cannot be read"),
    ],
)  # fmt: skip
def test_what_are_no_limits(text, what):
    with pytest.raises(PydanticCustomError) as error:
        Limits.read(text)
    assert what in str(error.value)


# what varies
VARIES = {
    "dimensions.AB": (0.03, -5e-5, 5e-5, "truncated", {"cp": 1.2}),
    "dimensions.AD": (0.1, -1e-5, 2e-5, "truncated", {"cp": 1.2}),
    "dimensions.BC": (0.09, -5e-5, 5e-5, "truncated", {"cp": 1.33, "cpk": 1.0, "shift": 1e-5}),
    "dimensions.CD": (0.07, -5e-5, 5e-5, "uniform", {}),
    "links.crank.mass": (0.2, -0.005, 0.005, "truncated", {"cp": 1.2}),
    "joints.A.friction.coefficient": (0.1, -0.03, 0.03, "truncated", {"cp": 1.2}),
    "joints.B.friction.coefficient": (0.2, -0.01, 0.02, "triangular", {"mode": 0.005}),
    "joints.A.pin.clearance": (2e-5, -3e-6, 1e-5, "sample", {"values": (1e-5, -3e-6, 2e-6)}),
    "joints.B.misalignment.offset": (0.0, 0.0, 2e-5, "truncated", {"cp": 1.2}),
    "joints.B.seat.xi": (30 * DEG, -np.pi, np.pi, "direction", {}),
    "joints.C.pin.radius": (0.00599425, -2.75e-6, 2.75e-6, "truncated", {"cp": 1.2}),
    "drivers.A.speed": (2 * np.pi, -np.pi / 30, np.pi / 30, "beta", {"alpha": 2.0, "beta": 3.0}),
}


def test_every_number_that_varies_within_its_limits_and_how(varied):
    tolerated, names = of(varied), list(varied.parameters())
    assert list(tolerated) == sorted(tolerated, key=names.index)
    others = {"joints.C.pin.hole_radius", "joints.C.friction.coefficient", "joints.D.friction.coefficient"}
    assert set(tolerated) == {*VARIES, *others}
    for path, (nominal, lower, upper, distribution, options) in VARIES.items():
        found = tolerated[path]
        assert (found.nominal, found.lower, found.upper) == pytest.approx((nominal, lower, upper), rel=1e-12)
        assert found.half_width == pytest.approx((upper - lower) / 2, rel=1e-12)
        assert found.distribution == distribution
        assert found.options.keys() == options.keys()
        assert all(found.options[key] == pytest.approx(value, rel=1e-15) for key, value in options.items())
        assert found.direction == ("joints.B.misalignment.offset_towards" if path.endswith("offset") else "")


def test_the_table_of_distributions_is_that_of_the_statistics():
    """The model knows the names, so that reading a file does not import the mathematics of them."""
    declared = {name: tuple(one.parameters) for name, one in distributions.DISTRIBUTIONS.items()}
    assert declared == DISTRIBUTIONS
    assert {key for keys in DISTRIBUTIONS.values() for key in keys} == set(OPTIONS) <= Variation.model_fields.keys()


# correlation
def test_correlation(varied):
    matrix, paths = varied.correlation(), list(of(varied))
    expected = np.eye(len(paths))
    pairs = {("dimensions.AB", "dimensions.BC"): 0.5}
    friction = [f"joints.{name}.friction.coefficient" for name in "BCD"]  # A has its own, and does not follow
    pairs |= {(a, b): 0.9 for a in friction for b in friction if a < b}
    for (a, b), value in pairs.items():
        i, j = paths.index(a), paths.index(b)
        expected[i, j] = expected[j, i] = value
    np.testing.assert_array_equal(matrix, expected)


# deviations
def test_a_deviation_is_added_and_passed_on():
    """A number that follows from another goes on to do so, unlike one that is replaced."""
    mechanism = Mechanism(
        dimensions={"a": "10 mm ± 0.1 mm", "b": "2 * a ± 0.05 mm"},
        errors={"b": "1 mm"},
        links={"ground": {"points": {"A": [0, 0]}}, "arm": {"points": {"A": [0, 0], "P": ["b", "a"]}}},
        joints={"A": {"type": "revolute", "links": ["ground", "arm"]}},
        drivers={"A": {"speed": 1}},
    )
    values = mechanism.parameters(deviations={"a": 1e-3, "b": 1e-4, "arm.points.P.x": 1e-5})
    assert values["dimensions.b"] == pytest.approx(0.0231, abs=1e-15)
    assert values["links.arm.points.P.x"] == pytest.approx(0.02311, abs=1e-15)
    assert values["links.arm.points.P.y"] == pytest.approx(0.011, abs=1e-15)
    assert mechanism.parameters({"b": 0.05}, {"b": 1e-4})["links.arm.points.P.x"] == pytest.approx(0.0501, abs=1e-15)
    samples = mechanism.parameters(deviations={"a": np.array([[0.0], [1e-3]])})
    assert samples["links.arm.points.P.x"].ravel() == pytest.approx([0.021, 0.023], abs=1e-15)
    assert derivative(mechanism.parameters(deviations={"a": Dual(0.0, 1.0)})["links.arm.points.P.x"]) == 2
    assert mechanism.parameters(deviations={}) == mechanism.parameters()


def test_a_deviation_of_a_default_is_of_every_joint(varied):
    values = varied.parameters(deviations={"joint_defaults.friction.coefficient": 0.05, "C.friction.coefficient": 0.01})
    found = [values[f"joints.{name}.friction.coefficient"] for name in "ABCD"]
    assert found == pytest.approx([0.1, 0.25, 0.26, 0.25], rel=1e-14)


# another model
def test_other_tolerances_are_written(varied, tmp_path):
    new = {"AB": 1.25e-5, "AD": 2e-5, "BC": 3e-5, "links.crank.mass": 0.01, "C.friction.coefficient": 0.001}
    changed = varied.with_tolerances({**new, "joints.A.clearance": 3e-5})
    changed.write(tmp_path / "model.yaml")
    again = Mechanism.read(tmp_path / "model.yaml")
    assert again == changed
    assert again.digest == changed.digest
    found = of(again)
    assert found["dimensions.AB"].upper == 1.25e-5
    assert (found["dimensions.AD"].lower, found["dimensions.AD"].upper) == pytest.approx((-1.5e-5, 2.5e-5))
    assert found["dimensions.BC"].options == {"cp": 1.33, "cpk": 1.0, "shift": 1e-5}
    assert found["joints.C.friction.coefficient"].distribution == "triangular"
    assert found["joints.D.friction.coefficient"] == of(varied)["joints.D.friction.coefficient"]
    assert again.parameters()["joints.A.pin.clearance"] == 3e-5
    assert list(again.variations)[: len(varied.variations)] == list(varied.variations)


def test_tolerances_by_name_and_text(varied):
    new = {"AB": "±0.1 mm", "dimensions.BC": "±1 um", "AD.cp": 1.5, "rocker.mass": 0.1}
    limits = {f"tolerances.{name}": value for name, value in new.items()}
    changed = varied.with_values({**limits, "measures.theta.limit": "0.3 deg"})
    found = of(changed)
    assert found["dimensions.AB"].upper == 1e-4
    assert found["dimensions.BC"].upper == 1e-6
    assert found["dimensions.BC"].options["cpk"] == 1.0
    assert (found["dimensions.AD"].upper, found["dimensions.AD"].options["cp"]) == (2e-5, 1.5)
    assert found["links.rocker.mass"].upper == 0.1
    assert changed.parameters()["measures.theta.limit.lower"] == pytest.approx(-0.3 * DEG)
    with pytest.raises(MechanismError, match="a limit is stated with the other"):
        varied.with_values({"measures.theta.limit.lower": "0.3 deg"})
    with pytest.raises(MechanismError, match="no number named 'XY'"):
        varied.with_values({"tolerances.XY": "0.3 deg"})


def test_without_friction_nothing_varies_that_is_not_there(varied):
    ideal = varied.with_friction("off")
    assert not [path for path in of(ideal) if "friction" in path]
    assert [one.of for one in ideal.correlations] == [("AB", "BC")]
    assert "joints.B.seat.xi" not in of(varied.with_seats("loaded"))
    assert [one.of for one in varied.with_friction("coulomb").correlations] == [one.of for one in varied.correlations]
    assert not varied.with_values({"errors.A.friction.coefficient": 0.01}).with_friction("off").errors


# measured samples
@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0.01\n-0.02\n0.005\n", (0.01, -0.02, 0.005)),
        ("deviation [um]\n10\n\n# a remark\n-3,5\n2;\n", (1e-5, -3.5e-6, 2e-6)),
        ('"d [mm]"\n"0.01"\n"−0.02"\n', (1e-5, -2e-5)),
        ("d\r\n1e-5\r\n2e-5\r\n", (1e-5, 2e-5)),
    ],
)
def test_a_sample_from_a_file(varied, tmp_path, text, expected):
    path = tmp_path / "sample.csv"
    path.write_text(text, encoding="utf-8")
    changed = varied.with_samples("CD", path)
    found = of(changed)["dimensions.CD"]
    assert (found.distribution, found.options["values"]) == ("sample", pytest.approx(expected, rel=1e-15))
    assert (found.lower, found.upper) == pytest.approx((-5e-5, 5e-5))  # as stated
    changed.write(tmp_path / "model.yaml")
    assert Mechanism.read(tmp_path / "model.yaml") == changed
    clearance = of(varied.with_samples("A.pin.clearance", path))["joints.A.pin.clearance"]
    assert (clearance.lower, clearance.upper) == pytest.approx((min(expected), max(expected)))
    kept = of(varied.with_samples("BC", path))["dimensions.BC"]
    assert (kept.lower, kept.upper) == (-5e-5, 5e-5)


@pytest.mark.parametrize(
    ("name", "half", "what"),
    [
        ("t", 1e-5, "'t' has no tolerance"), ("A.pin.clearance", 1e-5, "varies as measured"),
        ("B.seat.xi", 1e-5, "varies as measured or over a full turn"), ("nothing", 1e-5, "no number named 'nothing'"),
        ("AB", -1e-5, "half width of -1e-05"), ("AB", float("nan"), "half width of nan"),
        ("AB", "0.02", "has no unit"), ("AB", "0.02 deg", "is an angle where a length is needed"),
        ("joints.A.clearance", "+0.02/-0.01 mm", "half width of"),
        ("joints.A.clearance", "-0.02 mm", "half width of '-0.02 mm'"),
        ("joints.A.clearance", "AB / 1000", "is no number with a unit"), ("AB", None, "is empty"),
        ("AB", [1e-5], "is a list"),
    ],
)  # fmt: skip
def test_tolerances_that_cannot_be_replaced(varied, name, half, what):
    with pytest.raises(MechanismError, match=re.escape(what)):
        varied.with_tolerances({name: half})


@pytest.mark.parametrize(
    ("text", "line", "what"),
    [
        ("d [kg]\n1\n2\n", 1, "its unit is that of a mass"),
        ("1; 2\n3; 4\n", 1, "has 2 columns, a sample has 1"), ("0.01\n-0.02\n1e308\n", None, "finite"),
    ],
)  # fmt: skip
def test_a_sample_that_cannot_be_read(varied, tmp_path, text, line, what):
    path = tmp_path / "sample.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(MechanismError) as error:
        varied.with_samples("CD", path)
    finding = error.value.findings[0]
    assert what in finding.what
    assert finding.remedy
    assert line is None or (finding.file, finding.line) == (str(path), line)


# limits that stand with the number
def test_other_limits_stand_in_tolerances(varied):
    """In the entry of the number, or else in a new one; the number itself then stands alone."""
    data = varied.data()
    data["joints"]["A"] = {**data["joints"]["A"], "friction": "0.1 ± 0.02"}
    data["joint_defaults"] = {**data["joint_defaults"], "friction": "0.2 ± 0.03"}
    data["tolerances"] = {key: one for key, one in data["tolerances"].items() if "friction" not in key}
    data["correlations"] = []
    one = Mechanism(**data)
    new = {"CD": "±0.0123456 mm", "A.friction.coefficient": 0.01, "B.friction.coefficient": 0.02, "AB": "7 um"}
    changed = one.with_tolerances(new, 4).data()
    assert changed["dimensions"]["CD"] == "70 mm"
    assert changed["joints"]["A"]["friction"] == "0.1"
    assert changed["joint_defaults"] == data["joint_defaults"]
    assert changed["tolerances"]["joints.B.friction.coefficient"] == "±0.02"
    assert changed["tolerances"]["CD"] == {"distribution": "uniform", "limits": "±0.01234 mm"}
    assert changed["tolerances"]["AB"] == "±0.007 mm"
    own = {f"joints.{name}.friction.coefficient" for name in "AB"}
    assert set(changed["tolerances"]) == {*data["tolerances"], *own}
    assert Mechanism(**changed).with_tolerances(new, 4).data() == changed


def test_a_model_with_less_in_it_is_rewritten(varied, tmp_path):
    """Entries that went, of a file in one line or another: the file that is written holds the mechanism."""
    (tmp_path / "source.yaml").write_text("# a four-bar\n" + VARIED, encoding="utf-8")
    bare = {key: one for key, one in varied.data().items() if key != "correlations"}
    rewrite_mechanism(Mechanism(**bare), tmp_path / "source.yaml", tmp_path / "bare.yaml")
    assert Mechanism.read(tmp_path / "bare.yaml") == Mechanism(**bare)
    assert (tmp_path / "bare.yaml").read_text("utf-8").startswith("# a four-bar")
    named = varied.with_values({"tolerances.D.friction.coefficient": 0.01, "AB": "31 mm"})
    rewrite_mechanism(named, tmp_path / "source.yaml", tmp_path / "named.yaml")
    assert Mechanism.read(tmp_path / "named.yaml") == named
    assert "AB: 31 mm, BC: 90 mm ± 0.02 mm" in (tmp_path / "named.yaml").read_text("utf-8")


def test_what_is_said_of_a_joint_stands_against_what_is_said_of_all(varied):
    """A joint that follows the defaults in its number may have a tolerance of its own, whichever is said first."""
    names = ("joint_defaults.friction.coefficient", "B.friction.coefficient")
    for order in (names, names[::-1]):
        data = varied.data()
        for key in ("correlations", "costs"):
            data.pop(key, None)
        data["tolerances"] = {name: {"limits": 0.02 if name == names[0] else 0.005} for name in order}
        found = of(Mechanism(**data))
        assert found["joints.B.friction.coefficient"].half_width == pytest.approx(0.005)
        assert found["joints.D.friction.coefficient"].half_width == pytest.approx(0.02)


EXAMPLES = Path(__file__).parents[2] / "examples"


def test_prices(varied):
    """In the order of the file, in SI; without that of a number that varies as measured."""
    found = {one.path: one for one in varied.prices()}
    assert list(found) == [f"dimensions.{name}" for name in ("AB", "BC", "CD", "AD")] + ["joints.A.clearance"]
    parameters = {"A": 0.0, "B": 1.0, "k": 0.45, "unit": 1e-3}
    assert found["dimensions.AB"] == Price("dimensions.AB", False, "power", parameters, 5e-6, 1e-4, "bores")
    assert found["dimensions.BC"].parameters == {"A": 1.0, "B": 20.0, "k": 30.0, "unit": 1e-3}
    assert (found["dimensions.BC"].least, found["dimensions.BC"].most) == (0.0, np.inf)
    play = found["joints.A.clearance"]
    assert (play.play, play.model, play.parameters["unit"]) == (True, "power", 1.0)


def test_choices_are_from_the_cheapest_on(varied):
    found = {one.path: one.choices for one in varied.prices()}
    grades = [(one.name, one.tolerance, one.cost) for one in found["dimensions.CD"]]
    assert grades == [("IT8", 23e-6, 6.0), ("IT7", 15e-6, 9.0)]  # of 70 mm: IT7 30 µm, IT8 46 µm
    ways = [(one.name, one.tolerance, one.cost) for one in found["dimensions.AD"]]
    assert ways == [("milled", 5e-5, 3.0), ("ground", 1e-5, 9.0)]


def test_bought_by_the_grade():
    mechanism = Mechanism.read(EXAMPLES / "fourbar-by-grades.yaml")
    prices = {one.path: one for one in mechanism.prices()}
    assert [one.name for one in prices["dimensions.l1"].choices] == ["IT11", "IT10", "IT9", "IT8", "IT7", "IT6"]
    assert {one.group for one in prices.values() if one.play} == {"pins"}
    chosen = mechanism.with_tolerances({one.path: one.choices[0].tolerance for one in prices.values()})
    assert chosen.parameters()["joints.B.pin.clearance"] == 20e-6
    assert {one.path: one.upper for one in chosen.tolerated()}["dimensions.l1"] == pytest.approx(110e-6)


def test_the_keys_of_a_formula_are_those_of_its_model():
    costs = pytest.importorskip("trunnion.statistics.costs")
    assert set(costs.COST_MODELS) == set(COST_MODELS)
    for one in costs.COST_MODELS.values():
        assert set(one.parameters) == {*FORMULA, "unit"}


def test_a_play_of_a_radius_is_not_for_sale():
    data = Mechanism.read(EXAMPLES / "fourbar-by-grades.yaml").data()
    data["joints"]["B"]["pin"] = {"radius": "6 mm", "hole_radius": "6.01 mm"}
    with pytest.raises(
        MechanismError, match=r"the joint of 'B.clearance' states no clearance — state clearance: 0.02 mm"
    ):
        Mechanism(**data)
