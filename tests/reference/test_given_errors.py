"""Seats that are given, misaligned axes and dimensions off nominal against models changed by hand."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest
import xarray as xr

import trunnion
from mechanisms import four_bar, model
from mechanisms_space import rssr
from reference.maximal_space import Array, Data, Drive, Frame, Linkage, Motion, element, point, rotation

START, RHO, LENGTH, OFFSET = 0.1, 3e-5, 0.025, 0.004
RADIUS = 0.005


def linkage(**joint: Any) -> Data:
    """The RSSR with something stated of its output bearing, which lies off its point along the axis."""
    data = copy.deepcopy(rssr(start=START).data)
    data["assembly"] = {"D": 1.3}
    data["joint_defaults"]["pin"] |= {"radius": RADIUS, "bearing": LENGTH}
    pin = {"offset": OFFSET, "clearance": RHO, **joint.pop("pin", {})}
    data["joints"]["D"] |= {"pin": pin, **joint}
    return data


def analysed(data: Data, steps: int = 24) -> xr.Dataset:
    return trunnion.analyse(trunnion.Mechanism(trunnion=1, **data), steps=steps)


def by_hand(data: Data, shift: Frame) -> Data:
    """The model whose output bearing is moved in the rocker, about the middle of the bearing."""
    middle = Frame(np.array([0.0, 0.0, OFFSET]), np.eye(3))
    links = copy.deepcopy(data["links"])
    own = element(links["rocker"], "D") @ middle @ shift @ middle.inverse()
    links["rocker"]["points"]["D"] = point(own)
    return {**data, "links": links}


def motions(data: Data, result: xr.Dataset, i: int) -> dict[str, Motion]:
    """Motion at one position by another program, from near where Trunnion has it."""
    home = {}
    for link in ("crank", "rod", "rocker"):
        w, x, y, z = result.link_rotation.sel(link=link).values[:, i]
        angle = 2 * np.arctan2(np.linalg.norm([x, y, z]), w)
        axes = rotation([x, y, z], float(angle)) if angle else np.eye(3)
        home[link] = Frame(result.link_position.sel(link=link).values[:, i], axes)
    turned = float(result.joint_rotation.sel(joint="A").values[i])
    return Linkage(data).move(home, {"A": Drive(turned, 30.0)})


def agrees(result: xr.Dataset, data: Data) -> dict[str, Motion]:
    """Crank and rocker of a result against a model, at a few positions; returns the last motions."""
    found: dict[str, Motion] = {}
    for i in (0, 7, 15, 23):
        found = motions(data, result, i)
        for link in ("crank", "rocker"):
            place = result.link_position.sel(link=link).values[:, i]
            np.testing.assert_allclose(place, found[link].frame.place, rtol=0, atol=1e-13)
            w, *v = result.link_rotation.sel(link=link).values[:, i]
            x = found[link].frame.axes[:, 0]
            turned = np.array([1.0, 0, 0]) + 2 * np.cross(v, np.cross(v, [1.0, 0, 0]) + w * np.array([1.0, 0, 0]))
            np.testing.assert_allclose(turned, x, rtol=0, atol=1e-12)
    return found


def leaned(across: Array, place: Array) -> Frame:
    """z turned towards (across, 1) by the shortest way, moved."""
    size = float(np.hypot(*across))
    turn = rotation([-across[1], across[0], 0.0], float(np.arctan(size))) if size else np.eye(3)
    return Frame(np.array([*place, 0.0]), turn)


@pytest.mark.spread(1)
@pytest.mark.parametrize(
    "degrees", [(0.0, 0.0), (0.0, 40.0), (180.0, 0.0), (180.0, -70.0), (95.0, 150.0), (-60.0, 10.0)]
)
def test_given_seat(degrees: tuple[float, float]) -> None:
    """β and ξ as stated: place and lean of the bearing, its ends, where they touch the wall of the hole, ξ of [P]."""
    beta, xi = np.radians(degrees)
    data = linkage(seat={"beta": float(beta), "xi": float(xi)})
    result = analysed(data)
    ends = RHO * np.array([[np.cos(a), np.sin(a)] for a in (xi + beta / 2, xi - beta / 2)])
    moved = by_hand(data, leaned((ends[1] - ends[0]) / LENGTH, ends.mean(axis=0)))
    last = agrees(result, moved)
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


def test_given_seat_of_a_ball() -> None:
    """The ball lies at ρ in the direction stated in the socket's frame, which is on the second link."""
    data = linkage()
    data["joints"]["C"] |= {"pin": {"radius": 0.007, "clearance": RHO}, "seat": {"direction": [1.0, -2.0, 2.0]}}
    result = analysed(data)
    moved = copy.deepcopy(data)
    at = np.array(moved["links"]["rocker"]["points"]["C"]) + RHO * np.array([1.0, -2.0, 2.0]) / 3
    moved["links"]["rocker"]["points"]["C"] = [float(n) for n in at]
    agrees(result, moved)
    found = result.seat_offset.sel(joint="C").values[0, :, 0]
    np.testing.assert_allclose(found, RHO * np.array([1.0, -2.0, 2.0]) / 3, rtol=1e-14)


@pytest.mark.spread(1)
@pytest.mark.parametrize("aside", [None, 1.9])
def test_misaligned_axis(aside: float | None) -> None:
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


def test_dimensions_off_nominal() -> None:
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


def test_errors_of_what_cannot_be_assembled() -> None:
    """The means of the ideal mechanism have their joints also where there is nothing to take a mean of."""
    data = linkage(misalignment={"tilt": 1e-3})
    data["links"]["rod"]["points"]["C"] = [1e3, 0, 0]
    result = trunnion.analyse(trunnion.Mechanism(**data), 4)
    assert bool((result["status"] == trunnion.Status.NOT_ASSEMBLED).all())
    assert result["friction_power_mean_ideal"].sizes == {"joint": result.sizes["joint"]}
