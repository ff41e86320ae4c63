"""Play of joints against the geometry and mechanics it stands for, each written here once more from first principles.

The pin's shift against the screw along the common perpendicular of two lines, 50 digits as the measure of rounding;
seats against an optimiser over the play; friction against the balance of a contact.
"""

import numpy as np
import pytest
from scipy import optimize

from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.joints.clearance import (
    CLEARANCE_MODELS,
    ellipse_error,
    pin_transform,
    pressed,
    turned_by_friction,
    worst_case,
)

mp = pytest.importorskip("mpmath")
mp.mp.dps = 50
CASES = 20_000


def numbers(frame):
    """Rotation (3, 3, …) with the axes as columns, and place (3, …)."""
    axes = [[np.asarray(primal(axis[row])) for axis in frame[:3]] for row in range(3)]
    shape = np.broadcast_shapes(*(np.shape(n) for row in axes for n in row), *(np.shape(n) for n in frame.place))
    rotation_ = np.array([[np.broadcast_to(n, shape) for n in row] for row in axes], float)
    return rotation_, np.array([np.broadcast_to(n, shape) for n in frame.place], float)


def drawn(count=CASES, least=1e-3):
    """ρ and H in m, β away from 0, ξ."""
    rng = np.random.default_rng(5)
    rho, length = 10.0 ** rng.uniform(-6, -2, count), 10.0 ** rng.uniform(-2, 0, count)
    beta = rng.uniform(least, np.pi, count) * rng.choice([-1, 1], count)
    return rho, length, beta, rng.uniform(-np.pi, np.pi, count)


def test_shift_is_the_screw_along_the_common_perpendicular():
    """20 000 pins: hole's axis z, pin's axis through C₁ and C₂ on circles of radius ρ at z = ∓H/2; to 1e-12.

    The middle of the pin is square to both axes from the middle of the hole: the screw leaves that way as it is.
    """
    rho, length, beta, xi = drawn()
    ends = [np.array([rho * np.cos(angle), rho * np.sin(angle), side * length / 2])
            for angle, side in ((xi + beta / 2, -1), (xi - beta / 2, 1))]  # fmt: skip
    middle, pin = (ends[0] + ends[1]) / 2, ends[1] - ends[0]
    assert np.max(np.abs(np.sum(middle * pin, axis=0)) / (rho * length)) < 1e-15
    axes, found = numbers(pin_transform(rho, length, beta, xi))
    # in shares of the clearance: the tilt is small and must not hide behind the ones of the matrix
    np.testing.assert_allclose(found / rho, middle / rho, rtol=0, atol=1e-9)
    tilt, expected = axes[:2, 2] * (length / rho), (pin / np.linalg.norm(pin, axis=0))[:2] * (length / rho)
    np.testing.assert_allclose(tilt, expected, rtol=0, atol=1e-9)
    square = np.array([np.cos(xi), np.sin(xi), 0 * xi])
    np.testing.assert_allclose(np.einsum("ijn,jn->in", axes, square), square, rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.einsum("jin,jkn->nik", axes, axes), np.tile(np.eye(3), (CASES, 1, 1)), atol=1e-12)


def precise(rho, length, beta, xi):
    """The same matrix in 50 digits: I + sin α [e]× + (1 − cos α) [e]×², and its place."""
    rho, length, beta, xi = (mp.mpf(n) for n in (rho, length, beta, xi))
    alpha, d = mp.atan(2 * rho / length * mp.sin(beta / 2)), rho * mp.cos(beta / 2)
    c, s = mp.cos(xi), mp.sin(xi)
    skew = mp.matrix([[0, 0, s], [0, 0, -c], [-s, c, 0]])
    turn = mp.eye(3) + mp.sin(alpha) * skew + 2 * mp.sin(alpha / 2) ** 2 * skew * skew
    return [[turn[i, k] for k in range(3)] for i in range(3)], [d * c, d * s, mp.mpf(0)]


