"""Does it assemble at all: closed forms, an independent closure with SciPy's optimiser, invariances, what is said."""

import json

import numpy as np
import pytest
from numpy.linalg import inv
from scipy.optimize import minimize

import trunnion
from mechanisms_parts import joined
from trunnion.studies.assembly import AssemblyStatus

LENGTHS = (0.100, 0.030, 0.090, 0.070)  # ground, crank, coupler, rocker
PIN = 0.020
LEAN = {"tilt": np.radians(0.2)}
UPRIGHT = {"axis": [0, 0, 1], "x": [1, 0, 0]}
OPEN = 1e-12


def hinges(apart, pin, second, kind="revolute"):
    """A leaf on two coaxial hinges."""
    points = {"A": {"at": [0, 0, 0], **UPRIGHT}, "B": {"at": [0, 0, apart], **UPRIGHT}}
    return trunnion.Mechanism(
        space="spatial",
        links={"frame": {"points": points}, "leaf": {"points": points}},
        joints=joined(f"frame -A- leaf, frame -B:{kind}- leaf", B=second),
        joint_defaults={"pin": {"radius": 0.005, "length": pin}},
        ground="frame",
        drivers={"A": {"speed": 1.0}},
    )


def four_bar(errors, pins=None):
    """A planar four-bar drawn in space, pins upright; errors and pins by joint."""
    ground, crank, coupler, rocker = ({"at": [length, 0, 0], **UPRIGHT} for length in LENGTHS)
    here = {"at": [0, 0, 0], **UPRIGHT}
    parts = {
        name: {"pin": {"length": PIN, **(pins or {}).get(name, {})}}
        | ({"misalignment": errors[name]} if name in errors else {})
        for name in "ABCD"
    }
    return {
        "space": "spatial",
        "links": {
            "ground": {"points": {"A": here, "D": ground}},
            "crank": {"points": {"A": here, "B": crank}},
            "coupler": {"points": {"B": here, "C": coupler}},
            "rocker": {"points": {"D": here, "C": rocker}},
        },
        "joints": joined("ground -A- crank -B- coupler -C- rocker, ground -D- rocker", **parts),
        "joint_defaults": {"pin": {"radius": 0.005}},
        "drivers": {"A": {"speed": 1.0}},
        "assembly": {"C": [0.03, 0.07, 0]},
    }


def solved(data, steps=12, **options):
    mechanism = data if isinstance(data, trunnion.Mechanism) else trunnion.Mechanism(**data)
    return trunnion.assemble(mechanism, steps, **options)


def sound(result):
    """Every position closes exactly, and no position could do with less."""
    assert float(result.closure_residual.max()) < OPEN
    assert float(np.abs(result.certificate).max()) < 1e-9


def leaned(apart, pin, tilt):
    """Smallest clearance of two coaxial pin holes, one leaned by `tilt`, of a pin line free along its axis.

    In the plane of the tilt the line x = a + m z passes the holes' end planes; the second hole's slope against it is
    tan(δ − φ), m = tan φ. Best is to go through the middle of the leaned hole (b = 0) with

        H/2 tan(δ − φ) = (D + H/2) tan φ

    so that both ends there and the far end of the other hole bear alike. With T = tan δ:
    ρ = (√((D + H)² + (2 D + H) H T²) − (D + H))/(2 T), for small angles δ H (2 D + H)/(4 (D + H)).
    """
    t, total = np.tan(tilt), apart + pin
    grown = (2 * apart + pin) * pin * t * t
    return float(grown / (np.sqrt(total**2 + grown) + total) / (2 * t))


@pytest.mark.spread(1)
@pytest.mark.parametrize(("apart", "pin"), [(0.3, 0.03), (0.05, 0.04)])
@pytest.mark.parametrize("degrees", [0.02, 0.2, 1.0])
def test_hinges_with_a_leaned_hole(apart, pin, degrees):
    lean = {"misalignment": {"tilt": np.radians(degrees), "towards": 0.7}}
    found = solved(hinges(apart, pin, lean, "cylindrical"), 3)
    sound(found)
    wanted = leaned(apart, pin, np.radians(degrees))
    small = np.radians(degrees) * pin * (2 * apart + pin) / (4 * (apart + pin))
    assert wanted == pytest.approx(small, rel=2e-4)
    np.testing.assert_allclose(found.needed_clearance, wanted, rtol=1e-7)
    floating = {**lean, "pin": {"end_float": 1e-3}}  # the float moves the pin's ends a little along the hole
    np.testing.assert_allclose(
        solved(hinges(apart, pin, floating), 3).needed_clearance, wanted, rtol=1e-6 + np.radians(degrees) ** 2
    )


def test_hinges_with_a_hole_out_of_line():
    """The line through both middles leans by e/D in each hole: ρ = e H/(2 D), exact, for the holes are parallel."""
    apart, pin, offset = 0.3, 0.03, 1e-4
    second = {"misalignment": {"offset": offset, "offset_towards": 2.0}}
    found = solved(hinges(apart, pin, second, "cylindrical"), 6)
    sound(found)
    np.testing.assert_allclose(found.needed_clearance, offset * pin / (2 * apart), rtol=1e-7)


