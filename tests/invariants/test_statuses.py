"""What a position without an answer looks like, and that its neighbours do not notice."""

from __future__ import annotations

import copy
import sys
from typing import Any

import numpy as np
import pytest

import trunnion
from brief import brief
from mechanisms import (
    DURANGO,
    MODELS,
    analyse,
    body,
    build,
    findings,
    four_bar,
    model,
    positions_of,
    revolute,
    slider_crank,
)
from trunnion import FrictionMethod, Mechanism, MechanismError, Status

FORCES = ["drive_effort", "drive_effort_lower", "drive_effort_upper", "reaction_force", "friction_power", "drive_power"]


def texts(result: Any) -> str:
    return "\n".join(f"{row['severity']} {row['where']} {row['what']}" for row in findings(result))


# ---- cannot be assembled --------------------------------------------------------------------------------------


def test_not_assembled_over_part_of_the_turn() -> None:
    """|BD| = √(1 + 0.64 − 1.6 cos q) reaches BC + CD = 1.15 at one angle: values before it, NaN beyond."""
    data = four_bar(0.8, 0.65, 0.5, 1.0)
    result = analyse(data, 360)
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
def test_extremes_are_of_the_range_that_holds_the_start_and_the_others_are_named(start: str) -> None:
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


def test_not_assembled_because_too_near() -> None:
    """Rocker and coupler differ by more than the pins' least distance."""
    result = analyse(four_bar(0.8, 1.5, 0.5, 1.0), 90)
    assert "falls short of |BC − CD|" in texts(result)
    assert np.any(result["status"] == Status.NOT_ASSEMBLED)
    assert np.any(result["status"] < Status.NOT_CONVERGED)


def test_never_assembled() -> None:
    result = analyse(four_bar(0.1, 0.2, 0.2, 1.0), 8)
    assert np.all(result["status"] == Status.NOT_ASSEMBLED)
    assert "at any position" in texts(result)
    assert np.isnan(float(result["efficiency"]))


def test_general_group_not_assembled_over_part_of_the_turn() -> None:
    """A rod shorter than the crank reaches the guide only where |e − r sin q| ≤ l; both parts of the turn count."""
    r, length, e = 0.5, 0.4, 0.0
    data = slider_crank(r, length, e)
    data["links"]["ground"]["points"]["A"] = [0, 0]
    result = analyse(data, 120)
    q = -6.0 * result["time"].values
    out = np.abs(e - r * np.sin(q)) > length
    status = result["status"].values
    assert np.all(status[out] == Status.NOT_ASSEMBLED)
    solved = status < Status.NOT_CONVERGED
    assert np.count_nonzero(solved) > 10
    x = result["point_position"].sel(point="piston.P", axis="x").values
    root = np.sqrt(length**2 - (e - r * np.sin(q[solved])) ** 2)
    np.testing.assert_allclose(np.abs(x[solved] - r * np.cos(q[solved])), root, atol=1e-12)
    assert "cannot be assembled" in texts(result)


def test_same_slider_crank_does_not_change_sides() -> None:
    """Where it assembles again after a gap it is the stated assembly: the piston to the right of the pin."""
    data = slider_crank(0.5, 0.4, 0.0)
    result = positions_of(data, 120)
    q = -6.0 * result["time"].values
    solved = result["status"].values < Status.NOT_CONVERGED
    x = result["point_position"].sel(point="piston.P", axis="x").values
    here = solved & (np.cos(q) > 0)
    assert np.all(x[here] > 0.5 * np.cos(q[here]))
    # beyond the gap the other part of the turn is reached by no motion; if it is given it is the same side
    beyond = solved & (np.cos(q) < 0)
    assert np.all(x[beyond] > 0.5 * np.cos(q[beyond]))


@pytest.mark.slow
def test_later_modules_wait_for_earlier_ones() -> None:
    """Where the first dyad is open the second has no numbers either, and the finding names the first."""
    data = MODELS["Watt six-bar"]()
    data["links"]["crank"]["points"]["B"] = [0.8, 0]
    data["links"]["coupler"]["points"]["C"] = [0.7, 0]
    data["links"]["rocker"]["points"]["C"] = [0.5, 0]
    result = analyse(data, 60)
    out = result["status"].values == Status.NOT_ASSEMBLED
    assert 0 < np.count_nonzero(out) < 60
    assert np.all(np.isnan(result["point_position"].values[..., out]))
    assert "coupler, rocker" in texts(result)


