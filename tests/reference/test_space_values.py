"""Motion of spatial mechanisms, as `trunnion.analyse` has it, against closed forms and published numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import trunnion
from brief import brief
from mechanisms_space import cardan
from reference.maximal_space import Array, Data, Frame, rotation, unrolled
from trunnion.algebra.dual import derivative, seed
from trunnion.solve.run import prepare

SPEED = 2.0


def analysed(data: Data, steps: int) -> xr.Dataset:
    return brief(trunnion.Mechanism(trunnion=1, **data), steps)


def loop(
    kinds: str, twists: Any, distances: Any = (0.0, 0.0, 0.0, 0.0), slide: float = 0.0, start: float = 0.0, **more: Any
) -> Data:
    """A closed chain of four; twists in degrees."""
    names = {"R": "revolute", "C": "cylindrical"}
    rows: list[Data] = [
        {"joint": joint, "type": names[kind], "link": link, "twist": float(np.radians(twist)), "distance": distance}
        for joint, link, kind, twist, distance in zip(
            "ABCD", ("crank", "coupler", "rocker", "ground"), kinds, twists, distances, strict=True
        )
    ]
    if slide:
        rows[0]["slide"] = slide
    return {"space": "spatial", "loop": rows, "drivers": {"A": {"speed": SPEED, "start": start}}, **more}


def value(result: xr.Dataset, name: str, joint: str) -> Array:
    return np.asarray(result[name].sel(joint=joint).values, float)


def turned(result: xr.Dataset, joint: str) -> Array:
    """Rotation of a joint on the unit circle."""
    return np.asarray(np.exp(1j * value(result, "joint_rotation", joint)))


def missed(result: xr.Dataset, rows: list[Data]) -> float:
    """By how much Π Z(θ + ε s) X(α + ε a) of the result's joint motion misses the identity; rad or m."""
    worst = 0.0
    for i in range(result.sizes["position"]):
        found = Frame(np.zeros(3), np.eye(3))
        for row in rows:
            theta, s = (float(value(result, f"joint_{what}", row["joint"])[i]) for what in ("rotation", "slide"))
            found = found @ Frame(np.array([0, 0, s]), rotation([0, 0, 1], theta))
            found = found @ Frame(np.array([row["distance"], 0, 0]), rotation([1, 0, 0], row["twist"]))
        worst = max(worst, float(np.max(np.abs(found.place))), float(np.max(np.abs(found.axes - np.eye(3)))))
    return worst


# ---- RCCC and RSSR ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("general", [False, True])
def test_rccc(general: bool) -> None:
    """Computed from the closure by another program; loop and links with points say the same."""
    data = loop("RCCC", (25, 70, 55, 60), (1.0, 3.0, 2.5, 2.8), slide=0.6, assembly={"D": 1.42})
    result = analysed(unrolled(data) if general else data, 6)
    at = result.isel(position=1)  # 60°
    theta, s = ([float(at[f"joint_{what}"].sel(joint=joint)) for joint in "BCD"] for what in ("rotation", "slide"))
    np.testing.assert_allclose(theta, [1.238548888088, 1.667054049815, 1.420323026783], rtol=0, atol=1e-11)
    np.testing.assert_allclose(s, [-2.984988238051, -1.044125830083, -2.090785153014], rtol=0, atol=1e-11)
    slopes = [float(at[f"joint_{what}_velocity"].sel(joint="D")) / SPEED for what in ("rotation", "slide")]
    np.testing.assert_allclose(slopes, [-0.489974942726, 0.360995313300], rtol=0, atol=1e-11)
    if general:  # there the constant slide is in the place of the joint's point
        result = result.copy()
        result["joint_slide"] = result.joint_slide + 0.6 * (result.joint == "A")
    assert missed(result, data["loop"]) < 1e-12


RSSR = {"a": 0.030, "b": 0.120, "c": 0.070, "d": 0.100, "alpha": np.pi / 3, "s1": 0.010, "s4": 0.020}


