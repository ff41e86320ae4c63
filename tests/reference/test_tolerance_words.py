"""What a study of tolerances says of its measures: what their courses are, in which unit, and where extremes lie."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from toleranced import clutch, slider_crank
from trunnion import save, tolerance
from trunnion.results.dataset import units_along
from trunnion.views.readings import readings
from trunnion.views.tolerance import figures

MEASURES: dict[str, dict[str, Any]] = {
    "top": {"point": "piston.P", "axis": "x", "at": "60 deg"},
    "soon": {"point": "piston.P", "axis": "x", "at": "0.1 s"},
    "swing": {"angle": "rod", "as": "maximum"},
    "back": {"angle": "rod", "as": "minimum", "over": ["-10 deg", "180 deg"]},
    "stroke": {"stroke": "C"},
    "dead": {"dead_centre": "C"},
    "late": {"rotation": "P", "as": "place-of-minimum"},
    "wave": {"transmission_error": "P"},
}


LENGTHS = {"r": "50 mm", "l": "200 mm", "e": "0 mm"}


@pytest.fixture(scope="module")
def result() -> Any:
    model = slider_crank(dimensions=LENGTHS, measures=MEASURES)
    return tolerance(model, methods=("linear", "monte-carlo"), samples=200, steps=72, jobs=1)


def told(result: Any, key: str) -> dict[str, Any]:
    return dict(zip(result.measure.values.tolist(), json.loads(result.attrs[key]), strict=True))


def test_where_a_measure_is_taken(result: Any) -> None:
    assert told(result, "measure_texts") == {
        "top": "coordinate of point piston.P, x at 60° of A",
        "soon": "coordinate of point piston.P, x at 0.1 s",
        "swing": "angle of link rod, maximum",
        "back": "angle of link rod, minimum over −10° to 180° of A",
        "stroke": "stroke of joint C",
        "dead": "dead centre of joint C",
        "late": "rotation of joint P, place of minimum",
        "wave": "transmission error of joint P, largest deviation from nominal",
    }
    still = tolerance(clutch(), methods=("linear",))
    assert told(still, "measure_texts") == {"wedge": "angle of link strut"}


def test_the_course_is_told_in_its_own_unit(result: Any) -> None:
    """Of a dead centre it is the slide in m, though its figure is an angle of the crank."""
    units = {"top": "m", "soon": "m", "swing": "rad", "back": "rad", "stroke": "m", "dead": "m", "late": "rad",
             "wave": "rad"}  # fmt: skip
    assert dict(zip(units, units_along(result["curve"], "measure"), strict=True)) == units
    assert units_along(result["nominal"], "measure") == [*(units | {"dead": "rad"}).values()]
    texts = told(result, "curve_texts")
    assert texts["stroke"] == texts["dead"] == "slide of C"
    assert (texts["top"], texts["swing"], texts["wave"]) == ("x of piston.P", "angle of rod", "rotation of P")
    assert told(result, "measure_rules")["dead"] == "dead centre"


def test_place_of_the_nominal_extreme(result: Any) -> None:
    """The rod is steepest with the crank at 90 and 270°, whose place is told beside the figure."""
    place = dict(zip(result.measure.values.tolist(), result.place.values.tolist(), strict=True))
    assert place["swing"] == pytest.approx(270)
    assert place["back"] == pytest.approx(90)
    assert place["top"] == pytest.approx(60)
    (read,) = (read for read in readings(result) if read.name == "swing")
    assert figures(read).rows[0][1].endswith("° at 270°")


def test_units_of_the_columns(result: Any, tmp_path: Path) -> None:
    """The place has that of the drive; what is of one measure has its own, a course its own."""

    def units(table: str) -> dict[str, str]:
        path = tmp_path / f"x.{table}.csv"
        save(result, path, units_row=True)
        head, second = path.read_text("utf-8").splitlines()[:2]
        return dict(zip(head.split(","), second.split(","), strict=True))

    assert units("measures")["place"] == "deg"
    places = units("positions")
    assert (places["dead"], places["dead.rss"], places["dead.band_0.5"]) == ("m", "m", "m")
    assert places["swing.dimensions.r.sensitivity"] == "rad/m"
    numbers = units("parameters")
    assert (numbers["nominal"], numbers["dead.sensitivity"]) == ("m", "rad/m")
    assert (numbers["dead.contribution_worst_case"], numbers["dead.contribution_rss"]) == ("rad", "1")


def test_a_measure_without_limits_has_no_yield_in_its_row(result: Any, tmp_path: Path) -> None:
    """The share with an answer is none of a limit that is kept; what has limits or bounds keeps its yield."""
    save(result, tmp_path / "x.csv")
    head, *rows = ([*line.split(",")] for line in (tmp_path / "x.csv").read_text("utf-8").splitlines())
    told = [dict(zip(head, row, strict=True)) for row in rows]
    ends = ("limit_lower", "limit_upper", "at_least", "at_most")
    limited = [any(row[end] for end in ends) for row in told]
    for end in ("yield", "yield_low", "yield_high"):
        assert [bool(row[end]) for row in told] == limited


def test_unit_of_all_measures() -> None:
    """One unit of all measures stands in the units of each variable."""
    found = tolerance(slider_crank(dimensions=LENGTHS), methods=("linear",))
    assert {found[name].attrs["units"] for name in ("nominal", "curve", "curve_rss", "rss")} == {"m"}
    assert found.curve_sensitivity.attrs["units"] == found.sensitivity.attrs["units"] == "m/m"


@pytest.mark.parametrize(
    ("tolerances", "options", "expected"),
    [
        ({"r": "±60 mm"}, {}, [("tolerance.negative", "tolerances.r", -0.01)]),
        ({"r": "±40 mm", "e": "±1 mm"}, {}, []),  # an offset may turn round
        ({"joint_defaults.friction.coefficient": "±0.2"}, {"friction": 0.06},
         [("tolerance.negative", "tolerances.joint_defaults.friction.coefficient", -0.14)]),
        ({"joint_defaults.friction.coefficient": "±0.02"}, {"friction": 0.06}, []),
        ({"joint_defaults.pin.radius": "±4 mm"}, {"friction": 0.1},
         [("tolerance.negative", "tolerances.joint_defaults.pin.radius", -0.001)]),
        ({"joint_defaults.pin.radius": "±3 mm"}, {"friction": 0.1},
         [("tolerance.impossible", "tolerances.joint_defaults.pin.radius", 0.0)]),
    ],
)  # fmt: skip
def test_tolerances_of_what_no_model_may_have(
    tolerances: dict[str, str], options: dict[str, float], expected: list[tuple[str, str, float]]
) -> None:
    """A negative size or coefficient, a length that turns round; of a default once for all its joints."""
    dimensions = {"r": "50 mm", "l": "200 mm", "e": "0.5 mm"}
    defaults = {"pin": {"radius": "3 mm"}, "guide": {"length": "30 mm"}, "friction": 0.06, **options}
    model = slider_crank(dimensions=dimensions, joint_defaults=defaults, tolerances=tolerances)
    found = tolerance(model, ["slide:C"], methods=("linear",), steps=24).trunnion.findings
    told = [(one.code, one.where, one.figures) for one in found if one.code.endswith((".negative", ".impossible"))]
    assert [(code, where) for code, where, _ in told] == [(code, where) for code, where, _ in expected]
    for (_, _, own), (_, _, reached) in zip(told, expected, strict=True):
        assert own["least" if reached < 0 else "value"] == pytest.approx(reached, abs=1e-12)
