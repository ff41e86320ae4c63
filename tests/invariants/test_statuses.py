"""Positions without an answer, whole turns, hints, change points, and what is looked for once and kept."""

import copy
import sys

import numpy as np
import pytest

import trunnion
from brief import brief
from mechanisms import (
    MODELS,
    analyse,
    build,
    findings,
    five_bar,
    four_bar,
    model,
    positions_of,
    slider_crank,
    watt_six_bar,
)
from mechanisms_parts import bare, example, slide
from trunnion import FrictionMethod, Mechanism, MechanismError, Status
from trunnion.errors import Severity
from trunnion.model.checks.check import check_values

FORCES = ["drive_effort", "drive_effort_lower", "drive_effort_upper", "reaction_force", "friction_power", "drive_power"]


def texts(result):
    return "\n".join(f"{row['severity']} {row['where']} {row['what']}" for row in findings(result))


# cannot be assembled
def test_not_assembled_over_part_of_the_turn():
    """|BD| = √(1 + 0.64 − 1.6 cos q) reaches BC + CD = 1.15 at one angle: values before it, NaN beyond."""
    result = analyse(four_bar(0.8, 0.65, 0.5, 1.0), 360)
    limit = np.degrees(np.arccos((1 + 0.64 - 1.15**2) / 1.6))
    q = np.arange(360)
    out = (q > limit) & (q < 360 - limit)
    status = result["status"].values
    np.testing.assert_array_equal(status == Status.NOT_ASSEMBLED, out)
    motion = ("point_position", "point_velocity", "link_angle", "joint_rotation", "joint_slide", "condition")
    for variable in (*FORCES, *motion):
        bad = np.isnan(result[variable].values).any(axis=tuple(range(result[variable].ndim - 1)))
        assert np.all(bad[out]), variable
        assert not np.any(bad[status < Status.NOT_CONVERGED]), variable
    inside = np.flatnonzero(~out)
    first, last = int(np.ceil(limit)), int(np.floor(360 - limit))
    assert {first - 1, last + 1} <= set(inside)
    text = texts(result)
    assert f"between {first}° and {last}°" in text
    assert "|BD| exceeds BC + CD" in text
    worst = (1.8 - 1.15) * 1000
    assert f"up to {worst:.4g} mm" in text
    assert np.isnan(float(result["efficiency"]))


@pytest.mark.parametrize("start", ["0 deg", "90 deg", "270 deg"])
def test_extremes_are_of_the_range_that_holds_the_start_and_the_others_are_named(start):
    """A rocker of 4, coupler 6, output 3 and ground 5.5 closes for |BD| from 3 to 9: in two ranges of a turn."""
    data = model(four_bar(4.0, 6.0, 3.0, 5.5), friction=None)
    data["drivers"]["A"] = {"speed": 1.0, "start": start}
    result = trunnion.analyse(Mechanism(**data), 36)
    (told,) = [row for row in findings(result) if row["code"] == "assembly.ranges"]
    low, high = (np.degrees(np.arccos((16 + 5.5**2 - bd**2) / 44)) for bd in (3.0, 9.0))
    assert ("extremes are of the one" in told["what"]) == (start != "0 deg")
    own = {"90 deg": (low, high), "270 deg": (360 - high, 360 - low)}.get(start, (low, 360 - low))
    places = [row.place.strip("at °") for row in result.trunnion.summary if row.name.startswith("A.effort_m")]
    assert len(places) == 2
    assert all(own[0] - 0.1 <= float(place) % 360 <= own[1] + 0.1 for place in places)


@pytest.mark.parametrize(
    ("lengths", "ever", "why"),
    [((0.8, 1.5, 0.5, 1.0), True, "falls short of |BC − CD|"), ((0.1, 0.2, 0.2, 1.0), False, "at any position")],
)
def test_why_it_is_not_assembled(lengths, ever, why):
    result = analyse(four_bar(*lengths), 36)
    assert why in texts(result)
    assert np.any(result["status"] == Status.NOT_ASSEMBLED)
    assert np.any(result["status"] < Status.NOT_CONVERGED) == ever
    assert np.isnan(float(result["efficiency"]))


@pytest.mark.slow
def test_general_group_not_assembled_over_part_of_the_turn():
    """A rod shorter than the crank reaches the guide only where |r sin q| ≤ l; both parts of the turn count."""
    r, length = 0.5, 0.4
    result = analyse(slider_crank(r, length, 0.0), 120)
    q = -6.0 * result["time"].values
    out = np.abs(r * np.sin(q)) > length
    status = result["status"].values
    assert np.all(status[out] == Status.NOT_ASSEMBLED)
    solved = status < Status.NOT_CONVERGED
    assert np.count_nonzero(solved) > 10
    x = result["point_position"].sel(point="piston.P", axis="x").values
    root = np.sqrt(length**2 - (r * np.sin(q[solved])) ** 2)
    # the stated assembly also where it assembles again after a gap: the piston to the right of the pin
    np.testing.assert_allclose(x[solved] - r * np.cos(q[solved]), root, atol=1e-12)
    assert "cannot be assembled" in texts(result)