def rssr(hint: float, **driver: Any) -> Data:
    """With named dimensions, massless; the angle of the rocker near the start tells the assembly."""
    return {
        "space": "spatial",
        "dimensions": dict(RSSR),
        "links": {
            "ground": {"points": {"A": {"at": [0, 0, 0], "axis": [0, 0, 1], "x": [1, 0, 0]},
                                  "D": {"at": ["d", 0, 0], "axis": [0, "-sin(alpha)", "cos(alpha)"], "x": [1, 0, 0]}}},
            "crank": {"points": {"A": {"at": [0, 0, 0], "axis": [0, 0, 1], "x": [1, 0, 0]}, "B": ["a", 0, "s1"]}},
            "rod": {"points": {"B": [0, 0, 0], "C": ["b", 0, 0]}},
            "rocker": {"points": {"D": {"at": [0, 0, 0], "axis": [0, 0, 1], "x": [1, 0, 0]}, "C": ["c", 0, "s4"]}},
        },
        "joints": {
            "A": {"type": "revolute", "links": ["ground", "crank"]},
            "B": {"type": "spherical", "links": ["crank", "rod"]},
            "C": {"type": "spherical", "links": ["rod", "rocker"]},
            "D": {"type": "revolute", "links": ["ground", "rocker"]},
        },
        "drivers": {"A": {"speed": SPEED, **driver}},
        "assembly": {"D": hint},
    }  # fmt: skip


def rocker_angle(theta: Array, branch: int, **other: float) -> tuple[Array, Array]:
    """ψ of E cos ψ + F sin ψ = G, which is |B − A|² = b² written out, and dψ/dθ of the same equation."""
    a, b, c, d, alpha, s1, s4 = {**RSSR, **other}.values()
    k, x = np.array([0, -np.sin(alpha), np.cos(alpha)])[:, None], np.array([1.0, 0, 0])[:, None]
    y = np.cross(k, x, axis=0)
    ball = np.array([a * np.cos(theta), a * np.sin(theta), s1 + 0 * theta])
    slope = np.array([-a * np.sin(theta), a * np.cos(theta), 0 * theta])
    p = d * x + s4 * k - ball
    e, f = 2 * c * np.sum(p * x, axis=0), 2 * c * np.sum(p * y, axis=0)
    g = b**2 - c**2 - np.sum(p * p, axis=0)
    psi = np.arctan2(f, e) + branch * np.arctan2(np.sqrt(e**2 + f**2 - g**2), g)
    bar = p + c * (np.cos(psi) * x + np.sin(psi) * y)
    turn = c * (np.cos(psi) * y - np.sin(psi) * x)
    return psi, np.sum(bar * slope, axis=0) / np.sum(bar * turn, axis=0)


@pytest.mark.parametrize(("branch", "degrees"), [(1, 73.843222), (-1, -102.423482)])
def test_rssr(branch: int, degrees: float) -> None:
    """ψ on both branches, at 60° as published for this project and over the whole turn by its quadratic equation."""
    start = rocker_angle(np.array([0.0]), branch)[0][0]
    result = analysed(rssr(float(start)), 72)
    theta = np.arange(72) * 2 * np.pi / 72
    psi, slope = rocker_angle(theta, branch)
    np.testing.assert_allclose(turned(result, "D"), np.exp(1j * psi), rtol=0, atol=1e-12)
    np.testing.assert_allclose(value(result, "joint_rotation_velocity", "D") / SPEED, slope, rtol=0, atol=1e-12)
    assert np.degrees(value(result, "joint_rotation", "D")[12]) == pytest.approx(degrees, abs=1e-6)
    assert np.max(np.abs(result.closure_residual.values)) < 1e-12


def test_rssr_sensitivities() -> None:
    """∂ψ/∂(a, b, c, d, α, s₁, s₄) at 60° from the dual part, rad/mm and rad/rad; to the eight digits given."""
    mechanism = trunnion.Mechanism(trunnion=1, **rssr(1.29, start=np.pi / 3))
    run = prepare(mechanism)
    expected = (-0.00714601, -0.01955441, 0.01187232, 0.01702515, 0.26229468, -0.00948836, 0.00611075)
    for (name, number), slope in zip(RSSR.items(), expected, strict=True):
        back = run.solve(np.array([0.0]), values=mechanism.parameters({name: seed(number)}))
        psi, _ = back.walk.coordinates("D")
        unit = 1.0 if name == "alpha" else 1e-3
        assert float(np.ravel(derivative(psi))[0]) * unit == pytest.approx(slope, abs=6e-9), name
        h = 1e-5 * number
        step = [run.solve(np.array([0.0]), values=mechanism.parameters({name: number + n * h})) for n in (-2, -1, 1, 2)]
        near = [float(np.ravel(one.walk.coordinates("D")[0])[0]) for one in step]
        difference = (near[0] - 8 * near[1] + 8 * near[2] - near[3]) / (12 * h)
        assert float(np.ravel(derivative(psi))[0]) == pytest.approx(difference, rel=1e-8), name


