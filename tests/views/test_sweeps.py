"""Figures and tables of sweeps over any number of names: what runs along what, gaps, odd values, nothing cut off."""

import csv

import numpy as np
import pytest
import xarray as xr
from stand_in_sweeps import ANGLE, DEG, RPM, SPEED, cardan, scale, swept

import trunnion
from drawn import texts
from mechanisms_parts import example
from trunnion import Status, save
from trunnion.views.shown import plot as figure
from trunnion.views.sweep import arrange, tables

GRID = {"misalignment": ANGLE, "input.speed": SPEED}
FEW = scale([50, 500, 1000, 1500], "rad/s", "rpm", RPM)
FRICTION = scale([0.05, 0.1, 0.2])


def curves(axes, count):
    """The first curves of a panel, as (x, y)."""
    return [line.get_xydata() for line in axes.get_lines()[:count]]


def names(plan):
    return (plan.x.name, plan.other.name if plan.other else "", [one.name for one in plan.facets],
            [one.name for one in plan.fixed])  # fmt: skip


@pytest.mark.parametrize(
    ("x", "family", "expected"),
    [
        ("", "", ("a", "b", ["d"], ["c"])), ("b", "", ("b", "a", ["d"], ["c"])), ("", "d", ("a", "d", ["b"], ["c"])),
        ("", "a", ("b", "a", ["d"], ["c"])), ("d", "b", ("d", "b", ["a"], ["c"])),
        ("c", "", ("c", "a", ["b", "d"], [])), ("", "c", ("a", "c", ["b", "d"], [])),
    ],
)  # fmt: skip
def test_names_are_laid_out_in_their_order_or_as_told(x, family, expected):
    result = swept({"a": scale([1, 2]), "c": scale([7]), "b": scale([3, 4, 5]), "d": scale([6, 8])})
    assert names(arrange(result, x, family)) == expected


def test_both_families_come_from_one_sweep():
    """The curves of Fig. 9 of Pezzuti et al. (2006), left and right, with units as given."""
    result = swept(GRID, cardan)
    left, right = figure(result), figure(result, x="input.speed")
    for k, line in enumerate(curves(left.axes[0], 20)):
        assert line[:, 0] == pytest.approx(ANGLE[0])
        assert line[:, 1] == pytest.approx(result["efficiency"].values[:, k])
    for k, line in enumerate(curves(right.axes[0], 13)):
        assert line[:, 0] == pytest.approx(SPEED[0])
        assert line[:, 1] == pytest.approx(result["efficiency"].values[k])
    assert [axes.get_ylabel() for axes in left.axes] == ["efficiency", "input.speed [rpm]"]
    assert [axes.get_ylabel() for axes in right.axes] == ["efficiency", "misalignment [°]"]
    assert (left.axes[0].get_xlabel(), right.axes[0].get_xlabel()) == ("misalignment [°]", "input.speed [rpm]")


def test_unsorted_values_are_drawn_in_order_and_the_gap_is_told():
    angles = scale([20, 0, 10, 10, 30], "rad", "deg", DEG)
    axes = figure(swept({"misalignment": angles}, lambda a: a / 30, lambda a: Status.LOCKED if a > 25 else 0)).axes[0]
    line = curves(axes, 1)[0]
    assert line[:, 0] == pytest.approx([0, 10, 10, 20, 30])
    assert line[:4, 1] == pytest.approx([0, 1 / 3, 1 / 3, 2 / 3])
    assert np.isnan(line[4, 1])
    assert texts(axes) == ["locked"]


def test_lines_of_a_map_lie_where_the_field_has_their_number():
    """Of a field linear in both."""
    result = swept(GRID, lambda angle, speed: 0.9 - 0.01 * angle - 0.0001 * speed)
    lines = figure(result, kind="map").axes[0].collections[-1]
    for level, path in zip(lines.levels, lines.get_paths(), strict=True):
        angle, speed = path.vertices.T
        assert 0.9 - 0.01 * angle - 0.0001 * speed == pytest.approx(level, abs=1e-9)


