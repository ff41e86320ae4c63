"""Seats that are given, misaligned axes and dimensions off nominal against models changed by hand."""

import copy

import numpy as np
import pytest

import trunnion
from mechanisms import MODELS, four_bar, model
from mechanisms_space import MODELS as SPACE_MODELS
from mechanisms_space import rssr
from reference.maximal_space import Drive, Frame, Linkage, element, point, pose_of, published, rotation
from reference.seat_oracle import moved
from trunnion.joints.clearance import CLEARANCE_MODELS
from trunnion.solve.run import prepare

START, RHO, LENGTH, OFFSET = 0.1, 3e-5, 0.025, 0.004
RADIUS = 0.005


def linkage(**joint):
    """The RSSR with something stated of its output bearing, which lies off its point along the axis."""
    data = copy.deepcopy(rssr(start=START).data)
    data["assembly"] = {"D": 1.3}
    data["joint_defaults"]["pin"] |= {"radius": RADIUS, "bearing": LENGTH}
    data["joints"]["D"] |= {"pin": {"offset": OFFSET, "clearance": RHO, **joint.pop("pin", {})}, **joint}
    return data


def analysed(data, steps=24):
    return trunnion.analyse(trunnion.Mechanism(trunnion=1, **data), steps=steps)


def by_hand(data, shift):
    """The model whose output bearing is moved in the rocker, about the middle of the bearing."""
    middle = Frame(np.array([0.0, 0.0, OFFSET]), np.eye(3))
    links = copy.deepcopy(data["links"])
    own = element(links["rocker"], "D") @ middle @ shift @ middle.inverse()
    links["rocker"]["points"]["D"] = point(own)
    return {**data, "links": links}


def motions(data, result, i):
    """Motion at one position by another program, from near where Trunnion has it."""
    home = {link: published(result, link, i) for link in ("crank", "rod", "rocker")}
    turned = float(result.joint_rotation.sel(joint="A").values[i])
    return Linkage(data).move(home, {"A": Drive(turned, 30.0)})


def agrees(result, data):
    """Crank and rocker of a result against a model, at a few positions; returns the last motions."""
    found = {}
    for i in (0, 7, 15, 23):
        found = motions(data, result, i)
        for link in ("crank", "rocker"):
            at = published(result, link, i)
            np.testing.assert_allclose(at.place, found[link].frame.place, rtol=0, atol=1e-13)
            np.testing.assert_allclose(at.axes, found[link].frame.axes, rtol=0, atol=1e-12)
    return found


def leaned(across, place):
    """z turned towards (across, 1) by the shortest way, moved."""
    size = float(np.hypot(*across))
    turn = rotation([-across[1], across[0], 0.0], float(np.arctan(size))) if size else np.eye(3)
    return Frame(np.array([*place, 0.0]), turn)