# ---- Cardan joints ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("general", [False, True])
@pytest.mark.parametrize("delta", [1.0, 5.0, 15.0, 30.0, 45.0, 70.0])
def test_ideal_cardan(delta: float, general: bool) -> None:
    """tan θ₁ tan θ₄ = −cos δ with the last twist 180° − δ; ω₂/ω₁ = cos δ/(1 − sin²δ sin²γ₁), γ₁ = θ₁ − 90°."""
    data = loop("RCCC", (90, 90, 90, 180 - delta), start=0.01, assembly={"D": -np.pi / 2})
    result = analysed(unrolled(data) if general else data, 72)
    theta, d = value(result, "joint_rotation", "A"), np.radians(delta)
    fourth = value(result, "joint_rotation", "D")
    across = np.sin(theta) * np.sin(fourth) + np.cos(d) * np.cos(theta) * np.cos(fourth)
    np.testing.assert_allclose(across, 0, rtol=0, atol=1e-12)
    ratio = np.cos(d) / (1 - np.sin(d) ** 2 * np.cos(theta) ** 2)
    found = value(result, "joint_rotation_velocity", "D") / SPEED
    np.testing.assert_allclose(found, ratio, rtol=1e-11)
    slope = np.cos(d) * np.sin(d) ** 2 * np.sin(2 * theta) / (1 - np.sin(d) ** 2 * np.cos(theta) ** 2) ** 2
    second = value(result, "joint_rotation_acceleration", "D") / SPEED**2
    np.testing.assert_allclose(second, -slope, rtol=0, atol=1e-10 * max(1.0, float(np.max(np.abs(slope)))))
    for joint in "BCD":
        np.testing.assert_allclose(value(result, "joint_slide", joint), 0, rtol=0, atol=1e-14)


@pytest.mark.spread(1)
@pytest.mark.parametrize("general", [False, True])
@pytest.mark.parametrize("twist", [0.01, 0.1, 0.2, 0.4, 0.5])
@pytest.mark.parametrize("offset", [0.05e-3, 0.5e-3])
def test_imperfect_cardan_closes(twist: float, offset: float, general: bool) -> None:
    """Errors of 0.01° to 0.5° and 0.05 mm to 0.5 mm: 1e-12 at every degree, by the product of its own joint motions."""
    twists, offsets = (90 - twist, 90 + twist, 90 - twist, 135 - twist), (offset, -offset, 2 * offset, offset)
    data = loop("RCCC", twists, offsets)
    result = analysed(unrolled(data) if general else data, 36 if general else 360)
    assert np.isfinite(result.joint_rotation.values).all()
    assert np.max(np.abs(result.closure_residual.values)) < 1e-12
    assert missed(result, data["loop"]) < 1e-12
    slides = value(result, "joint_slide", "C")
    assert np.ptp(slides) > 0.1 * offset, "errors make the pins slide"


def double_cardan(bend: float, turn: float, parallel: bool) -> Data:
    """Two universal joints with a shaft between, which bends by `bend` at both; the far fork turned by `turn`.

    The input lies along z, all shafts in the plane x, z. The output is parallel to the input or goes on bending.
    """
    along = np.array([np.sin(bend), 0, np.cos(bend)])
    out = np.array([0.0, 0, 1]) if parallel else np.array([np.sin(2 * bend), 0, np.cos(2 * bend)])
    far, y = 0.5 * along, [0.0, 1, 0]
    fork = [float(np.cos(turn)), float(np.sin(turn)), 0.0]
    return {
        "space": "spatial",
        "links": {
            "ground": {"points": {"A": {"at": [0, 0, -0.3], "axis": [0, 0, 1]},
                                  "D": {"at": list(far + 0.3 * out), "axis": list(out), "x": y}}},
            "in": {"points": {"A": {"at": [0, 0, -0.3], "axis": [0, 0, 1]}, "B": {"at": [0, 0, 0], "axis": y}}},
            "shaft": {"points": {"B": {"at": [0, 0, 0], "axis": [1, 0, 0]}, "C": {"at": [0, 0, 0.5], "axis": fork}}},
            "out": {"points": {"C": {"at": [0, 0, -0.3], "axis": y},
                               "D": {"at": [0, 0, 0], "axis": [0, 0, 1], "x": y}}},
        },
        "joints": {
            "A": {"type": "revolute", "links": ["ground", "in"]},
            "B": {"type": "universal", "links": ["in", "shaft"]},
            "C": {"type": "universal", "links": ["shaft", "out"]},
            "D": {"type": "cylindrical", "links": ["ground", "out"]},
        },
        "drivers": {"A": {"speed": SPEED}},
        "assembly": {"C": [float(n) for n in far]},
    }  # fmt: skip