def along(x):
    """A way along x."""
    found = np.eye(4)
    found[0, 3] = x
    return found


def turned(angle):
    """A turn about z."""
    found = np.zeros((*np.shape(angle), 4, 4))
    c, s = np.cos(angle), np.sin(angle)
    found[..., 0, 0], found[..., 1, 1], found[..., 1, 0], found[..., 0, 1] = c, c, s, -s
    found[..., 2, 2] = found[..., 3, 3] = 1.0
    return found


def leaned_by(slope, way):
    """The least turn that lays z along (s, t, 1), and a way in the plane; slope and way (…, 2).

    Rodrigues' formula about (−t, s, 0) by φ, tan φ = |(s, t)|: with c = cos φ, sin φ = c |(s, t)| and
    (1 − cos φ)/|(s, t)|² = c²/(1 + c), nothing is divided by an angle that may vanish.
    """
    s, t = slope[..., 0], slope[..., 1]
    c = 1 / np.sqrt(1 + s * s + t * t)
    k = c * c / (1 + c)
    found = np.zeros((*np.broadcast_shapes(slope.shape[:-1], way.shape[:-1]), 4, 4))
    found[..., 0, 0], found[..., 1, 1], found[..., 2, 2] = 1 - k * s * s, 1 - k * t * t, c
    found[..., 0, 1] = found[..., 1, 0] = -k * s * t
    found[..., 0, 2], found[..., 1, 2] = c * s, c * t
    found[..., 2, 0], found[..., 2, 1] = -c * s, -c * t
    found[..., :2, 3], found[..., 3, 3] = way, 1.0
    return found


class Loop:
    """The closure of the four-bar in homogeneous matrices, no code shared with the library; (…, turns or ends)."""

    def __init__(self, errors, crank):
        ground, length, coupler, rocker = LENGTHS
        self.crank = crank
        self.holes = {joint: self.leaned(errors.get(joint, {}), rocker * (joint == "C")) for joint in "ABCD"}
        self.turned, self.driven = turned(np.array(crank)), along(length)
        self.along, self.ground = along(coupler), along(ground)

    @staticmethod
    def leaned(error, x):
        """Frame of a hole at x, leaned by its error."""
        way = error.get("towards", 0.0)
        side = np.array([np.cos(way), np.sin(way)])
        return along(x) @ leaned_by(np.tan(error.get("tilt", 0.0)) * side, error.get("offset", 0.0) * side)

    def hole(self, joint, c):
        """Frame of the pin in a link: as its ends c (…, 2, 2) lie in the leaned hole."""
        one, two = c[..., 0, :], c[..., 1, :]
        return np.asarray(self.holes[joint] @ leaned_by((two - one) / PIN, (one + two) / 2))

    def open(self, q, c):
        """Turn and way (over the ground's length) by which the rocker misses its bearing; c (…, joint, end, 2)."""
        at = self.turned @ inv(self.hole("A", c[..., 0, :, :]))
        at = at @ self.driven @ turned(q[..., 0]) @ inv(self.hole("B", c[..., 1, :, :]))
        at = at @ self.along @ turned(q[..., 1]) @ inv(self.hole("C", c[..., 2, :, :]))
        missing = inv(self.ground @ turned(q[..., 2])) @ at @ self.hole("D", c[..., 3, :, :])
        turn = [missing[..., i, j] - missing[..., j, i] for i, j in ((2, 1), (0, 2), (1, 0))]
        way = [missing[..., i, 3] / LENGTHS[0] for i in range(3)]
        return np.stack([*(one / 2 for one in turn), *way], axis=-1)

    def home(self):
        """Turns of B, C and D of the ideal linkage, the coupler's end above the ground."""
        ground, crank, coupler, rocker = LENGTHS
        b = crank * np.exp(1j * self.crank)
        way = ground - b
        inner = np.arccos((coupler**2 + abs(way) ** 2 - rocker**2) / (2 * coupler * abs(way)))
        angle = np.angle(way) + inner
        rock = np.angle(b + coupler * np.exp(1j * angle) - ground)
        return np.array([angle - self.crank, rock - angle, rock])

    def closed_within(self, radius, seed):
        """Least opening, over radius/pin length, with all ends within `radius`, from a random start."""
        rng, home, unit = np.random.default_rng(seed), self.home(), radius / PIN

        def rows(x):
            return self.open(home + unit * x[..., :3], radius * x[..., 3:].reshape(*x.shape[:-1], 4, 2, 2)) / unit

        def slope(x):
            step = 1e-4
            return 2 * rows(x) @ ((rows(x + step * np.eye(19)) - rows(x - step * np.eye(19))) / (2 * step)).T

        room = {  # each end within the radius
            "type": "ineq", "fun": lambda x: 1 - np.sum(x[3:].reshape(8, 2) ** 2, axis=1),
            "jac": lambda x: np.hstack([np.zeros((8, 3)), -2 * np.kron(np.eye(8), [1, 1]) * x[3:]]),
        }  # fmt: skip
        start = np.append(rng.uniform(-1, 1, 3), rng.uniform(-0.7, 0.7, 16))
        found = minimize(
            lambda x: float(np.sum(rows(x) ** 2)), start, jac=slope, method="SLSQP", constraints=room,
            options={"ftol": 1e-16, "maxiter": 400},
        )  # fmt: skip
        return float(np.max(np.abs(rows(found.x))))


