"""A result with some variables only, or with numbers of half the size, says the same as the whole one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import trunnion
from mechanisms import DURANGO
from trunnion import MechanismError
from trunnion.results import variables as results

EXAMPLES = DURANGO.parent
STEPS = 60
ASKED = [["reaction_force"], ["joint_rotation", "point_position"], ["locking_margin"], ["drive_effort_lower"], []]


@pytest.mark.parametrize(
    ("example", "engine"),
    [("durango-fourbar", "compiled"), ("drawing-press", "numpy"), ("rssr", "numpy"), ("fourbar-by-grades", "compiled")],
)
def test_what_is_kept_is_what_the_whole_result_has(example: str, engine: str) -> None:
    mechanism = trunnion.read(EXAMPLES / f"{example}.yaml")
    all_ = trunnion.analyse(mechanism, STEPS, engine=engine)
    for names in ASKED:
        some = trunnion.analyse(mechanism, STEPS, engine=engine, variables=names)
        assert {name for name in some.data_vars if "position" in some[name].dims} - {"measure_value"} == {
            *names, "status",
        }  # fmt: skip
        for name in [*some.data_vars, *some.coords]:
            # a program of fewer figures joins other products and sums to one rounding
            if some[name].dtype.kind != "f":
                np.testing.assert_array_equal(some[name], all_[name], err_msg=str(name))
            elif name not in ("power_residual", "closure_residual"):
                peak = np.nanmax(np.abs(np.where(np.isfinite(all_[name]), all_[name], 0.0)), initial=0.0)
                np.testing.assert_allclose(some[name], all_[name], 1e-12, 1e-13 * peak, err_msg=str(name))
        told = {figure.name: figure for figure in some.trunnion.summary}
        for one in all_.trunnion.summary:
            if one.name != "power_residual" and (one.name in told or "locking_margin" in names):
                assert told[one.name].value == pytest.approx(one.value, rel=1e-11)
                assert told[one.name].remark == one.remark
        assert {one.name for one in all_.trunnion.summary} - told.keys() <= {"locking_margin"} | {
            one.name for one in all_.trunnion.summary if ".critical_" in one.name
        }
        assert [one.what for one in some.trunnion.findings] == [one.what for one in all_.trunnion.findings]


def test_pins_in_their_seats_and_measures_are_kept() -> None:
    for example in ("fourbar-with-play", "piston-by-cost"):
        mechanism = trunnion.read(EXAMPLES / f"{example}.yaml")
        all_ = trunnion.analyse(mechanism, STEPS)
        some = trunnion.analyse(mechanism, STEPS, variables=["drive_effort"])
        np.testing.assert_array_equal(some["drive_effort"], all_["drive_effort"])
        assert "seat_offset" not in some
        assert [one.what for one in some.trunnion.findings] == [one.what for one in all_.trunnion.findings]


def test_numbers_of_half_the_size() -> None:
    mechanism = trunnion.read(DURANGO)
    double, single = (trunnion.analyse(mechanism, STEPS, dtype=dtype) for dtype in ("float64", "float32"))
    assert single.attrs == double.attrs
    for name in results.VARIABLES.keys() & double.data_vars.keys():
        expected = double[name].values
        assert single[name].dtype == (np.float32 if expected.dtype == float else expected.dtype)
        np.testing.assert_array_equal(single[name], expected.astype(single[name].dtype), err_msg=name)


def test_tables_have_the_columns_of_what_is_kept(tmp_path: Path) -> None:
    result = trunnion.analyse(trunnion.read(DURANGO), STEPS, variables=["drive_effort", "reaction_force"])
    (frame,) = result.trunnion.tables().values()
    assert {"A.effort", "B.reaction_x"} <= {*frame}
    assert not {"B.rotation", "power_in"} & {*frame}
    for name in ("some.csv", "some.json", "some.nc"):
        trunnion.save(result, tmp_path / name)
        assert (tmp_path / name).stat().st_size > 1000
    with pytest.raises(MechanismError) as caught:
        trunnion.save(result, tmp_path / "other.csv", columns=["B.rotation"])
    assert "there is no column 'B.rotation'" in str(caught.value)


def test_what_needs_all_variables_says_so() -> None:
    result = trunnion.analyse(trunnion.read(DURANGO), STEPS, variables=["drive_effort"])
    for ask in (trunnion.plot, trunnion.report):
        with pytest.raises(MechanismError) as caught:
            ask(result)
        assert "2 of its variables" in str(caught.value)
    assert "drive torque" in result.trunnion._repr_html_()


@pytest.mark.parametrize(
    ("asked", "where"), [({"variables": ["reaction_forces"]}, "variables"), ({"dtype": "float16"}, "dtype")]
)
def test_what_there_is_not_is_said(asked: dict[str, object], where: str) -> None:
    with pytest.raises(MechanismError) as caught:
        trunnion.analyse(trunnion.read(DURANGO), STEPS, **asked)  # type: ignore[arg-type]
    assert caught.value.findings[0].where == where
    if where == "variables":
        assert "reaction_force" in caught.value.findings[0].remedy