# ---- dead centres ---------------------------------------------------------------------------------------------


def test_rocker_driven_through_a_dead_centre() -> None:
    """Driven at the rocker beyond its extreme: dead centre is SINGULAR or open beyond it, never an exception."""
    data = four_bar()
    data["drivers"] = {"D": {"speed": 1.0, "range": [1.2, 2.9]}}
    data["assembly"] = {"B": [0.2, 0.2], "C": [1.2, 0.6]}
    result = positions_of(data, 200)
    status = result["status"].values
    assert np.any(status < Status.NOT_CONVERGED)
    assert np.any(status == Status.NOT_ASSEMBLED)
    solved = status < Status.NOT_CONVERGED
    assert np.all(np.isfinite(result["drive_effort"].values[0][solved]))
    peak = np.nanmax(np.abs(result["drive_power"]))
    assert np.nanmax(np.abs(result["power_residual"])) < 1e-11 * peak


@pytest.mark.parametrize("kind", ["RRR", "general"])
def test_exactly_at_a_dead_centre(kind: str) -> None:
    """Crank and coupler (or rod) in line, the other end driven: SINGULAR or open there, no numbers for forces."""
    if kind == "RRR":  # rocker drives; at its extreme |AC| = AB + BC exactly: A (0,0), D (1,0), a 3-4-5 triangle
        data = four_bar(0.2, 0.6, 0.6, 1.0)
        data["drivers"] = {"D": {"speed": 1.0, "start": float(np.arctan2(0.48, -0.36)), "range": None}}
        q = float(np.arctan2(0.48, 0.64 - 1.0))
        data["drivers"] = {"D": {"speed": 1.0, "range": [q, q + 0.3]}}
        data["assembly"] = {"B": [0.1, 0.2]}
    else:  # the piston drives; at x = l − r or l + r crank and rod are in line
        data = slider_crank(0.3, 1.0, 0.0)
        data["links"]["piston"]["points"]["C"] = {"at": [0, 0], "axis": [1, 0]}
        data["drivers"] = {"C": {"speed": -0.1, "range": [1.3, 1.0]}}
        data["assembly"] = {"B": [0.29, 0.05]}
    result = positions_of(data, 5)
    status = result["status"].values
    assert status[0] in (Status.SINGULAR, Status.NOT_ASSEMBLED)
    assert np.all(np.isnan(result["drive_effort"].values[:, 0]))
    assert np.all(status[1:] <= Status.NEAR_SINGULAR)
    assert np.all(np.isfinite(result["drive_effort"].values[:, 1:]))


@pytest.mark.slow
def test_parallelogram_passes_its_change_points() -> None:
    """B, C, D in line at 0 and 180°: SINGULAR there, and the parallel assembly on both sides of them."""
    data = four_bar(0.5, 1.0, 0.5, 1.0)
    data["drivers"]["A"] = {"speed": 1.0}
    data["assembly"] = {"C": [1.5, 0.01]}
    result = analyse(data, 36)
    status = result["status"].values
    assert status[0] >= Status.SINGULAR
    assert status[18] >= Status.SINGULAR
    rest = np.setdiff1d(np.arange(36), [0, 18])
    assert np.all(status[rest] <= Status.NEAR_SINGULAR)
    assert np.all(np.isnan(result["drive_effort"].values[0, [0, 18]]))
    assert "dead centre" in texts(result)


# ---- number of positions --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["four-bar", "class III", "excavator"])
def test_one_position(name: str) -> None:
    whole, one = positions_of(MODELS[name](), 12), positions_of(MODELS[name](), 1)
    assert one.sizes["position"] == 1
    for variable in ("point_position", "reaction_force", "drive_effort", "status"):
        np.testing.assert_allclose(
            one[variable].values[..., 0], whole[variable].values[..., 0], rtol=1e-9, atol=1e-9, err_msg=variable
        )


def test_many_positions_agree_with_few() -> None:
    """100 000 positions in chunks: the same numbers at common positions, no seam between chunks."""
    mechanism = trunnion.read(DURANGO)
    many, few = brief(mechanism, 100_000), brief(mechanism, 160)
    for variable in ("point_position", "reaction_force", "drive_effort", "friction_power", "condition", "status"):
        a, b = many[variable].values[..., ::625], few[variable].values
        scale = float(np.abs(b).max()) or 1.0
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-10 * scale, err_msg=variable)
    assert int(many["status"].max()) <= Status.ZERO_SLIP
    effort = many["drive_effort"].values[0]
    smooth = np.abs(np.diff(effort, 3))
    assert smooth[np.r_[100:40000]].max() < 1e-4 * np.abs(effort).max()