@pytest.mark.spread(2)
@pytest.mark.parametrize("parallel", [True, False])
@pytest.mark.parametrize("bend", [10.0, 30.0])
def test_double_cardan(bend: float, parallel: bool) -> None:
    """Equal angles and forks in line: the output runs evenly. A quarter turn wrong: between cos²δ and 1/cos²δ."""
    delta = np.radians(bend)
    even = analysed(double_cardan(delta, 0.0, parallel), 72)
    ratio = np.abs(value(even, "joint_rotation_velocity", "D")) / SPEED
    np.testing.assert_allclose(ratio, 1.0, rtol=0, atol=1e-11)
    np.testing.assert_allclose(value(even, "joint_rotation_acceleration", "D"), 0, rtol=0, atol=1e-9)
    between = np.linalg.norm(even.link_angular_velocity.sel(link="shaft").values, axis=0)
    assert np.ptp(between) > 0.01 * SPEED, "the shaft between runs unevenly"
    odd = analysed(double_cardan(delta, np.pi / 2, parallel), 72)
    ratio = np.abs(value(odd, "joint_rotation_velocity", "D")) / SPEED
    assert float(ratio.min()) == pytest.approx(np.cos(delta) ** 2, rel=1e-10)
    assert float(ratio.max()) == pytest.approx(1 / np.cos(delta) ** 2, rel=1e-10)


# ---- over-constrained -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kinds", ["RRRR", "RCCC"])
def test_spherical_four_bar(kinds: str) -> None:
    """Sides and angles of the two spherical triangles that the diagonal makes."""
    alphas = (30.0, 70.0, 60.0, 80.0)
    more = {"over_constraint": "minimum-norm"} if kinds == "RRRR" else {}
    data = loop(kinds, alphas, start=0.05, assembly={"D": 1.5}, **more)
    result = analysed(data, 48)
    a1, a2, a3, a4 = np.radians(alphas)
    theta = value(result, "joint_rotation", "A")
    cosine = np.cos(a1) * np.cos(a4) - np.sin(a1) * np.sin(a4) * np.cos(theta)
    sine = np.sqrt(1 - cosine**2)
    third = (np.cos(a2) * np.cos(a3) - cosine) / (np.sin(a2) * np.sin(a3))
    np.testing.assert_allclose(np.cos(value(result, "joint_rotation", "C")), third, rtol=0, atol=1e-12)
    near = np.arccos((np.cos(a1) - np.cos(a4) * cosine) / (np.sin(a4) * sine)) * np.sign(np.sin(theta))
    far = np.arccos((np.cos(a2) - np.cos(a3) * cosine) / (np.sin(a3) * sine))
    both = [np.exp(1j * (np.pi - near + branch * far)) for branch in (1, -1)]
    errors = [float(np.max(np.abs(turned(result, "D") - one))) for one in both]
    assert min(errors) < 1e-12
    assert max(errors) > 0.1
    np.testing.assert_allclose(result.point_position.values, 0, rtol=0, atol=1e-13)
    assert missed(result, data["loop"]) < 1e-12


def test_bennett() -> None:
    """tan(θ₁/2) tan(θ₂/2) = sin((β + α)/2)/sin((β − α)/2) up to sign, at every position."""
    alpha, beta, a = 40.0, 100.0, 0.2
    b = a * np.sin(np.radians(beta)) / np.sin(np.radians(alpha))
    data = loop("RRRR", (alpha, beta, alpha, beta), (a, b, a, b), start=0.1, over_constraint="minimum-norm")
    result = analysed(data, 36)
    first, second, third, fourth = (value(result, "joint_rotation", joint) for joint in "ABCD")
    product = np.tan(first / 2) * np.tan(second / 2)
    constant = np.sin(np.radians(beta + alpha) / 2) / np.sin(np.radians(beta - alpha) / 2)
    np.testing.assert_allclose(np.abs(product), constant, rtol=1e-10)
    assert np.ptp(np.sign(product)) == 0
    for one, other in ((first, third), (second, fourth)):  # opposite angles make a whole turn
        np.testing.assert_allclose(np.exp(1j * (one + other)), 1, rtol=0, atol=1e-10)
    assert missed(result, data["loop"]) < 1e-12


def test_no_bennett() -> None:
    """Without sin α : a = sin β : b four pins in space do not move: there is no number, and it is said why."""
    data = loop("RRRR", (40, 100, 40, 100), (0.2, 0.2, 0.2, 0.2), start=0.1, over_constraint="minimum-norm")
    result = trunnion.analyse(trunnion.Mechanism(trunnion=1, **data), 12)
    assert set(result.status.values[1:]) == {int(trunnion.Status.NOT_ASSEMBLED)}
    assert np.isnan(result.joint_rotation.sel(joint="B").values[1:]).all()
    assert "cannot be assembled" in result.attrs["findings"]