def test_a_table_for_each_value_of_further_names():
    grid = {"misalignment": scale(range(50)), "input.speed": SPEED, "mu": FRICTION, "r": scale([1])}
    result = swept(grid, lambda a, s, m, r: a + s + m, lambda a, s, *_: 5 if (a, s) == (0, 50) else 0)
    found = tables(result, ["efficiency"])
    assert len(found) == 3
    assert "at mu = 0.1, r" in found[1].title.replace("\u00a0", " ")
    for table, friction in zip(found, (0.05, 0.1, 0.2), strict=True):
        assert table.head[0] == "misalignment"
        assert (table.head[1], table.head[-1]) == ("50 rpm", "1500 rpm")
        assert table.rows[0][1] == "locked"
        assert float(table.rows[-1][-1]) == pytest.approx(49 + 1500 + friction)
        assert len(table.rows) * (len(table.head) - 1) + table.left_out == 50 * 20
    many = tables(swept({"a": FEW, "b": FEW, "c": scale(range(50))}))
    assert len(many) == 6
    assert sum(len(one.rows) * (len(one.head) - 1) + one.left_out for one in many) == 4 * 4 * 50


@pytest.mark.parametrize(
    ("least", "most", "shown"),
    [
        (0.0, 1.0, ["max"]),
        (-2.0, 1.0, ["min", "max"]),
        (-2.0, -1.0, ["min"]),
        (-1e-12, 1.0, ["max"]),
        (0.0, 0.0, ["max"]),
    ],
)
def test_a_table_has_the_ends_of_an_effort_that_lie_beyond_zero(least, most, shown):
    """Such as the push and the pull of a hand; what rounding leaves is none. A point without an answer has none."""
    result = swept({"friction": FRICTION}, margin=False)
    result.attrs.update(scale_of_length=1.0, scale_of_rate=1.0, scale_of_force=1.0)
    for end, value in (("min", least), ("max", most)):
        given = result[f"drive_effort_{end}"]
        result[f"drive_effort_{end}"] = xr.full_like(given, value).where(result["friction"] > 0.05)
        result[f"drive_effort_{end}"].attrs = given.attrs
    (table,) = tables(result)
    assert [one for one in table.head if one.startswith("input.effort")] == [f"input.effort {k} [N m]" for k in shown]


@pytest.mark.slow
def test_a_point_that_locks_leaves_the_others_their_numbers():
    """Its effort and reactions have no bound, beside which all others would be rounding."""
    name, head = "joint_defaults.friction.coefficient", "A.effort max [N m]"
    mechanism = example("toleranced-fourbar")
    (table,) = tables(trunnion.sweep(mechanism, {name: [1.0, 4.0]}, steps=12))
    alone = np.max(trunnion.analyse(mechanism.with_values({name: 1.0}), steps=3600)["drive_effort"].values)
    first, second = (row[table.head.index(head)] for row in table.rows)
    assert float(first) == pytest.approx(alone, rel=1e-4)
    assert second == "∞"


def test_the_file_has_a_row_a_point_of_any_number_of_names(tmp_path):
    grid = {"a": scale([1, 2]), "b": scale([3, 4, 5], "m", "mm", 1e-3), "c": scale([6]), "d": scale([7, 8])}
    save(swept(grid, lambda a, b, c, d: a * b * d), tmp_path / "grid.csv")
    with (tmp_path / "grid.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 12
    assert [row["d"] for row in rows[:3]] == ["7.0", "8.0", "7.0"]  # the last name runs fastest
    for row in rows:
        a, b, d = (float(row[name]) for name in "abd")
        assert float(row["efficiency"]) == pytest.approx(a * b * 1e3 * d)
        assert float(row["Ω.effort_max"]) == pytest.approx(25000 * a * b * 1e3 * d)