@pytest.mark.spread(2)
@pytest.mark.parametrize("exponent", [0, -1, -3, -6, -9, -12, -15, -100])
def test_no_digit_is_lost_at_small_beta(exponent):
    """Tilt and displacement hold 15 digits of their own however small β is; so do those near β = π."""
    rng = np.random.default_rng(-exponent)
    for _ in range(100):
        rho, length, xi = 10 ** rng.uniform(-6, -3), rng.uniform(0.005, 0.1), rng.uniform(-3, 3)
        for beta in (10.0**exponent, -(10.0**exponent), np.pi - 10.0**exponent):
            (turn, place), found = precise(rho, length, beta, xi), pin_transform(rho, length, beta, xi)
            tilt = mp.hypot(turn[0][2], turn[1][2])
            assert mp.hypot(found.z[0] - turn[0][2], found.z[1] - turn[1][2]) <= 1e-15 * tilt
            d = mp.hypot(place[0], place[1])
            assert mp.hypot(found.place[0] - place[0], found.place[1] - place[1]) <= 1e-15 * d
            for axis, k in ((found.x, 0), (found.y, 1), (found.z, 2)):
                assert all(abs(axis[i] - turn[i][k]) <= 3e-16 for i in range(3))


def test_derivatives_of_the_shift():
    """∂Â/∂(ρ, H, β, ξ) and by every end offset: dual parts against 50 digits, at β = 0 and π too."""
    rng = np.random.default_rng(11)
    for beta in (0.0, 1e-15, 1e-8, 0.3, -2.0, 3.0, float(np.pi)):
        given = [2e-4, 0.02, beta, float(rng.uniform(-3, 3))]
        for n in range(4):
            found = pin_transform(*(Dual(g, 1.0) if i == n else g for i, g in enumerate(given)))

            def entry(number, row, column, n=n, given=given):
                turn, place = precise(*(number if i == n else g for i, g in enumerate(given)))
                return turn[row][column] if column < 3 else place[row]

            columns = (found.x, found.y, found.z, found.place)
            expected = [[float(mp.diff(lambda q, i=i, k=k: entry(q, i, k), given[n])) for i in range(3)]
                        for k in range(4)]  # fmt: skip
            scale = np.max(np.abs(expected))
            for k in range(4):
                slopes = [float(np.ravel(derivative(columns[k][i] + 0.0 * Dual(0.0, 1.0)))[0]) for i in range(3)]
                np.testing.assert_allclose(slopes, expected[k], rtol=1e-13, atol=1e-15 * scale)


# what the play of a pair lets its pin do, from the picture: places of the ends along the axis in H (z; of a planar
# guide x), what of the small motion t + φ × r there is held, and which parts of force and moment it carries
PICTURE = {
    ("planar", "revolute"): ([(0.0, "xy")], "xy"),
    ("planar", "prismatic"): ([(-0.5, "y"), (0.5, "y")], "yc"),
    ("spatial", "revolute"): ([(-0.5, "xy"), (0.5, "xy"), (0.0, "z")], "xyzab"),
    ("spatial", "cylindrical"): ([(-0.5, "xy"), (0.5, "xy")], "xyab"),
    ("spatial", "prismatic"): ([(-0.5, "x"), (-0.5, "y"), (0.5, "x"), (0.5, "y")], "xyab"),
    ("spatial", "spherical"): ([(0.0, "xyz")], "xyz"),
}
MODELS = [(space, kind) for space, models in CLEARANCE_MODELS.items() for kind in models]


def held(space, kind, length):
    """For each end the matrix that takes the small motion (t, φ), in the parts that count, to the end's offset."""
    ends, parts = PICTURE[space, kind]
    columns = ["xyzabc".index(part) for part in parts]
    found = []
    for at, letters in ends:
        r = np.array([at * length, 0, 0]) if space == "planar" else np.array([0, 0, at * length])
        motion = np.hstack([np.eye(3), [[0, r[2], -r[1]], [-r[2], 0, r[0]], [r[1], -r[0], 0]]])  # t + φ × r
        found.append(motion[["xyz".index(letter) for letter in letters]][:, columns])
    return found


def best_motion(matrices, radii, load):
    """Small motion of most work, load · motion, with every end within its radius: by SLSQP from the middle."""
    scale = np.array([1.0 / max(np.max(np.abs(np.vstack(matrices)[:, k])), 1e-9) for k in range(len(load))])
    work = load * scale / np.linalg.norm(load * scale)

    def room(motion):
        return np.array([r * r - np.sum((m @ (scale * motion)) ** 2) for m, r in zip(matrices, radii, strict=True)])

    def slope(motion):
        return np.array([-2 * (m @ (scale * motion)) @ m * scale for m in matrices])

    result = optimize.minimize(
        lambda q: -work @ q, 0.1 * work, jac=lambda q: -work, method="SLSQP",
        constraints={"type": "ineq", "fun": room, "jac": slope}, options={"ftol": 1e-16, "maxiter": 500},
    )  # fmt: skip
    return scale * result.x, float(load @ (scale * result.x))