@pytest.mark.spread(1)
@pytest.mark.parametrize(
    "degrees", [(0.0, 0.0), (0.0, 40.0), (180.0, 0.0), (180.0, -70.0), (95.0, 150.0), (-60.0, 10.0)]
)
def test_given_seat(degrees):
    """β and ξ as stated: place and lean of the bearing, its ends, where they touch the wall of the hole, ξ of [P]."""
    beta, xi = np.radians(degrees)
    data = linkage(seat={"beta": float(beta), "xi": float(xi)})
    result = analysed(data)
    ends = RHO * np.array([[np.cos(a), np.sin(a)] for a in (xi + beta / 2, xi - beta / 2)])
    last = agrees(result, by_hand(data, leaned((ends[1] - ends[0]) / LENGTH, ends.mean(axis=0))))
    at = {name: result[name].sel(joint="D").values[..., -1] for name in
          ("seat_offset", "seat_beta", "seat_xi", "seat_xi_pin", "contact_position")}  # fmt: skip
    np.testing.assert_allclose(at["seat_offset"][:, :2], ends, rtol=0, atol=1e-19)
    assert np.exp(1j * at["seat_beta"]) == pytest.approx(np.exp(1j * beta), abs=1e-12)
    if abs(degrees[0]) < 180:
        assert np.exp(1j * at["seat_xi"]) == pytest.approx(np.exp(1j * xi), abs=1e-12)
    hole = last["rocker"].frame @ element(data["links"]["rocker"], "D")
    hole = hole @ Frame(np.array([0.0, 0.0, OFFSET]), np.eye(3))
    pin = element(data["links"]["ground"], "D")
    u = pin.axes[:, 2]
    for end, z in enumerate((-LENGTH / 2, LENGTH / 2)):
        touch = at["contact_position"][end]
        local = hole.axes.T @ (touch - hole.place)
        np.testing.assert_allclose(local, [*(ends[end] / RHO * (RADIUS + RHO)), z], rtol=0, atol=1e-14)
        # where the pin touches it is the pin's surface too, but for the ellipse of its section
        arm = touch - pin.place
        away = np.linalg.norm(arm - u * (u @ arm))
        assert away == pytest.approx(RADIUS, abs=2 * RADIUS * (2 * RHO / LENGTH) ** 2)
    # ξ seen from the pin: the direction of the seat in the first link's frame, but for the lean
    seat = hole.axes @ [np.cos(at["seat_xi"]), np.sin(at["seat_xi"]), 0.0]
    seen = np.angle(complex(pin.axes[:, 0] @ seat, pin.axes[:, 1] @ seat))
    assert np.exp(1j * at["seat_xi_pin"]) == pytest.approx(np.exp(1j * seen), abs=2 * RHO / LENGTH)


@pytest.mark.slow
@pytest.mark.parametrize("aside", [None, 1.9])
def test_misaligned_axis(aside):
    """Leaned by `tilt` towards `towards`, moved along `offset_towards`; beside the ideal one."""
    tilt, towards, offset = np.radians(0.4), 0.7, 2e-4
    stated = {"tilt": float(tilt), "towards": towards, "offset": offset}
    centred = {"offset": 0.0}  # the middle of the bearing is the joint's point
    data = linkage(misalignment=stated | ({"offset_towards": aside} if aside is not None else {}), pin=centred)
    result, ideal = analysed(data), analysed(linkage(pin=centred))
    way = towards if aside is None else aside
    across = np.tan(tilt) * np.array([np.cos(towards), np.sin(towards)])
    shift = leaned(across, offset * np.array([np.cos(way), np.sin(way)]))
    links = copy.deepcopy(data["links"])
    links["rocker"]["points"]["D"] = point(element(links["rocker"], "D") @ shift)
    agrees(result, {**data, "links": links})
    hinges = ["A", "D"]  # what a ball has turned by depends on the spin of the rod, which is free
    turned = (result.joint_rotation - ideal.joint_rotation).sel(joint=hinges)
    np.testing.assert_allclose(result.joint_rotation_error.sel(joint=hinges).values, turned.values, atol=1e-14)
    gap = result.point_position - ideal.point_position
    np.testing.assert_allclose(result.point_error.values, gap.values, rtol=0, atol=1e-15)
    force = result.reaction_force - ideal.reaction_force
    np.testing.assert_allclose(result.reaction_force_change.values, force.values, rtol=0, atol=1e-9)


def test_dimensions_off_nominal():
    """A point and a start angle off by `errors`: the model with those numbers, and the difference to that without."""
    data = copy.deepcopy(model(four_bar(), friction=0.1))
    data["errors"] = {"links.rocker.points.C.x": 1e-3, "links.coupler.points.C.y": -2e-3}
    changed = copy.deepcopy(model(four_bar(), friction=0.1))
    changed["links"]["rocker"]["points"]["C"] = [0.701, 0.0]
    changed["links"]["coupler"]["points"]["C"] = [0.9, -0.002]
    result, built, meant = analysed(data), analysed(changed), analysed(model(four_bar(), friction=0.1))
    for name in ("link_angle", "point_position", "reaction_force", "drive_effort", "friction_power"):
        np.testing.assert_allclose(result[name].values, built[name].values, rtol=0, atol=1e-9)
    turned = np.angle(np.exp(1j * (built.link_angle - meant.link_angle).values))
    np.testing.assert_allclose(result.link_error.values, turned, rtol=0, atol=1e-14)
    change = (built.drive_effort - meant.drive_effort).values
    np.testing.assert_allclose(result.drive_effort_change.values, change, rtol=0, atol=1e-9)
    assert float(result.efficiency_ideal) == pytest.approx(float(meant.efficiency), nan_ok=True)