# dead centres
@pytest.mark.parametrize("kind", ["RRR", "general"])
def test_exactly_at_a_dead_centre(kind):
    """Crank and coupler (or rod) in line, the other end driven: SINGULAR or open there, no numbers for forces."""
    if kind == "RRR":  # rocker drives; at its extreme |AC| = AB + BC exactly: A (0,0), D (1,0), a 3-4-5 triangle
        data = four_bar(0.2, 0.6, 0.6, 1.0)
        q = float(np.arctan2(0.48, 0.64 - 1.0))
        data["drivers"] = {"D": {"speed": 1.0, "range": [q, q + 0.3]}}
        data["assembly"] = {"B": [0.1, 0.2]}
    else:  # the piston drives; at x = l − r or l + r crank and rod are in line
        data = slider_crank(0.3, 1.0, 0.0)
        data["links"]["piston"]["points"]["C"] = slide(0, 0)
        data["drivers"] = {"C": {"speed": -0.1, "range": [1.3, 1.0]}}
        data["assembly"] = {"B": [0.29, 0.05]}
    result = positions_of(data, 5)
    status = result["status"].values
    assert status[0] in (Status.SINGULAR, Status.NOT_ASSEMBLED)
    assert np.all(np.isnan(result["drive_effort"].values[:, 0]))
    assert np.all(status[1:] <= Status.NEAR_SINGULAR)
    assert np.all(np.isfinite(result["drive_effort"].values[:, 1:]))


@pytest.mark.spread(1)
@pytest.mark.parametrize("method", [None, FrictionMethod("successive-approximation", 1e-9)])
@pytest.mark.parametrize("name", ["slider-crank", "Stephenson six-bar", "inverted slider-crank"])
def test_chunks_are_invisible(name, method, monkeypatch):
    """Solved 7 at a time or all together: every variable the same, condition included."""

    whole = analyse(MODELS[name](), 60, method)
    monkeypatch.setattr(sys.modules["trunnion.solve.run"], "CHUNK", 7)
    parts = analyse(MODELS[name](), 60, method)
    for variable in whole.data_vars:
        a, b = np.asarray(parts[variable], float), np.asarray(whole[variable], float)
        if variable == "power_residual":
            continue  # rounding
        scale = float(np.nanmax(np.abs(b), initial=0.0)) or 1.0
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-9 * scale, err_msg=str(variable))


@pytest.mark.parametrize("steps", [0, -3, 10**7 + 1])
def test_a_number_of_positions_that_memory_cannot_hold(steps):
    with pytest.raises(MechanismError) as error:
        trunnion.analyse(build(four_bar()), steps)
    (finding,) = error.value.findings
    assert finding.where == "steps"
    assert finding.remedy == "give a whole number from 1 to 10,000,000, for all positions are held in memory"


def test_massless_and_unloaded():
    """Nothing acts: all forces are 0, not NaN, and nothing is said to be locked."""
    result = trunnion.analyse(Mechanism(**bare(model(four_bar())) | {"gravity": [0, 0]}), 24)
    assert np.all(result["status"] <= Status.ZERO_SLIP)
    for variable in ("drive_effort", "reaction_force", "friction_torque", "power_residual"):
        np.testing.assert_array_equal(result[variable].values, 0.0)
    assert np.isnan(float(result["efficiency"]))


def test_range_includes_both_ends():
    data = four_bar()
    data["drivers"]["A"] = {"speed": -2.0, "range": [1.0, -0.5]}
    result = positions_of(data, 4)
    np.testing.assert_allclose(result["link_angle"].sel(link="crank"), [1.0, 0.5, 0.0, -0.5], atol=1e-15)
    np.testing.assert_allclose(result["time"], [0.0, 0.25, 0.5, 0.75])
    data["drivers"]["A"]["speed"] = 2.0
    with pytest.raises(MechanismError) as error:
        analyse(data, 4)
    assert "range" in str(error.value)