@pytest.mark.slow
@pytest.mark.parametrize("rod", [0.060, 0.160])
def test_rod_of_a_wrong_length(rod: float) -> None:
    """The RSSR has numbers where its quadratic equation has a root, the right ones, and nowhere else."""
    with np.errstate(invalid="ignore"):
        expected, _ = rocker_angle(np.linspace(0.0, 6.0, 61), 1, b=rod)
    missing = np.isnan(expected)
    data = rssr(float(expected[0] if not missing[0] else expected[~missing][0]), range=[0.0, 6.0])
    data["dimensions"] = {**RSSR, "b": rod}
    result = analysed(data, 61)
    found = value(result, "joint_rotation", "D")
    assert 5 < missing.sum() < 55
    np.testing.assert_array_equal(np.isnan(found), missing)
    np.testing.assert_allclose(np.exp(1j * found[~missing]), np.exp(1j * expected[~missing]), rtol=0, atol=1e-9)
    assert set(result.status.values[missing]) == {int(trunnion.Status.NOT_ASSEMBLED)}


def test_sarrus() -> None:
    """Two pairs of leaves at right angles: the platform rises straight and does not turn."""
    leaf, half, pin = 0.12, 0.06, {"axis": [0, 0, 1], "x": [1, 0, 0]}
    first, second = {"axis": [0, -1, 0], "x": [1, 0, 0]}, {"axis": [1, 0, 0], "x": [0, 1, 0]}
    ends = {"half": [half, 0, 0], "other": [0, 1.5 * half, 0]}
    links: Data = {
        "ground": {"points": {"A": {"at": ends["half"], **first}, "D": {"at": ends["other"], **second}}},
        "platform": {
            "points": {"C": {"at": ends["half"], **first}, "F": {"at": ends["other"], **second}, "top": [0, 0, 0.3]}
        },
    }
    joints: Data = {}
    for names, long in (("ABC", leaf), ("DEF", 0.8 * leaf)):
        low, high = f"low-{names[0]}", f"high-{names[0]}"
        links[low] = {"points": {names[0]: {"at": [0, 0, 0], **pin}, names[1]: {"at": [long, 0, 0], **pin}}}
        links[high] = {"points": {names[1]: {"at": [0, 0, 0], **pin}, names[2]: {"at": [long, 0, 0], **pin}}}
        for name, pair in zip(names, (["ground", low], [low, high], ["platform", high]), strict=True):
            joints[name] = {"type": "revolute", "links": pair}
    start, end = np.radians([15.0, 50.0])
    height = 2 * leaf * np.sin(start)
    data: Data = {
        "space": "spatial",
        "over_constraint": "minimum-norm",
        "links": links,
        "joints": joints,
        "drivers": {"A": {"speed": SPEED, "range": [start, end]}},
        "assembly": {
            "C": [half, 0, height],
            "F": [0, 1.5 * half, height],
            "E": [0, 1.5 * half + np.sqrt((0.8 * leaf) ** 2 - height**2 / 4), height / 2],
        },
    }
    result = analysed(data, 25)
    theta = value(result, "joint_rotation", "A")
    place = result.link_position.sel(link="platform").values
    np.testing.assert_allclose(place[:2], 0, rtol=0, atol=1e-12)
    np.testing.assert_allclose(place[2], 2 * leaf * np.sin(theta), rtol=0, atol=1e-12)
    turn = result.link_rotation.sel(link="platform").values
    np.testing.assert_allclose(np.abs(turn.T), [[1, 0, 0, 0]] * 25, rtol=0, atol=1e-12)
    top = result.point_velocity.sel(point="platform.top").values
    np.testing.assert_allclose(top[2], 2 * leaf * np.cos(theta) * SPEED, rtol=0, atol=1e-11)


@pytest.mark.slow
def test_loop_and_links_say_the_same() -> None:
    """The Cardan joint of Pezzuti et al. with friction: everything but what a loop alone has."""
    data = cardan()
    one, two = analysed(data, 24), analysed(unrolled(data), 24)
    for name in ("joint_rotation_velocity", "link_rotation", "reaction_force", "reaction_moment", "drive_effort"):
        assert one[name].sizes == two[name].sizes
        order = {dim: one[dim].values for dim in one[name].dims if dim in one.coords}
        scale = float(np.max(np.abs(one[name].values)))
        np.testing.assert_allclose(
            one[name].values, two[name].sel(order).values, rtol=0, atol=1e-9 * scale, err_msg=name
        )