NOW = np.array([0.0])


def offsets_for(space, data, size, seed):
    """Random offsets of every joint that has a model of its play."""
    rng, found = np.random.default_rng(seed), {}
    for name, joint in data["joints"].items():
        if joint["type"] in CLEARANCE_MODELS[space]:
            keys = [key for end in CLEARANCE_MODELS[space][joint["type"]].ends for key in end]
            found |= {f"seats.{name}.{key}": float(size * rng.uniform(-1, 1)) for key in keys}
    return found


@pytest.mark.spread(2)
@pytest.mark.parametrize("name", SPACE_MODELS)
def test_mechanisms_in_space_with_offsets_in_every_joint(name):
    """Frames of all links against maximal coordinates, to 1e-10: offsets up to 1 mm, bearings off their points."""
    drawn = SPACE_MODELS[name]()
    seats = offsets_for("spatial", drawn.data, 1e-3, seed=4)
    assert seats
    run = prepare(trunnion.Mechanism(trunnion=1, **drawn.data))
    motions = run.solve(NOW, values={**run.values, **seats}).walk.motions
    other = Linkage(moved(drawn.data, seats))
    drive = {joint: Drive(float(run.system.drive(run.values, joint, 0.0)[0])) for joint in drawn.data["drivers"]}
    home = drawn.home if drawn.home else {}
    frames = other.move(home, drive)
    for link in other.moving:
        if link in other.free:
            continue
        for found, expected in zip(pose_of(motions[link].frame), frames[link].frame, strict=True):
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


def moved_planar(data, seats, guide):
    """The planar model with second elements moved as the offsets say; loads stay where they are."""
    links = {name: {**link, "points": dict(link["points"])} for name, link in data["links"].items()}
    loads = {name: dict(load) for name, load in data.get("loads", {}).items()}
    for load in loads.values():
        if "at" in load:
            at = links[load["link"]]["points"][load["at"]]
            load["at"] = f"under {load['at']}"
            links[load["link"]]["points"][load["at"]] = at["at"] if isinstance(at, dict) else at
    for name, joint in data["joints"].items():
        if f"seats.{name}.1.y" not in seats:
            continue
        points = links[joint["links"][1]]["points"]
        if joint["type"] == "revolute":
            points[name] = [n + seats[f"seats.{name}.1.{axis}"] for n, axis in zip(points[name], "xy", strict=True)]
        else:
            axis = complex(*points[name]["axis"]) / abs(complex(*points[name]["axis"]))
            y1, y2 = (seats[f"seats.{name}.{end}.y"] for end in (1, 2))
            turned = axis * np.exp(1j * np.arctan((y2 - y1) / guide))
            at = complex(*points[name]["at"]) + 1j * axis * (y1 + y2) / 2
            points[name] = {"at": [at.real, at.imag], "axis": [turned.real, turned.imag]}
    return {**data, "links": links, "loads": loads}


@pytest.mark.spread(12)
@pytest.mark.parametrize("name", MODELS)
def test_planar_mechanisms_with_offsets_in_every_joint(name):
    """Seats as values and a model with its points moved are one mechanism: poses, forces and drives to 1e-9."""
    data, guide = model(MODELS[name](), friction=0.1), 0.4
    seats = offsets_for("planar", data, 1e-3, seed=5)
    run = prepare(trunnion.Mechanism(trunnion=1, **data))
    time = run.cycle.times(7)
    one = run.solve(time, values={**run.values, **seats})
    other = prepare(trunnion.Mechanism(trunnion=1, **moved_planar(data, seats, guide))).solve(time)
    for link, motion in one.walk.motions.items():
        for a, b in zip(motion.frame, other.walk.motions[link].frame, strict=True):
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-10)
    for driver, effort in one.efforts.items():
        expected = np.asarray(other.efforts[driver])
        np.testing.assert_allclose(effort, expected, rtol=0, atol=1e-8 * np.nanmax(np.abs(expected)))