@pytest.mark.spread(1)
@pytest.mark.parametrize("method", [None, FrictionMethod("successive-approximation", 1e-9)])
@pytest.mark.parametrize("name", ["slider-crank", "Stephenson six-bar", "inverted slider-crank"])
def test_chunks_are_invisible(name: str, method: FrictionMethod | None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Solved 7 at a time or all together: every variable the same, condition included."""

    whole = analyse(MODELS[name](), 60, method)
    monkeypatch.setattr(sys.modules["trunnion.solve.memory"], "CHUNK", 7)
    parts = analyse(MODELS[name](), 60, method)
    for variable in whole.data_vars:
        a, b = np.asarray(parts[variable], float), np.asarray(whole[variable], float)
        if variable == "power_residual":
            continue  # rounding
        scale = float(np.nanmax(np.abs(b), initial=0.0)) or 1.0
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-9 * scale, err_msg=str(variable))


@pytest.mark.parametrize("steps", [0, -3, 10**7 + 1])
def test_a_number_of_positions_that_memory_cannot_hold(steps: int) -> None:
    with pytest.raises(MechanismError) as error:
        trunnion.analyse(build(four_bar()), steps)
    (finding,) = error.value.findings
    assert finding.where == "steps"
    assert finding.remedy == "give a whole number from 1 to 10,000,000, for all positions are held in memory"


# ---- ordinary extremes ----------------------------------------------------------------------------------------


def test_names_of_any_kind() -> None:
    """Spaces, Greek, Chinese, a quote: names are only names."""
    data = four_bar()
    text = {"crank": "Kurbel α", "coupler": "连杆 2", "rocker": "it's ω"}
    for old, new in text.items():
        data["links"][new] = data["links"].pop(old)
    for joint in data["joints"].values():
        joint["links"] = [text.get(link, link) for link in joint["links"]]
    for load in data["loads"].values():
        load["link"] = text[load["link"]]
    plain, named = positions_of(four_bar(), 12), positions_of(data, 12)
    np.testing.assert_allclose(named["drive_effort"], plain["drive_effort"], rtol=1e-12)
    assert "Kurbel α" in named["link"].values


def test_massless_and_unloaded() -> None:
    """Nothing acts: all forces are 0, not NaN, and nothing is said to be locked."""
    data = model(four_bar())
    data["gravity"] = [0, 0]
    data["loads"] = {}
    for link in data["links"].values():
        for key in ("mass", "centre", "inertia"):
            link.pop(key, None)
    result = trunnion.analyse(Mechanism(**data), 24)
    assert np.all(result["status"] <= Status.ZERO_SLIP)
    for variable in ("drive_effort", "reaction_force", "friction_torque", "power_residual"):
        np.testing.assert_array_equal(result[variable].values, 0.0)
    assert np.isnan(float(result["efficiency"]))


def test_zero_coefficient_equals_no_friction() -> None:
    zero, off = positions_of(four_bar(), 24, friction=0.0), positions_of(four_bar(), 24, friction=None)
    for variable in ("drive_effort", "reaction_force", "friction_power"):
        np.testing.assert_array_equal(zero[variable].values, off[variable].values)


def test_a_load_at_the_coupler_point_is_where_it_is_said() -> None:
    """Moving a force along its line of action changes nothing; across it changes the moment it has."""
    data, shifted, moved = four_bar(), four_bar(), four_bar()
    result = positions_of(data, 12, friction=None)
    e = result["point_position"].sel(point="coupler.E").values
    coupler = data["links"]["coupler"]["points"]["E"]
    for other, offset in ((shifted, (0.0, 0.0)), (moved, (0.1, 0.0))):
        other["links"]["coupler"]["points"]["F"] = [coupler[0] + offset[0], coupler[1] + offset[1]]
        other["loads"]["push"]["at"] = "F"
    np.testing.assert_allclose(positions_of(shifted, 12, friction=None)["drive_effort"], result["drive_effort"])
    difference = positions_of(moved, 12, friction=None)
    arm = difference["point_position"].sel(point="coupler.F").values - e
    turn = arm[0] * -30.0 - arm[1] * 12.0
    extra = (difference["drive_power"] - result["drive_power"]).values[0]
    speed = result["link_angle_velocity"].sel(link="coupler").values
    np.testing.assert_allclose(extra, -turn * speed, atol=1e-10)


def test_two_drivers_of_different_speed_make_one_cycle() -> None:
    """The slower driver's turn, in which the other turns twice; the end is not repeated."""
    result = analyse(MODELS["five-bar"](), 16)
    assert float(result["time"][-1]) == pytest.approx(np.pi * 15 / 16)
    assert result.attrs["periodic"] == 1
    right = result["link_angle_velocity"].sel(link="right").values
    np.testing.assert_allclose(right, 4.0, rtol=1e-12)  # named second to the ground: −(−4)


@pytest.mark.slow
def test_many_turns_in_one_range() -> None:
    """A linkage that assembles over a turn assembles over 73, at the positions it has in one."""
    one, many = MODELS["class III"](), MODELS["class III"]()
    many["drivers"]["A"] = {"speed": 5.0, "range": [0.0, 146 * np.pi]}
    result = positions_of(many, 74)
    assert np.all(result["status"] < Status.NOT_CONVERGED)
    start = positions_of(one, 4)["drive_effort"].values[0, 0]
    np.testing.assert_allclose(result["drive_effort"].values[0], start, rtol=1e-6)


def test_range_includes_both_ends() -> None:
    data = four_bar()
    data["drivers"]["A"] = {"speed": -2.0, "range": [1.0, -0.5]}
    result = positions_of(data, 4)
    np.testing.assert_allclose(result["link_angle"].sel(link="crank"), [1.0, 0.5, 0.0, -0.5], atol=1e-15)
    np.testing.assert_allclose(result["time"], [0.0, 0.25, 0.5, 0.75])
    data["drivers"]["A"]["speed"] = 2.0
    with pytest.raises(MechanismError) as error:
        analyse(data, 4)
    assert "range" in str(error.value)


def test_ranges_that_do_not_take_the_same_time() -> None:
    data = MODELS["excavator"]()
    data["drivers"]["K"]["range"] = [1.9, 1.0]
    with pytest.raises(MechanismError) as error:
        analyse(data, 4)
    assert "drivers" in str(error.value)


# ---- assembly hints -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["slider-crank", "four-bar", "class III"])
def test_assembly_by_the_angle_of_a_joint(name: str) -> None:
    """The rotation of a joint at the start says which way as well as a point does, on moving links too."""
    expected = positions_of(MODELS[name](), 12)
    data = MODELS[name]()
    joint = {"slider-crank": "B", "four-bar": "B", "class III": "P"}[name]
    data["assembly"] = {joint: float(expected["joint_rotation"].sel(joint=joint)[0]) + 0.05}
    if name == "class III":
        data["assembly"]["Q"] = float(expected["joint_rotation"].sel(joint="Q")[0])
        data["assembly"]["R"] = float(expected["joint_rotation"].sel(joint="R")[0])
        data["assembly"]["B"] = float(expected["joint_rotation"].sel(joint="B")[0])
    result = positions_of(data, 12)
    np.testing.assert_allclose(result["point_position"], expected["point_position"], atol=1e-10)


@pytest.mark.parametrize("side", [1.2, -0.7])
def test_assembly_by_the_slide_of_a_joint(side: float) -> None:
    """For a slide the hint is its length: the piston to the right or to the left of the crank."""
    data = slider_crank()
    data["assembly"] = {"C": side}
    result = positions_of(data, 12)
    slide = result["joint_slide"].sel(joint="C").values
    assert np.all(np.sign(slide) == np.sign(side))


def test_both_assemblies_are_found_and_the_choice_is_reported() -> None:
    data = slider_crank()
    del data["assembly"]
    result = analyse(data, 12)
    assert "2 assembly modes" in texts(result)
    data["assembly"] = {"P": [-0.7, 0.1]}
    left = analyse(data, 12)
    assert np.all(left["point_position"].sel(point="piston.P", axis="x") < 0)
    assert "ways" not in texts(left)


def test_a_point_of_a_link_as_a_hint() -> None:
    up, down = four_bar(), four_bar()
    up["assembly"], down["assembly"] = {"coupler.E": [0.5, 0.5]}, {"coupler.E": [0.8, -0.3]}
    a, b = (positions_of(d, 4)["point_position"].sel(point="rocker.C", axis="y").values for d in (up, down))
    assert a[0] > 0 > b[0]


# ---- loads that resist ----------------------------------------------------------------------------------------


def test_resisting_loads_take_power() -> None:
    """A brake torque on a pin and a brake force in a guide oppose the motion: useful power = Σ |M ω| + |F v|."""
    data = slider_crank()
    data["loads"] = {"pump": {"joint": "C", "resisting_force": 30.0}, "brake": {"joint": "B", "resisting_torque": 2.0}}
    result = analyse(data, 40)
    v = np.abs(result["joint_slide_velocity"].sel(joint="C").values)
    w = np.abs(result["joint_rotation_velocity"].sel(joint="B").values)
    np.testing.assert_allclose(result["useful_power"], 30.0 * v + 2.0 * w, rtol=1e-12, atol=1e-12)
    assert np.abs(result["power_residual"]).max() < 1e-12 * np.abs(result["drive_power"]).max()
    lost = float(result["friction_power"].sum("joint").mean())
    gained = float(result["useful_power"].mean())
    assert float(result["efficiency"]) == pytest.approx(gained / (gained + lost), rel=1e-3)
    assert 0 < float(result["efficiency"]) < 1


def test_inertia_about_the_origin() -> None:
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


def test_where_the_frame_of_a_link_lies_does_not_matter() -> None:
    """The coupler described from another origin and axis: the same machine."""
    data, other = four_bar(), four_bar()
    turn, shift = 0.9, np.array([0.4, -0.2])
    c, s = np.cos(turn), np.sin(turn)

    def moved(v: list[float]) -> list[float]:
        return [c * v[0] - s * v[1] + shift[0], s * v[0] + c * v[1] + shift[1]]

    link = other["links"]["coupler"]
    link["points"] = {name: moved(at) for name, at in link["points"].items()}
    link["centre"] = moved(link["centre"])
    a, b = positions_of(data, 12), positions_of(other, 12)
    for variable in ("drive_effort", "reaction_force", "point_position", "friction_power"):
        np.testing.assert_allclose(b[variable], a[variable], rtol=0, atol=1e-10 * float(np.abs(a[variable]).max()))


def test_methods_agree_everywhere() -> None:
    for name in ("four-bar", "slider-crank", "class III", "excavator"):
        newton = positions_of(MODELS[name](), 30)
        named = positions_of(MODELS[name](), 30, FrictionMethod("successive-approximation", 1e-11))
        for variable in ("drive_effort", "reaction_force", "reaction_moment"):
            scale = float(np.abs(newton[variable]).max()) or 1.0
            np.testing.assert_allclose(named[variable], newton[variable], rtol=0, atol=1e-9 * scale, err_msg=name)


def test_too_few_rounds_is_said() -> None:
    """Three rounds at a criterion they cannot meet: NOT_CONVERGED and NaN, not the third guess."""
    result = analyse(four_bar(), 12, FrictionMethod("successive-approximation", 1e-9, 3))
    assert np.all(result["status"] == Status.NOT_CONVERGED)
    assert np.all(np.isnan(result["drive_effort"]))
    assert np.all(np.isfinite(result["point_velocity"]))
    assert "did not converge" in texts(result)


def test_a_toggle_gives_way_to_its_neighbours() -> None:
    """One singular lane in a batch leaves the others as they are alone."""
    data = four_bar(0.5, 1.0, 0.5, 1.0)
    data["assembly"] = {"C": [1.5, 0.01]}
    everything = positions_of(data, 36)
    part = copy.deepcopy(data)
    part["drivers"]["A"] = {"speed": 4.0, "range": [np.pi / 18, np.pi / 2]}
    alone = positions_of(part, 9)
    np.testing.assert_allclose(everything["drive_effort"].values[0, 1:10], alone["drive_effort"].values[0], rtol=1e-9)


def test_a_loose_weight_on_a_massless_rod() -> None:
    """One link without mass between two with: its pins carry equal and opposite forces along it."""
    data = four_bar()
    data["links"]["coupler"] = {"points": {"B": [0, 0], "C": [0.9, 0]}}
    data["loads"] = {}
    data["links"]["rocker"] = body({"D": [0, 0], "C": [0.7, 0]}, 5)
    data["joints"]["A"] = revolute("ground", "crank")
    result = positions_of(data, 12, friction=None)
    b, c = (result["reaction_force"].sel(joint=name).values for name in "BC")
    np.testing.assert_allclose(b, c, atol=1e-10)
    at = result["point_position"]
    along = at.sel(point="coupler.C").values - at.sel(point="coupler.B").values
    np.testing.assert_allclose(along[0] * b[1] - along[1] * b[0], 0, atol=1e-10)
