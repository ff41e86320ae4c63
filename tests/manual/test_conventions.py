"""What docs/conventions.md says of pins in their holes, on linkages whose numbers follow by hand."""

import numpy as np
import pytest

import trunnion
from mechanisms_parts import example
from trunnion.joints.clearance import describing

RHO, RADIUS, LENGTH, WEIGHT = 2e-5, 5e-3, 0.02, 9.81  # m, m, m, N


def crank(*, turned_round=False, pin=None, **joint):
    """A crank of 1 kg, balanced about its bearing A, that turns by 1 rad/s from 0; four positions, 90° apart.

    turned_round: the ground is the joint's second link. pin: other than with the clearance RHO.
    """
    links = ["crank", "ground"] if turned_round else ["ground", "crank"]
    sizes = {"radius": RADIUS, **({"clearance": RHO} if pin is None else pin)}
    return trunnion.analyse(
        trunnion.Mechanism(
            gravity=[0, -WEIGHT],
            links={
                "ground": {"points": {"A": [0, 0]}},
                "crank": {"points": {"A": [0, 0], "B": [0.1, 0]}, "mass": 1.0, "inertia": 1e-3},
            },
            joints={"A": {"type": "revolute", "links": links, "pin": sizes, **joint}},
            drivers={"A": {"speed": -1.0 if turned_round else 1.0}},
        ),
        steps=4,
    )


def rotor(*, centre=None, pin=None, **joint):
    """The same in space about z, weight along −x."""
    point = {"at": [0, 0, 0], "axis": [0, 0, 1], "x": [1, 0, 0]}
    body = {"mass": 1.0, "centre": centre or [0, 0, 0], "inertia": {"xx": 1e-3, "yy": 1e-3, "zz": 1e-3}}
    sizes = {"radius": RADIUS, "clearance": RHO, "length": LENGTH, **(pin or {})}
    return trunnion.analyse(
        trunnion.Mechanism(
            space="spatial",
            gravity=[-WEIGHT, 0, 0],
            links={"ground": {"points": {"A": point}}, "crank": {"points": {"A": point, "B": [0.1, 0, 0]}, **body}},
            joints={"A": {"type": "revolute", "links": ["ground", "crank"], "pin": sizes, **joint}},
            drivers={"A": {"speed": 1.0}},
        ),
        steps=4,
    )


def of(result, name, joint="A"):
    """A variable of a joint at the first position."""
    return result[name].sel(joint=joint).values[..., 0]


def at(result, name, point="crank.A", position=0):
    return result[name].sel(point=point).values[..., position]


def near(found, wanted, share=1e-6):
    """To a share of the clearance."""
    np.testing.assert_allclose(found, wanted, rtol=0, atol=share * RHO)


def test_the_hole_is_on_the_second_link():
    """The pin's axis lies at ρ (cos ξ, sin ξ) in the axes of the hole's link: the crank is off by as much, turned."""
    seat = {"xi": float(np.radians(30))}
    c = RHO * np.array([np.cos(np.radians(30)), 0.5])
    result = crank(seat=seat)
    near(of(result, "seat_offset")[0, :2], c)
    near(at(result, "point_error"), -c)
    near(at(result, "point_error", position=1), [c[1], -c[0]])  # the hole has turned by 90° with the crank
    other = crank(seat=seat, turned_round=True)
    for position in range(4):
        near(at(other, "point_error", position=position), c)  # the hole is in the ground


def test_clearance_is_radial():
    ways = ({"clearance": RHO}, {"hole_radius": RADIUS + RHO}, {"clearance": RHO / 4, "cylindricity": 0.75 * RHO})
    for pin in ways:
        near(at(crank(pin=pin, seat={"xi": 0.0}), "point_error"), [-RHO, 0])


def test_xi_in_the_pin():
    """[P]'s ξ is counted in the pin: ξ + rotation, in (−π, π]."""
    result = crank(seat={"xi": 0.5})
    turns = np.arange(4) * np.pi / 2
    found = result["seat_xi_pin"].sel(joint="A").values
    np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * (0.5 + turns)), atol=1e-12)
    np.testing.assert_allclose(result["seat_xi"].sel(joint="A").values, 0.5, atol=1e-12)
    assert np.all((found > -np.pi) & (found <= np.pi))


def test_a_load_presses_the_pin_its_own_way():
    """The pin carries the crank's weight: it pushes the hole up, lies at its top, and the crank hangs lower by ρ."""
    result = crank(seat="loaded")
    near(of(result, "seat_offset")[0, :2], [0, RHO])
    np.testing.assert_allclose(of(result, "end_force")[0, :2], [0, WEIGHT], atol=1e-4)
    near(at(result, "point_error"), [0, -RHO])
    near(of(result, "contact_position")[0, :2], [0, RADIUS])  # on the pin, and on the hole ρ lower
    other = crank(seat="loaded", turned_round=True)
    np.testing.assert_allclose(of(other, "end_force")[0, :2], [0, -WEIGHT], atol=1e-4)
    near(of(other, "seat_offset")[0, :2], [0, -RHO])
    near(at(other, "point_error"), [0, -RHO])


@pytest.mark.parametrize("factor", [1.0, 4 / 3])
@pytest.mark.parametrize("turned_round", [False, True])
def test_friction_turns_the_seat(turned_round, factor):
    """By atan μ, in the sense in which the second link turns against the first; the pair factor does not count."""
    result = crank(seat="loaded", turned_round=turned_round, friction={"coefficient": 0.3, "pair_factor": factor})
    sense, up = (-1, -1) if turned_round else (1, 1)
    angle = up * np.pi / 2 + sense * np.arctan(0.3)
    near(of(result, "seat_offset")[0, :2], RHO * np.array([np.cos(angle), np.sin(angle)]))