@pytest.mark.slow
def test_four_bar_against_an_independent_closure():
    errors = {"B": {**LEAN, "towards": 0.5}}
    found = solved(four_bar(errors))
    sound(found)
    place = int(np.argmax(found.needed_clearance.values))
    need = float(found.needed_clearance[place])
    loop = Loop(errors, float(found.drive_coordinate[0, place]))
    offsets = found.uniform_offset.isel(position=place).values[:, :2, :2]
    np.testing.assert_allclose(np.hypot(*np.moveaxis(offsets, -1, 0)).max(), need, rtol=1e-9)

    def turns(q):
        return loop.open(q, offsets)

    q = loop.home()  # the library's offsets close the other geometry: three turns, six equations
    for _ in range(8):
        slope = np.stack([(turns(q + step) - turns(q - step)) / 2e-6 for step in 1e-6 * np.eye(3)], axis=-1)
        q = q - np.linalg.lstsq(slope, turns(q), rcond=None)[0]
    assert np.abs(turns(q)).max() < 1e-12
    above = loop.closed_within(1.001 * need, 0)
    below = [loop.closed_within(0.999 * need, seed) for seed in range(2)]
    assert above < 1e-8
    assert min(below) > 1e-3  # from every start the same
    assert max(below) < 1.001 * min(below)


@pytest.mark.slow
def test_stated_clearances_enough_and_not():
    errors = {"B": LEAN}
    rigid = solved(four_bar(errors))
    assert (rigid.status == AssemblyStatus.RIGID).all()
    need = float(rigid.smallest_clearance)
    enough = solved(four_bar(errors, {name: {"clearance": 1.0001 * need} for name in "ABCD"}))
    assert (enough.status == AssemblyStatus.FITS).all()
    assert float(enough.largest_share) == pytest.approx(1 / 1.0001, rel=1e-9)
    assert [row["severity"] for row in json.loads(enough.attrs["findings"])] == ["note"]
    short = solved(four_bar(errors, {name: {"clearance": 0.9 * need} for name in "ABCD"}))
    np.testing.assert_array_equal(short.status == AssemblyStatus.SHORT, short.needed_clearance > 0.9 * need)
    np.testing.assert_allclose(short.needed_share * 0.9 * need, short.needed_clearance, rtol=1e-9)
    (told,) = json.loads(short.attrs["findings"])
    assert told["severity"] == "error"
    assert told["figures"] == pytest.approx({"share": 1 / 0.9, "clearance": need}, rel=1e-9)


@pytest.mark.slow
def test_part_is_the_derivative():
    """A little more clearance in one pin lowers the needed share of all by its part."""
    errors, clearance, more = {"B": LEAN}, 2e-5, 1e-9
    flat = solved(four_bar(errors, {name: {"clearance": clearance} for name in "ABCD"}), 4)
    for joint in "AC":
        pins = {name: {"clearance": clearance + more * (name == joint)} for name in "ABCD"}
        slope = (solved(four_bar(errors, pins), 4).needed_share / flat.needed_share - 1) * clearance / more
        np.testing.assert_allclose(-slope, flat.stated_part.sel(joint=joint).sum("end"), atol=2e-4)


@pytest.mark.spread(2)
@pytest.mark.parametrize("name", ["bennett", "sarrus", "rssr", "durango-fourbar"])
def test_axes_that_fit_and_joints_that_do_not_constrain_twice_need_nothing(name):
    found = solved(trunnion.read(f"examples/{name}.yaml"), 12)
    assert (found.status == AssemblyStatus.FITS).all()
    assert (found.needed_clearance == 0).all()
    assert float(found.smallest_clearance) == 0


@pytest.mark.slow
def test_where_it_cannot_be_assembled():
    """A linkage that does not turn all the way says where, with its answer elsewhere."""
    data = four_bar({"B": LEAN})
    data["links"]["crank"]["points"]["B"]["at"] = [0.065, 0, 0]
    found = solved(data, 18)
    apart = found.status == AssemblyStatus.APART
    assert 0 < int(apart.sum()) < 18
    assert np.isnan(found.needed_clearance[apart]).all()
    assert np.isfinite(found.needed_clearance[~apart]).all()
    assert float(found.closure_residual.max()) < OPEN
    assert any(row["code"] == "assembly.apart" for row in json.loads(found.attrs["findings"]))


@pytest.mark.slow
def test_errors_that_are_not_small():
    """The sequence of cone programmes settles on the exact closure there too; the need is nearly proportional."""
    degrees = 15.0
    small, large = (solved(four_bar({"B": {"tilt": np.radians(tilt)}}), 4) for tilt in (0.01, degrees))
    sound(large)
    ratio = np.tan(np.radians(degrees)) / np.radians(0.01)
    np.testing.assert_allclose(large.needed_clearance, ratio * small.needed_clearance, rtol=0.02 * degrees)