def test_too_few_rounds_is_said():
    """Three rounds at a criterion they cannot meet: NOT_CONVERGED and NaN, not the third guess."""
    result = analyse(four_bar(), 12, FrictionMethod("successive-approximation", 1e-9, 3))
    assert np.all(result["status"] == Status.NOT_CONVERGED)
    assert np.all(np.isnan(result["drive_effort"]))
    assert np.all(np.isfinite(result["point_velocity"]))
    assert "did not converge" in texts(result)


def test_assemblies_that_coincide_over_a_range_are_told_by_its_ends():
    """Coupler and rocker lie on the crank at every angle: A and D are at one place, and their lengths add up to it."""
    data = four_bar(0.04, 0.025, 0.015, 0.04)
    data["links"]["ground"]["points"]["D"] = [0.0, 0.0]
    data["assembly"] = {"C": [0.015, 0.0]}
    (told,) = [row for row in findings(trunnion.analyse(build(data), 7)) if row["code"] == "assembly.change_point"]
    assert told["figures"]["places"] == ["between 0° and 360°"]


@pytest.mark.parametrize("branch", [1, -1])
def test_a_hint_on_a_joint_of_a_later_group_counts(branch):
    """F joins the rocker to a later dyad: its place tells the assemblies of the rocker's own dyad apart."""
    data = watt_six_bar()
    data["assembly"]["C"][1] *= branch
    stated = brief(build(data), 3)
    f = stated["point_position"].sel(point="rocker.F")[:, 0].values
    data["assembly"] = {"F": f.tolist(), "H": data["assembly"]["H"]}
    hinted = trunnion.analyse(build(data), 3)
    np.testing.assert_array_equal(hinted["point_position"], stated["point_position"])
    assert not any(row["code"] == "assembly.choice" for row in findings(hinted))


def test_a_driven_rotation_is_the_prescribed_coordinate():
    """Whole turns, a start beyond half a turn and coarse steps included."""
    data = five_bar()
    data["drivers"]["E"] |= {"speed": -20.0, "start": 3.5}
    result = brief(build(data), 12)
    np.testing.assert_allclose(result["joint_rotation"].sel(joint="E"), 3.5 - 20.0 * result["time"], rtol=1e-13)


def test_angles_follow_their_rate_across_coarse_steps():
    """A link that turns 0.9 turns a step is not taken to turn back 0.1."""
    data = four_bar()
    data["drivers"]["A"] |= {"range": [0.0, 36 * np.pi * 0.9]}
    crank = brief(build(data), 19)["link_angle"].sel(link="crank").values
    np.testing.assert_allclose(np.diff(crank), 2 * np.pi * 0.9, rtol=1e-12)


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", ["durango-fourbar", "fourbar-with-play", "rssr"])
def test_an_analysis_again_is_that_of_a_mechanism_read_anew(name):
    mechanism = example(name)
    trunnion.analyse(mechanism, 12)
    again, anew = trunnion.analyse(mechanism, 36), trunnion.analyse(example(name), 36)
    assert again.identical(anew)


WRONG = [
    {"links.crank.mass": -1.0}, {"joints.B.pin.radius": 0.0},
    {"joints.B.friction.coefficient": -0.1, "links.coupler.mass": -2.0}, {"drivers.A.speed": 0.0},
    {"links.coupler.inertia": -1.0},
    {"AB": 1.9, "joint_defaults.friction.coefficient": -7.0},
]  # fmt: skip
SOUND = [{"AB": 1.9}, {"AB": float("nan")}, {"links.coupler.points.C.x": 0.0, "links.coupler.points.C.y": 0.0}]


@pytest.mark.parametrize("change", [*WRONG, *SOUND], ids=lambda change: " ".join(change))
def test_errors_of_changed_numbers_are_found_among_these_alone(change):
    mechanism = example("durango-fourbar")
    numbers = copy.copy(mechanism.parameter_set)
    before = dict(numbers.nominal)
    numbers.nominal = mechanism.parameters(change)
    changed = [path for path, value in numbers.nominal.items() if value is not before[path]]
    with np.errstate(all="ignore"):
        whole, own = (
            [one for one in check_values(mechanism, numbers, only) if one.severity is Severity.ERROR]
            for only in (None, changed)
        )
    assert {str(one) for one in own} == {str(one) for one in whole}
    assert bool(own) == any(change is one for one in WRONG)


def test_inertia_about_the_origin():
    """The same body stated about its own origin: J_O = J_S + m r²."""
    data, other = four_bar(), four_bar()
    for link in other["links"].values():
        if "mass" in link:
            x, y = link["centre"]
            link["inertia"] += link["mass"] * (x * x + y * y)
            link["inertia_about"] = "origin"
    np.testing.assert_allclose(
        positions_of(other, 12)["drive_effort"], positions_of(data, 12)["drive_effort"], rtol=1e-10
    )
