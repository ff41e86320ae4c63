"""Motion in space against closed forms and published numbers, and the chain of three cylindrical joints by itself."""

import numpy as np
import pytest

import trunnion
from brief import brief
from reference.maximal_space import Frame, rotation, unrolled
from spatial_numbers import apart
from toleranced import RSSR, rssr
from trunnion.algebra.dual import functions, parts, primal, spatial
from trunnion.algebra.lines import line, link
from trunnion.algebra.vector import product, transpose
from trunnion.groups import GROUPS, ccc

SPEED = 2.0


def analysed(data, steps):
    return brief(trunnion.Mechanism(trunnion=1, **data), steps)


def loop(kinds, twists, distances=(0.0, 0.0, 0.0, 0.0), slide=0.0, start=0.0, **more):
    """A closed chain of four; twists in degrees."""
    names = {"R": "revolute", "C": "cylindrical"}
    rows = [
        {"joint": joint, "type": names[kind], "link": link, "twist": float(np.radians(twist)), "distance": distance}
        for joint, link, kind, twist, distance in zip(
            "ABCD", ("crank", "coupler", "rocker", "ground"), kinds, twists, distances, strict=True
        )
    ]
    if slide:
        rows[0]["slide"] = slide
    return {"space": "spatial", "loop": rows, "drivers": {"A": {"speed": SPEED, "start": start}}, **more}


def value(result, name, joint):
    return np.asarray(result[name].sel(joint=joint).values, float)


def turned(result, joint):
    """Rotation of a joint on the unit circle."""
    return np.asarray(np.exp(1j * value(result, "joint_rotation", joint)))


def missed(result, rows):
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


@pytest.mark.parametrize("general", [False, True])
def test_rccc(general):
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


def rocker_angle(theta, branch, **other):
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
def test_rssr(branch, degrees):
    """ψ on both branches, at 60° as published for this project and over the whole turn by its quadratic equation."""
    start = rocker_angle(np.array([0.0]), branch)[0][0]
    model = rssr(tolerances={}, measures={}, drivers={"A": {"speed": SPEED}}, assembly={"D": float(start)})
    result = brief(model, 72)
    theta = np.arange(72) * 2 * np.pi / 72
    psi, slope = rocker_angle(theta, branch)
    np.testing.assert_allclose(turned(result, "D"), np.exp(1j * psi), rtol=0, atol=1e-12)
    np.testing.assert_allclose(value(result, "joint_rotation_velocity", "D") / SPEED, slope, rtol=0, atol=1e-12)
    assert np.degrees(value(result, "joint_rotation", "D")[12]) == pytest.approx(degrees, abs=1e-6)
    assert np.max(np.abs(result.closure_residual.values)) < 1e-12


@pytest.mark.parametrize("general", [False, True])
@pytest.mark.parametrize("delta", [15.0, 70.0])
def test_ideal_cardan(delta, general):
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


@pytest.mark.slow
def test_no_bennett():
    """Without sin α : a = sin β : b four pins in space do not move: there is no number, and it is said why."""
    data = loop("RRRR", (40, 100, 40, 100), (0.2, 0.2, 0.2, 0.2), start=0.1, over_constraint="minimum-norm")
    result = trunnion.analyse(trunnion.Mechanism(trunnion=1, **data), 12)
    assert set(result.status.values[1:]) == {int(trunnion.Status.NOT_ASSEMBLED)}
    assert np.isnan(result.joint_rotation.sel(joint="B").values[1:]).all()


COUNT = 4000
TWISTS, DISTANCES = np.radians([25, 70, 55, 60]), [1.0, 3.0, 2.5, 2.8]  # links 12, 23, 34, 41
RCCC = [spatial(alpha, a) for alpha, a in zip(TWISTS, DISTANCES, strict=True)]


def turns(rng, count):
    """Random joint angles θ + ε s."""
    return [spatial(rng.uniform(-np.pi, np.pi, COUNT), rng.uniform(-2, 2, COUNT)) for _ in range(count)]


def links(rng, count):
    """Random twists α + ε a, not near 0 and π."""
    return [spatial(rng.uniform(0.3, np.pi - 0.3, COUNT), rng.uniform(-2, 2, COUNT)) for _ in range(count)]