def test_end_1_is_the_lower_one():
    """ξ = 0, β = 180°: end 1 at ξ + β/2, on +y, at z = −H/2, end 2 on −y; the crank leans the other way."""
    result = rotor(seat={"beta": float(np.pi), "xi": 0.0})
    near(of(result, "seat_offset")[:, :2], [[0, RHO], [0, -RHO]])
    lean = np.arctan(2 * RHO / LENGTH)
    np.testing.assert_allclose(result["link_error"].sel(link="crank").values[:, 0], [-lean, 0, 0], atol=1e-9)
    near(at(result, "point_error"), [0, 0, 0])  # the axes cross in the middle of the bearing
    deep = LENGTH / 2 * np.cos(lean) + (RADIUS + RHO) * np.sin(lean)  # ends of the hole, at its wall
    near(of(result, "contact_position")[:, 2], [-deep, deep])


def test_the_middle_of_the_bearing_is_where_the_pin_leans():
    """pin.offset along z: the crank turns about that point, so its own point A is off by lean times offset."""
    result = rotor(seat={"beta": float(np.pi), "xi": 0.0}, pin={"offset": 0.05})
    lean = np.arctan(2 * RHO / LENGTH)
    near(at(result, "point_error"), [0, -0.05 * np.sin(lean), 0.05 * (1 - np.cos(lean))])


def test_beta_is_above_minus_pi_up_to_pi():
    for angle in (0.0, 1.0, np.pi / 2, np.pi, -2.0):
        c = np.array([np.cos(angle), np.sin(angle)])
        assert float(describing((c[0], c[1]), (-c[0], -c[1]))[0]) == np.pi
    beta, xi = describing((0.0, -1.0), (1.0, 0.0))  # from end 2 to end 1, clockwise
    assert float(beta) == pytest.approx(-np.pi / 2)
    assert float(xi) == pytest.approx(-np.pi / 4)


def test_the_farther_end_carries_less():
    """A mass a above the middle of the bearing: the lever rule gives W (½ ∓ a/H) along x at end 1 and end 2."""
    aside = 0.004
    force = of(rotor(seat="loaded", centre=[0, 0, aside]), "end_force")
    share = aside / LENGTH
    np.testing.assert_allclose(force[:, 0], WEIGHT * np.array([0.5 - share, 0.5 + share]), atol=1e-4)


def slider(seat):
    """A slider on a guide along x, pushed by hand."""
    axis = {"at": [0, 0], "axis": [1, 0]}
    return trunnion.analyse(
        trunnion.Mechanism(
            links={"ground": {"points": {"S": axis}}, "slider": {"points": {"S": axis}}},
            joints={"S": {"type": "prismatic", "links": ["ground", "slider"], "seat": seat,
                          "guide": {"length": LENGTH, "clearance": RHO}}},
            drivers={"S": {"speed": 1.0, "range": [0.0, 0.1]}},
        ),
        steps=2,
    )  # fmt: skip


def test_guide():
    """To either side, across; end 1 is the rear one; eᵢ = ρ cos(ξ ± β/2) along the normal, the slide turned by +90°."""
    result = slider({"xi": 0.0})
    near(of(result, "seat_offset", "S")[:, 1], [RHO, RHO])
    near(at(result, "point_error", "slider.S"), [0, -RHO])
    leant = slider({"beta": float(np.pi), "xi": float(np.pi / 2)})
    near(of(leant, "seat_offset", "S")[:, 1], [-RHO, RHO])
    turned = float(leant["link_error"].sel(link="slider")[0])
    assert turned == pytest.approx(-np.arctan(2 * RHO / LENGTH), rel=1e-9)


def test_ball():
    """The ball is on the first link; the direction is that in its socket, in the element on the second."""
    rssr = example("rssr-with-play")
    values = {"joints.C.pin.clearance": RHO, "joints.C.seat": {"direction": [0, 0, 1]}}
    result = trunnion.analyse(rssr.with_values({"joints.D.seat": "free"} | values), steps=4)
    for position in range(4):
        way = at(result, "point_position", "rod.C", position) - at(result, "point_position", "rocker.C", position)
        near(way, RHO * np.array([0, -np.sin(np.pi / 3), 0.5]))  # z of the rocker is its axis


def test_misalignment():
    """The hole leans towards +x of the crank and is moved there: the crank leans and lies the other way."""
    tilt, offset = 1e-3, 3e-5
    result = rotor(misalignment={"tilt": tilt, "offset": offset}, pin={"offset": 0.05})
    np.testing.assert_allclose(result["link_error"].sel(link="crank").values[:, 0], [0, -tilt, 0], atol=1e-12)
    # about the middle of the bearing, 50 mm up: where the hole has gone by `offset`, A is 50 mm below along the crank
    middle = at(result, "point_error") + 0.05 * np.array([-np.sin(tilt), 0, np.cos(tilt) - 1])
    near(middle, [-offset * np.cos(tilt), 0, -offset * np.sin(tilt)], 1e-3)
    flat = crank(misalignment={"offset": offset, "towards": float(np.pi / 2)}, pin={})
    near(at(flat, "point_error"), [0, -offset])
