"""Measures in a model file: of what, where, as which figure, within which limits."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from varied import VARIED

from trunnion.errors import MechanismError
from trunnion.model.measure_table import MEASURES, STATISTICS, Measure
from trunnion.model.mechanism import Mechanism, read_mechanism

Mistake = Callable[..., None]
DEG = np.pi / 180


@pytest.fixture
def varied(tmp_path: Path) -> Mechanism:
    path = tmp_path / "varied.yaml"
    path.write_text(VARIED, encoding="utf-8")
    return Mechanism.read(path)


def with_measure(mechanism: Mechanism, **keys: object) -> Mechanism:
    return Mechanism(**{**mechanism.data(), "measures": {"one": keys}})


def test_limits_are_two_numbers(varied: Mechanism) -> None:
    values = varied.parameters()
    found = {path: float(value) for path, value in values.items() if path.startswith("measures.")}  # type: ignore[arg-type]
    assert found == pytest.approx(
        {
            "measures.error.limit.lower": -0.1 * DEG,
            "measures.error.limit.upper": 0.1 * DEG,
            "measures.theta.at": 60 * DEG,
            "measures.theta.limit.lower": -0.1 * DEG,
            "measures.theta.limit.upper": 0.2 * DEG,
            "measures.later.at": 0.1,
            "measures.later.limit.lower": -2e-3,
            "measures.later.limit.upper": 2e-3,
            "measures.peak.at_most": 12.0,
            "measures.swing.over.from": 0.0,
            "measures.swing.over.to": np.pi,
            "measures.swing.limit.lower": -0.05 / 30,
            "measures.swing.limit.upper": 0.05 / 30,
        },
        rel=1e-14,
    )


def test_a_position_is_a_time_if_it_is_stated_as_one(varied: Mechanism) -> None:
    kinds = varied.parameter_kinds()
    assert kinds["measures.theta.at"].name == "angle"
    assert kinds["measures.later.at"].name == "time"
    data = {**varied.data(), "dimensions": {**varied.data()["dimensions"], "when": "0.2 s"}}
    data["measures"] = {"one": {"angle": "rocker", "at": "when / 2"}, "two": {"angle": "rocker", "at": 1.5}}
    kinds = Mechanism(**data).parameter_kinds()
    assert [kinds[f"measures.{name}.at"].name for name in ("one", "two")] == ["time", "angle"]


def test_the_subject_of_a_measure() -> None:
    assert set(MEASURES) < {field.alias or key for key, field in Measure.model_fields.items()}
    one = Measure(**{"effort": "A", "as": "maximum"})  # type: ignore[arg-type]
    assert (one.kind, one.subject, one.statistic, one.reduced) == ("effort", "A", "maximum", False)
    assert Measure(efficiency="cycle").reduced
    assert not Measure(efficiency="instant").reduced
    assert (Measure().kind, Measure().subject, Measure().reduced) == ("", "", False)


@pytest.mark.parametrize("suffix", ["yaml", "json"])
def test_written_as_it_was_read(varied: Mechanism, tmp_path: Path, suffix: str) -> None:
    varied.write(tmp_path / f"model.{suffix}")
    again = read_mechanism(tmp_path / f"model.{suffix}")
    assert again == varied
    assert again.data() == varied.data()
    assert again.data()["measures"]["peak"] == {"effort": "A", "as": "maximum", "at_most": "12 N m"}
    assert again.data()["tolerances"]["AB"] == "±t"
    assert again.digest == varied.digest


KINDS = [
    ({"point": "coupler.C", "axis": "x"}, "length"),
    ({"path_error": "coupler.C"}, "length"),
    ({"straightness": "coupler.C"}, "length"),
    ({"angle": "rocker"}, "angle"),
    ({"rotation": "D"}, "angle"),
    ({"transmission_error": "D"}, "angle"),
    ({"stroke": "D"}, "angle"),
    ({"dead_centre": "D"}, "angle"),
    ({"dead_centre": "D", "as": "place-of-minimum"}, "angle"),
    ({"rate": "D"}, "angular speed"),
    ({"effort": "A"}, "moment"),
    ({"effort": "A", "as": "place-of-maximum"}, "angle"),
    ({"reaction": "C"}, "force"),
    ({"reaction": "C", "axis": "y"}, "force"),
    ({"efficiency": "cycle"}, "number"),
    ({"efficiency": "instant"}, "number"),
    ({"locking_margin": "mechanism"}, "number"),
]


@pytest.mark.parametrize(("keys", "kind"), KINDS)
def test_what_a_measure_gives(varied: Mechanism, keys: dict[str, str], kind: str) -> None:
    """A limit of another kind is a finding."""
    units = {
        "length": "1 um",
        "angle": "1 deg",
        "angular speed": "1 rpm",
        "moment": "1 N m",
        "force": "1 N",
        "number": 0.1,
    }
    good = with_measure(varied, **keys, limit=units[kind], at_most=units[kind])
    assert {one.name for path, one in good.parameter_kinds().items() if path.startswith("measures.")} == {kind}
    with pytest.raises(MechanismError) as error:
        with_measure(varied, **keys, limit="1 kg")
    (finding,) = error.value.findings  # both limits, once
    assert finding.where == "measures.one.limit"
    assert f"'1 kg' is a mass where {'an' if kind[0] == 'a' else 'a'} {kind} is needed" in finding.what


@pytest.mark.parametrize("slides", [{"stroke": "S"}, {"transmission_error": "S"}, {"slide": "S"}])
def test_a_slide_is_a_length(slides: dict[str, str]) -> None:
    mechanism = Mechanism.read(Path(__file__).parents[2] / "examples" / "toleranced-slider-crank.yaml")
    found = with_measure(mechanism, **slides, limit="±0.1 mm")
    assert found.parameter_kinds()["measures.one.limit.upper"].name == "length"


@pytest.mark.parametrize("statistic", STATISTICS)
def test_every_figure_can_be_asked_for(varied: Mechanism, statistic: str) -> None:
    at = {"at": "60 deg"} if statistic == "value" else {"over": ["0 deg", "90 deg"]}
    at |= {"within": ["0 N m", "1 N m"]} if statistic == "dwell" else {}
    assert with_measure(varied, effort="A", **{"as": statistic}, **at).measures["one"].statistic == statistic


M = VARIED.splitlines().index("measures:") + 2  # line of the first measure
CASES = [
    ("{angle: rocker, limit: ±0.1 deg}", "{angle: rocker, rotation: D}", M, "measures.error", "angle and rotation",
     "one"),
    ("{angle: rocker, limit: ±0.1 deg}", "{path_error: rocker.X}", M, "error.path_error", "no point 'rocker.X'", "'"),
    ("{angle: rocker, limit: ±0.1 deg}", "{straightness: C}", M, "error.straightness", "no point 'C'", "link.point"),
    ("{angle: rocker, limit: ±0.1 deg}", "{reaction: E}", M, "measures.error.reaction", "no joint 'E'", "'A'"),
    ("{angle: rocker, limit: ±0.1 deg}", "{dead_centre: E}", M, "measures.error.dead_centre", "no joint 'E'", "'A'"),
    ("{angle: rocker, limit: ±0.1 deg}", "{stroke: E}", M, "measures.error.stroke", "no joint 'E'", "'A'"),
    ("{angle: rocker, limit: ±0.1 deg}", "{efficiency: total}", M, "measures.error.efficiency", "not one", "these"),
    ("{angle: rocker, limit: ±0.1 deg}", "{locking_margin: A}", M, "measures.error.locking_margin", "not one", "these"),
    ("{angle: rocker, limit: ±0.1 deg}", "{reaction: A, axis: z}", M, "measures.error.axis", "no z", "x or y"),
    ("{angle: rocker, limit: ±0.1 deg}", "{stroke: D, axis: x}", M, "measures.error.axis", "axis of a coord", "remove"),
    ("{angle: rocker, limit: ±0.1 deg}", "{stroke: D, at: 1 deg}", M, "measures.error.at", "of a range", "over"),
    ("{angle: rocker, limit: ±0.1 deg}", "{stroke: D, as: rms}", M, "measures.error.as", "one number of a range",
     "rem"),
    ("{angle: rocker, limit: ±0.1 deg}", "{dead_centre: D, as: rms}", M, "measures.error.as", "one number", "place-of"),
    ("{angle: rocker, limit: ±0.1 deg}", "{efficiency: cycle, over: [0 deg, 9 deg]}", M, "error.over", "all of it",
     "r"),
    ("{angle: rocker, limit: ±0.1 deg}", "{angle: rocker, as: value}", M, "measures.error.as", "a position", "at: 60"),
    ("{angle: rocker, limit: ±0.1 deg}", "{angle: rocker, as: most}", M, "measures.error.as", "not one of 'value'",
     "these"),
    ("{angle: rocker, limit: ±0.1 deg}", "{angle: rocker, statistic: rms}", M, "error.statistic", "is unknown", ""),
    ("{angle: rocker, limit: ±0.1 deg}", "{angle: rocker, limits: 1 deg}", M, "error.limits", "is unknown", "'limit'"),
    ("{angle: rocker, limit: ±0.1 deg}", "{angle: rocker, limit: ±0.1}", M, "error.limit", "no unit", "deg"),
    ("{angle: rocker, limit: ±0.1 deg}", "{angle: rocker, limit: +1 deg}", M, "error.limit", "one side only", "±"),
    ("{angle: rocker, limit: ±0.1 deg}", "{angle: rocker, limit: ±(AB - BC)/AB}", M, "error.limit", "above the", "±"),
    ("{angle: rocker, limit: ±0.1 deg}", "{angle: rocker, at_least: 2, at_most: 1}", M, "at_least", "at least 2",
     "exch"),
    ("{angle: rocker, limit: ±0.1 deg}", "{locking_margin: mechanism, at_least: 12}", M, "at_least", "up to 10",
     "below"),
    ("{angle: rocker, at: 60 deg,", "{angle: rocker, at: 60 deg, over: [0, 1],", M + 1, "theta", "both a position",
     "keep"),
    ("{angle: rocker, at: 60 deg,", "{angle: rocker, at: 60 deg, as: rms,", M + 1, "theta.as", "of a range", "over: ["),
    ("{angle: rocker, at: 60 deg,", "{angle: rocker, at: 60 mm,", M + 1, "theta.at", "a length where an angle", "deg"),
    ("over: [0 deg, 180 deg]", "over: [0 deg, 1 s]", M + 4, "swing.over", "from angle to time", "two times"),
    ("over: [0 deg, 180 deg]", "over: [1 deg, 1 deg]", M + 4, "swing.over", "begins and ends", "extent"),
    ("over: [0 deg, 180 deg]", "over: 180 deg", M + 4, "measures.swing.over", "not a list", "[..., ...]"),
    ("over: [0 deg, 180 deg]", "over: [0 deg, 1 kg]", M + 4, "measures.swing.over.to", "a mass where an angle", "deg"),
]  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_one_mistake_is_found_where_it_is(mistake: Mistake, case: tuple[Any, ...]) -> None:
    mistake(VARIED, case)


def test_a_structure_has_no_position_to_choose() -> None:
    mechanism = Mechanism.read(Path(__file__).parents[2] / "examples" / "one-way-clutch.yaml")
    with pytest.raises(MechanismError, match="there is no driver whose coordinate it could be"):
        with_measure(mechanism, angle="strut", at="10 deg")


def test_in_space_an_angle_has_an_axis() -> None:
    mechanism = Mechanism.read(Path(__file__).parents[2] / "examples" / "rssr.yaml")
    assert with_measure(mechanism, reaction="B", axis="z").measures["one"].axis == "z"
    with pytest.raises(MechanismError, match="a spherical joint has no rotation or slide about one axis"):
        with_measure(mechanism, transmission_error="B")
    with pytest.raises(MechanismError, match="add axis: x, y or z"):
        with_measure(mechanism, angle="rocker")


def test_place_and_window_of_a_measure_can_be_set(varied: Mechanism) -> None:
    """Also where the file states none; what is no window says so."""
    bare = with_measure(varied, effort="A")
    for text in ("10 deg, 50 deg", "[10 deg, 50 deg]"):
        values = bare.with_values({"measures.one.over": text}).parameters()
        assert [values[f"measures.one.over.{end}"] for end in ("from", "to")] == pytest.approx([10 * DEG, 50 * DEG])
    assert bare.with_values({"measures.one.at": "10 deg"}).parameters()["measures.one.at"] == pytest.approx(10 * DEG)
    for wrong in ("10 deg", 3.0):
        with pytest.raises(MechanismError) as caught:
            bare.with_values({"measures.one.over": wrong})
        assert caught.value.findings[0].where == "measures.one.over"