@pytest.mark.spread(2)
@pytest.mark.parametrize(("space", "kind"), MODELS)
def test_loaded_seat_does_most_work(space, kind):
    """F · t + M · φ over the play, against an optimiser: offsets to 1e-6 of the clearance."""
    play, rng = CLEARANCE_MODELS[space][kind], np.random.default_rng(17)
    parts = PICTURE[space, kind][1]
    for _ in range(60):
        length = float(rng.uniform(0.5, 3.0))
        radii = rng.uniform(0.5, 1.5, len(play.ends))
        wrench = np.zeros(6)
        wrench[["xyzabc".index(part) for part in parts]] = rng.normal(size=len(parts)) * rng.choice([1.0, 30.0])
        matrices = held(space, kind, length)
        motion, work = best_motion(matrices, radii, wrench[["xyzabc".index(part) for part in parts]])
        loads = play.loads(tuple(wrench[:3]), tuple(wrench[3:]), length)
        seat = [np.array(pressed(q, r), float) for q, r in zip(loads, radii, strict=True)]
        for matrix, vector, radius in zip(matrices, seat, radii, strict=True):
            np.testing.assert_allclose(vector, matrix @ motion, rtol=0, atol=1e-6 * radius)
            assert np.linalg.norm(vector) == pytest.approx(radius, rel=1e-15)
        assert float(worst_case(loads, radii)) == pytest.approx(work, rel=1e-7)
        assert sum(float(np.dot(q, c)) for q, c in zip(loads, seat, strict=True)) == pytest.approx(work, rel=1e-7)


@pytest.mark.parametrize(("space", "kind"), MODELS)
def test_offsets_are_what_the_shift_does_to_the_ends(space, kind):
    """The pin's frame of small offsets moves its ends by them: the linear part of the shift is the picture's."""
    play, rng, length, h = CLEARANCE_MODELS[space][kind], np.random.default_rng(2), 0.07, 1e-6
    matrices = np.vstack(held(space, kind, length))
    columns = ["xyzabc".index(part) for part in PICTURE[space, kind][1]]
    for _ in range(20):
        offsets = [tuple(h * rng.normal(size=len(end))) for end in play.ends]
        shift = play.shift(offsets, length)
        motion = np.zeros(6)
        if space == "planar":
            motion[:2], motion[5] = shift[:2], np.arctan2(shift[3], shift[2])
        else:
            axes, place = numbers(shift)
            motion[:3] = place
            motion[3:] = [axes[2, 1], axes[0, 2], axes[1, 0]]
        flat = np.concatenate([np.array(end) for end in offsets])
        np.testing.assert_allclose(matrices @ motion[columns], flat, rtol=0, atol=1e-8 * h)  # next is (c/H)²


def test_ends_carry_the_force_and_the_moment():
    """Σ Qᵢ = F and Σ rᵢ × Qᵢ = M in the parts that the play holds."""
    rng = np.random.default_rng(6)
    for space, kind in MODELS:
        play, parts = CLEARANCE_MODELS[space][kind], PICTURE[space, kind][1]
        columns = ["xyzabc".index(part) for part in parts]
        wrench, length = rng.normal(size=6), 0.3
        loads = play.loads(tuple(wrench[:3]), tuple(wrench[3:]), length)
        carried = sum(m.T @ np.array(q, float) for m, q in zip(held(space, kind, length), loads, strict=True))
        np.testing.assert_allclose(carried, wrench[columns], rtol=1e-13)


def test_friction_turns_a_pin_against_the_slip():
    """Q = N (n − μ t): t the way the hole's wall slips past the pin at the contact n, ω z × n; each end by itself."""
    rng = np.random.default_rng(21)
    for _ in range(300):
        load, mu, rate = rng.normal(size=2) * 10 ** rng.uniform(-3, 4), rng.uniform(0, 1.2), rng.normal()
        n = np.array(turned_by_friction((*load,), mu, (rate,)))
        assert np.hypot(*n) == pytest.approx(np.hypot(*load), rel=1e-15)
        n = n / np.hypot(*n)
        t = np.sign(rate) * np.array([-n[1], n[0]])
        size = load @ n
        assert size > 0, "the wall presses"
        np.testing.assert_allclose(size * (n - mu * t), load, rtol=0, atol=1e-13 * np.hypot(*load))
        turned = np.angle((n[0] + 1j * n[1]) / (load[0] + 1j * load[1]))
        assert turned == pytest.approx(np.sign(rate) * np.arctan(mu), abs=1e-14)
        c = np.array(pressed((*n,), 1.0))
        np.testing.assert_allclose(c, n, rtol=0, atol=1e-15)  # the pin touches the hole where it lies
    assert turned_by_friction((3.0, 4.0), 0.3, (0.0,)) == (3.0, 4.0)
    assert turned_by_friction((3.0,), 0.3, (1.0,)) == (3.0,)