@pytest.mark.parametrize("branch", ccc.BRANCHES)
def test_the_dual_matrices_of_random_chains_close(branch):
    """∏ Z(θ̂) X(α̂) = I on all random chains that can be assembled, but where the axes are within 1e-3 of a plane."""
    rng = np.random.default_rng(5)
    (first,), twists = turns(rng, 1), links(rng, 4)
    loop = ccc.position(first, twists, branch)
    fine = np.isfinite(primal(loop.angles[3])) & (ccc.condition(loop.axes) < 1e3)
    assert np.sum(fine) > COUNT / 3
    real, dual = ccc.closure(loop, twists)
    scale = 1 + sum(np.abs(parts(angle)[1]) for angle in loop.angles)
    assert np.max(real[fine]) < 1e-12
    assert np.max((dual / scale)[fine]) < 1e-12


def test_a_chain_is_found_again_on_one_of_the_branches():
    """Angles and slides of chains made to close: Z₁X₁Z₂X₂Z₃X₃ is random, Z₄X₄Z(δ̂) undoes it, δ̂ belongs to θ̂₁."""
    rng = np.random.default_rng(8)
    angles, twists = turns(rng, 3), links(rng, 3)
    back = transpose(product(*(link(angle, twist) for angle, twist in zip(angles, twists, strict=True))))
    x, y, z = back[0][2], back[1][2], back[2][2]
    fourth, rest = functions.arctan2(x, -y), functions.arctan2(back[2][0], back[2][1])
    twists.append(functions.arctan2(functions.sqrt(x * x + y * y), z))
    wanted = [*angles[1:], fourth]
    loops = [ccc.position(angles[0] + rest, twists, branch) for branch in ccc.BRANCHES]
    errors = [sum(angle_missed(a, b) for a, b in zip(loop.angles[1:], wanted, strict=True)) for loop in loops]
    fine = (ccc.condition(loops[0].axes) < 100) & (np.sin(primal(twists[3])) > 0.1)
    assert np.sum(fine) > COUNT / 2
    assert np.max(np.fmin(*errors)[fine]) < 1e-9
    np.testing.assert_array_equal((errors[0] < errors[1])[fine], (np.sin(primal(angles[2])) < 0)[fine])


def angle_missed(found, wanted):
    """Distance of two dual angles, whole turns aside."""
    return np.abs(np.exp(1j * found.real) - np.exp(1j * wanted.real)) + np.abs(found.dual - wanted.dual)


def test_small_angles_keep_their_digits():
    """A spherical triangle of a millionth of a radian is a plane one: sides 3, 4, 5."""
    small = 1e-6
    found = ccc.meet((0.0, 0.0, 1.0), (np.sin(3 * small), 0.0, np.cos(3 * small)), 4 * small, 5 * small, 1)
    assert float(found[0]) == pytest.approx(0.0, abs=1e-10 * small)
    assert float(abs(found[1])) == pytest.approx(4 * small, rel=1e-10)


def test_no_silent_number():
    """Parallel axes, triangles that do not close, dead centres of dual angles, a link without twist."""
    z = line((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    beside = line((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    angle = spatial(0.5, 0.1)
    assert np.isnan(apart(ccc.meet(z, beside, angle, angle, 1))[0]).all()
    x = line((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    assert np.isnan(apart(ccc.meet(z, x, spatial(0.3, 0.0), spatial(0.3, 0.0), 1))[0]).all()
    flat = ccc.meet((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), np.pi / 4, np.pi / 4, 1)
    np.testing.assert_allclose(flat, [np.sqrt(0.5), 0.0, np.sqrt(0.5)], rtol=0, atol=1e-7)
    assert np.isnan(apart(ccc.meet(z, x, spatial(np.pi / 4, 0.0), spatial(np.pi / 4, 0.0), 1))[1]).all()
    loop = ccc.position(angle, [spatial(0.0, 1.0), *RCCC[1:]], 1)
    assert np.isfinite(primal(loop.angles[3])), "joints 1 and 2 may be parallel"
    assert np.isnan(primal(ccc.position(angle, [*RCCC[:2], spatial(0.0, 1.0), RCCC[3]], 1).angles[3]))
    assert "CCC" not in GROUPS, "the table holds planar groups"