def test_friction_turns_a_ball_about_its_spin():
    """Q = N (n − μ t), t ∥ ω × n, for any load and spin; on the pole, within atan μ, it need not slip."""
    rng, poles = np.random.default_rng(23), 0
    for _ in range(500):
        load, mu, spin = rng.normal(size=3) * 10 ** rng.uniform(-3, 3), rng.uniform(0.01, 1.2), rng.normal(size=3)
        found = np.array(turned_by_friction((*load,), mu, (*spin,)), float)
        size, axis = np.linalg.norm(load), spin / np.linalg.norm(spin)
        assert np.linalg.norm(found) == pytest.approx(size, rel=1e-14)
        n = found / np.linalg.norm(found)
        off_axis = np.arctan2(np.linalg.norm(np.cross(axis, load)), abs(axis @ load))
        if off_axis < np.arctan(mu):
            poles += 1
            np.testing.assert_allclose(n, np.sign(axis @ load) * axis, rtol=0, atol=1e-14)
            side = load - (load @ n) * n
            assert load @ n > 0
            assert np.linalg.norm(side) <= mu * (load @ n), "friction at rest holds it"
            continue
        t = np.cross(axis, n)
        t = t / np.linalg.norm(t)
        normal = load @ n
        assert normal == pytest.approx(size / np.hypot(1, mu), rel=1e-12)
        # the root next to the pole costs digits there
        limit = 1e-13 + 1e-15 / max(off_axis - np.arctan(mu), 1e-16)
        np.testing.assert_allclose(normal * (n - mu * t), load, rtol=0, atol=min(limit, 1e-7) * size)
    assert 25 < poles < 400
    assert turned_by_friction((1.0, 2.0, 3.0), 0.3, (0.0, 0.0, 0.0)) == (1.0, 2.0, 3.0)


def room_of_an_ellipse(radius, hole, half, angle):
    """How far an ellipse (half its long axis along x) can shift from the middle of a circle along a direction.

    The largest c with |c n + e(τ)| ≤ R for all τ: for each point of the ellipse a quadratic in c, the least of them.
    """
    n = (mp.cos(angle), mp.sin(angle))

    def reach(tau):
        x, y = half * mp.cos(tau), radius * mp.sin(tau)
        along, across = x * n[0] + y * n[1], x * n[1] - y * n[0]
        return -along + mp.sqrt(hole**2 - across**2)

    tau = mp.findroot(lambda q: mp.diff(reach, q), angle)
    return reach(tau)


@pytest.mark.parametrize("beta", [0.5, 1.5, 2.5, float(np.pi)])
def test_circles_for_ellipses(beta):
    """A leaning pin's section is an ellipse r by r/cos α; where the seat lies it has less room than ρ.

    (2rρ/H²) sin⁴(β/2) is the share of the clearance that is missing, to first order in that share and in (ρ/H)²: the
    half axis is longer by r α²/2, α = (2ρ/H) sin(β/2), and meets the wall at the angle π/2 ± β/2 to it.
    """
    for r, rho, length in ((0.01, 1e-5, 0.02), (0.01, 2e-5, 0.01), (0.05, 1e-4, 0.02), (0.02, 1e-6, 0.05)):
        r_, rho_, b = mp.mpf(r), mp.mpf(rho), mp.mpf(beta)
        alpha = mp.atan(2 * rho_ / length * mp.sin(b / 2))
        # c₁ stands at ξ + β/2, the pin leans towards ξ − π/2
        room = room_of_an_ellipse(r_, r_ + rho_, r_ / mp.cos(alpha), b / 2 + mp.pi / 2)
        missing, formula = float((rho_ - room) / rho_), float(ellipse_error(rho, r, length, beta))
        assert missing > 0
        worst = float(ellipse_error(rho, r, length))
        assert missing == pytest.approx(formula, rel=3 * worst + 3 * (rho / length) ** 2 + 3 * rho / r)
