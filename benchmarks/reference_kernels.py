"""The four-bar of Durango et al. (2010) written by hand, twice, without Trunnion.

- `numba_loop`: the equations of the paper, one configuration after the other, compiled: what a specialist would
  write for this one mechanism, and so the limit for a general tool.
- `stacked_newton_euler`: nine Newton–Euler equations for each configuration, solved as a stack by NumPy: what a
  general tool without modules would do.

Both settle friction by successive approximation to 1e-9 of the reactions and give the same table, one row a
configuration, columns named in `OUTPUTS`. Reactions and friction torques act on the second link of a joint by
the first: A ground→crank, B crank→coupler, C coupler→rocker, D ground→rocker.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import durango as d
from benchmarks.side import MOTION_COLUMNS, OUTPUTS, Job, Side, crank_angles, version

try:
    from numba import njit
except ImportError:  # the loop then runs as slow plain Python; `run.py` leaves it out
    HAS_NUMBA = False

    def njit(**_: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
        """Stand-in for numba.njit that compiles nothing."""
        return lambda function: function

else:
    HAS_NUMBA = True

Array = NDArray[np.floating[Any]]

__all__ = [
    "COLUMN",
    "numba_loop",
    "numba_motion",
    "numba_side",
    "numba_threads_side",
    "stacked_newton_euler",
    "stacked_side",
    "superposed_side",
]

COLUMN = {name: k for k, name in enumerate(OUTPUTS)}
N_OUTPUTS = len(OUTPUTS)
TOLERANCE = 1e-9
MAX_ITERATIONS = 100
# Where the links of a pair stand still against each other (the pins at the extremes of the transmission angle),
# rounding decides the sign of the slip; below this share of the crank's speed it is taken as `zero_slip_sign`.
ZERO_SLIP = 1e-12

# As much of `fastmath` as leaves NaN and infinity what they are.
FAST = {"contract", "reassoc", "arcp", "nsz", "afn"}
# The compiled functions below are cached on disk and take the numbers of `durango` for constants: after a change
# there, remove benchmarks/__pycache__.


@njit(cache=True, nogil=True, fastmath=FAST)
def _sign(slip: float, threshold: float, at_zero: float) -> float:
    """sgn of a slip speed; `at_zero` within ± threshold."""
    if slip > threshold:
        return 1.0
    if slip < -threshold:
        return -1.0
    return at_zero


@njit(cache=True, nogil=True, fastmath=FAST)
def _length(x: float, y: float) -> float:
    """Length of a vector; a third of the whole loop faster than math.hypot, which guards against overflow."""
    return math.sqrt(x * x + y * y)


@njit(cache=True, nogil=True, fastmath=FAST)
def _motion(theta: float, omega: float, branch: float) -> tuple[float, ...]:
    """Directions, speeds and accelerations of the links for a crank angle; omega is constant.

    C is the intersection of the circles about B and D, branch +1 to the left of B→D.  [D fig. 5]
    Returns (c1, s1, c2, s2, c3, s3, ω2, ω3, ε2, ε3), c and s the cosine and sine of a link's angle.
    """
    c1, s1 = math.cos(theta), math.sin(theta)
    x, y = d.AD - d.AB * c1, -d.AB * s1  # B→D
    square = x * x + y * y
    along = 0.5 + (d.BC * d.BC - d.CD * d.CD) / (2.0 * square)
    across = branch * math.sqrt(d.BC * d.BC / square - along * along)
    c2, s2 = (along * x - across * y) / d.BC, (along * y + across * x) / d.BC
    c3, s3 = (d.BC * c2 - x) / d.CD, (d.BC * s2 - y) / d.CD
    # AB e1 + BC e2 = AD + CD e3, differentiated: the speeds by products with e3 and e2
    inverse_sine = 1.0 / (s2 * c3 - c2 * s3)  # of the transmission angle
    w2 = -omega * (d.AB / d.BC) * (s1 * c3 - c1 * s3) * inverse_sine
    w3 = -omega * (d.AB / d.CD) * (s1 * c2 - c1 * s2) * inverse_sine
    # once more; along e3 and e2 only the centripetal terms stay beside the unknown
    n1, n2, n3 = d.AB * omega * omega, d.BC * w2 * w2, d.CD * w3 * w3
    e2 = (n3 - n1 * (c1 * c3 + s1 * s3) - n2 * (c2 * c3 + s2 * s3)) * inverse_sine / d.BC
    e3 = (n3 * (c2 * c3 + s2 * s3) - n1 * (c1 * c2 + s1 * s2) - n2) * inverse_sine / d.CD
    return c1, s1, c2, s2, c3, s3, w2, w3, e2, e3


@njit(cache=True, nogil=True, fastmath=FAST)
def _loads(omega: float, motion: tuple[float, ...]) -> tuple[float, float, float, float, float, float]:
    """Applied and d'Alembert loads of coupler and rocker, moments about C.

    Returns (F2x, F2y, M2C, F3x, F3y, M3C) of [D 2–5], M_C = M + M_F,C.
    """
    c1, s1, c2, s2, c3, s3, w2, w3, e2, e3 = motion
    gx, gy = d.S2_X * c2 - d.S2_Y * s2, d.S2_X * s2 + d.S2_Y * c2  # B→S2
    ax = -d.AB * omega * omega * c1 - w2 * w2 * gx - e2 * gy
    ay = -d.AB * omega * omega * s1 - w2 * w2 * gy + e2 * gx
    ex, ey = d.E_X * c2 - d.E_Y * s2 - d.BC * c2, d.E_X * s2 + d.E_Y * c2 - d.BC * s2  # C→E
    gx, gy = gx - d.BC * c2, gy - d.BC * s2  # C→S2
    f2x, f2y = d.FE_X - d.M2 * ax, d.FE_Y - d.M2 * ay
    m2 = -d.J2 * e2 - d.M2 * (gx * ay - gy * ax) + ex * d.FE_Y - ey * d.FE_X
    ax, ay = d.S3 * (-w3 * w3 * c3 - e3 * s3), d.S3 * (-w3 * w3 * s3 + e3 * c3)
    f3x, f3y = -d.M3 * ax, -d.M3 * ay
    arm = d.S3 - d.CD  # C→S3 along the rocker
    m3 = d.M3_APPLIED - d.J3 * e3 + arm * (c3 * f3y - s3 * f3x)
    return f2x, f2y, m2, f3x, f3y, m3


@njit(cache=True, nogil=True, fastmath=FAST)
def _rrr_reactions(
    c2: float, s2: float, c3: float, s3: float, loads: tuple[float, ...], m2: float, m3: float
) -> tuple[float, float, float, float, float, float]:
    """Reactions of the RRR group: at B on link 2, at C on link 3, at D on link 3.  [D 2–7, 12–13]

    F_D from [D 2–3] put into [D 5, 13] leaves two equations for F_B; m2, m3: the moments about C of the two
    links with friction.
    """
    f2x, f2y, _, f3x, f3y, _ = loads
    bx, by, dx, dy = -d.BC * c2, -d.BC * s2, -d.CD * c3, -d.CD * s3  # C→B, C→D
    p = -m2  # R_BC × F_B
    q = m3 - dx * (f2y + f3y) + dy * (f2x + f3x)  # R_DC × F_B
    inverse = 1.0 / (bx * dy - by * dx)
    fbx, fby = inverse * (p * dx - q * bx), inverse * (p * dy - q * by)
    fcx, fcy = fbx + f2x, fby + f2y  # [D 6–7], on link 3 by link 2
    return fbx, fby, fcx, fcy, -fcx - f3x, -fcy - f3y


@njit(cache=True, nogil=True, fastmath=FAST)
def _fill(theta: Array, omega: float, branch: float, radius: float, at_zero: float, out: Array) -> None:
    """Rows of `out` for the crank angles `theta`; radius = f′ r of every pin."""
    threshold = ZERO_SLIP * abs(omega)
    for k in range(theta.size):
        row = out[k]
        motion = _motion(theta[k], omega, branch)
        c1, s1, c2, s2, c3, s3, w2, w3, e2, e3 = motion
        loads = _loads(omega, motion)
        sa, sb = _sign(omega, threshold, at_zero), _sign(w2 - omega, threshold, at_zero)
        sc, sd = _sign(w3 - w2, threshold, at_zero), _sign(w3, threshold, at_zero)
        # Successive approximation, steps 1–5 of [D]
        ma = mb = mc = md = b = c = dd = 0.0
        iterations = 0
        for _ in range(MAX_ITERATIONS):
            iterations += 1
            fbx, fby, fcx, fcy, fdx, fdy = _rrr_reactions(c2, s2, c3, s3, loads, loads[2] + mb - mc, loads[5] + mc + md)
            last_b, last_c, last_d = b, c, dd
            b, c, dd = _length(fbx, fby), _length(fcx, fcy), _length(fdx, fdy)
            change = max(abs(b - last_b), abs(c - last_c), abs(dd - last_d))
            mb, mc, md = -sb * radius * b, -sc * radius * c, -sd * radius * dd  # [D 9–11]
            if change <= TOLERANCE * max(b, c, dd) or radius == 0.0:
                break
        # Driver, [D 14–16]: F_01 = F_12 + m1 a1, T = M_B − M_A + R_BA × F_12 (constant speed: J1 ε1 = 0)
        fax = fbx - d.M1 * d.S1 * omega * omega * c1
        fay = fby - d.M1 * d.S1 * omega * omega * s1
        ma = -sa * radius * _length(fax, fay)
        torque = d.AB * (c1 * fby - s1 * fbx) + mb - ma
        row[0], row[1], row[2] = theta[k], math.atan2(s2, c2), math.atan2(s3, c3)
        row[3], row[4], row[5] = omega, w2, w3
        row[6], row[7], row[8] = 0.0, e2, e3
        row[9], row[10], row[11], row[12] = fax, fay, fbx, fby
        row[13], row[14], row[15], row[16] = fcx, fcy, fdx, fdy
        row[17], row[18], row[19], row[20] = ma, mb, mc, md
        row[21], row[22] = -ma * omega, -mb * (w2 - omega)
        row[23], row[24] = -mc * (w3 - w2), -md * w3
        row[25], row[26] = torque, iterations


def numba_loop(
    theta: Array,
    *,
    omega: float = d.OMEGA1,
    branch: float = 1.0,
    friction_radius: float = d.FRICTION_RADIUS,
    zero_slip_sign: float = 0.0,
) -> Array:
    """Table (configuration, OUTPUTS) for the crank angles theta (rad), by the compiled loop.

    branch: +1 open, −1 crossed; friction_radius: f′ r, m; zero_slip_sign: sgn(0) at a pin that stands still.
    """
    out = np.empty((theta.size, N_OUTPUTS))
    _fill(theta, omega, branch, friction_radius, zero_slip_sign, out)
    return out


@njit(cache=True, nogil=True, fastmath=FAST)
def _fill_motion(theta: Array, omega: float, branch: float, out: Array) -> None:
    """Angles, speeds and accelerations of the links, and position, velocity, acceleration of B and C."""
    for k in range(theta.size):
        row = out[k]
        c1, s1, c2, s2, c3, s3, w2, w3, e2, e3 = _motion(theta[k], omega, branch)
        row[0], row[1], row[2] = theta[k], math.atan2(s2, c2), math.atan2(s3, c3)
        row[3], row[4], row[5] = omega, w2, w3
        row[6], row[7], row[8] = 0.0, e2, e3
        bx, by, cx, cy = d.AB * c1, d.AB * s1, d.CD * c3, d.CD * s3
        row[9], row[10], row[11], row[12] = bx, by, d.AD + cx, cy
        row[13], row[14], row[15], row[16] = -omega * by, omega * bx, -w3 * cy, w3 * cx
        row[17], row[18] = -omega * omega * bx, -omega * omega * by
        row[19], row[20] = -w3 * w3 * cx - e3 * cy, -w3 * w3 * cy + e3 * cx


def numba_motion(theta: Array, *, omega: float = d.OMEGA1, branch: float = 1.0) -> Array:
    """Table (configuration, MOTION_COLUMNS): motion alone, by the compiled loop."""
    out = np.empty((theta.size, len(MOTION_COLUMNS)))
    _fill_motion(theta, omega, branch, out)
    return out


def stacked_newton_euler(
    theta: Array,
    *,
    omega: float = d.OMEGA1,
    branch: float = 1.0,
    friction_radius: float = d.FRICTION_RADIUS,
    zero_slip_sign: float = 0.0,
    chunk: int = 2048,
    solve_once: bool = False,
) -> Array:
    """Table (configuration, OUTPUTS) by nine stacked Newton–Euler equations and numpy.linalg.solve.

    chunk: configurations a stack. solve_once: False solves the stack anew in every friction iteration, as one
    writes it down; True solves once for five right sides (loads, unit friction torque in each joint) and then
    superposes, the friction torques being the only thing that changes.
    """
    out = np.empty((theta.size, N_OUTPUTS))
    for start in range(0, theta.size, chunk):
        part = slice(start, start + chunk)
        motion = _stacked_motion(theta[part], omega, branch)
        A, b = _stacked_equations(motion, omega)
        settle = _settle_by_superposition if solve_once else _settle_by_solving
        signs = _stacked_signs(motion, omega, zero_slip_sign)
        x, torques, iterations = settle(A, b, friction_radius * signs)
        _store(out[part], motion, omega, x, torques, iterations)
    return out


def _stacked_motion(theta: Array, omega: float, branch: float) -> dict[str, Array]:
    """Angles t, speeds w, accelerations e of the links, of shape (3, N), by the loop equations.

    Angles from the triangle BCD, then J (ω2, ω3) = −(crank's share) and the same J for the accelerations.
    """
    x, y = d.AD - d.AB * np.cos(theta), -d.AB * np.sin(theta)
    distance = np.hypot(x, y)
    at_b = (d.BC**2 + distance**2 - d.CD**2) / (2.0 * d.BC * distance)
    t2 = np.arctan2(y, x) + branch * np.arccos(at_b)
    t3 = np.arctan2(d.BC * np.sin(t2) - y, d.BC * np.cos(t2) - x)
    t = np.stack([theta, t2, t3])
    c, s = np.cos(t), np.sin(t)
    det = d.BC * d.CD * (s[1] * c[2] - c[1] * s[2])

    def solve(right_x: Array, right_y: Array) -> tuple[Array, Array]:
        """−BC s2 u + CD s3 v = right_x, BC c2 u − CD c3 v = right_y."""
        u = (-d.CD * c[2] * right_x - d.CD * s[2] * right_y) / det
        v = (-d.BC * c[1] * right_x - d.BC * s[1] * right_y) / det
        return u, v

    w2, w3 = solve(d.AB * s[0] * omega, -d.AB * c[0] * omega)
    n1, n2, n3 = d.AB * omega**2, d.BC * w2**2, d.CD * w3**2
    e2, e3 = solve(n1 * c[0] + n2 * c[1] - n3 * c[2], n1 * s[0] + n2 * s[1] - n3 * s[2])
    w, e = np.stack([np.full_like(theta, omega), w2, w3]), np.stack([np.zeros_like(theta), e2, e3])
    return {"t": t, "c": c, "s": s, "w": w, "e": e}


def _stacked_equations(motion: dict[str, Array], omega: float) -> tuple[Array, Array]:
    """Newton–Euler equations of the three links about their centres, A (N, 9, 9) x = b (N, 9).

    x = (F_A, F_B, F_C, F_D, T), each reaction on the second link of its joint.
    """
    (c1, c2, c3), (s1, s2, s3), w, e = motion["c"], motion["s"], motion["w"], motion["e"]
    centre = np.array(  # of the three links, from A: (3, 2, N)
        [
            [d.S1 * c1, d.S1 * s1],
            [d.AB * c1 + d.S2_X * c2 - d.S2_Y * s2, d.AB * s1 + d.S2_X * s2 + d.S2_Y * c2],
            [d.AD + d.S3 * c3, d.S3 * s3],
        ]
    )
    zero = np.zeros_like(c1)
    pin = np.array([[zero, zero], [d.AB * c1, d.AB * s1], [d.AD + d.CD * c3, d.CD * s3], [zero + d.AD, zero]])
    A = np.zeros((c1.size, 9, 9))
    for joint, link, sign in ((0, 0, 1), (1, 1, 1), (1, 0, -1), (2, 2, 1), (2, 1, -1), (3, 2, 1)):
        rx, ry = pin[joint] - centre[link]
        A[:, 3 * link, 2 * joint] = A[:, 3 * link + 1, 2 * joint + 1] = sign
        A[:, 3 * link + 2, 2 * joint], A[:, 3 * link + 2, 2 * joint + 1] = -sign * ry, sign * rx
    A[:, 2, 8] = 1.0
    origin = np.array([[zero, zero], pin[1], pin[3]])  # a point of each link whose acceleration is known
    base = np.array([[zero, zero], -(omega**2) * pin[1], [zero, zero]])
    r = centre - origin
    turned = np.stack([-r[:, 1], r[:, 0]], axis=1)
    a = base + e[:, None] * turned - (w**2)[:, None] * r
    b = np.empty((c1.size, 9))
    for link, (mass, inertia) in enumerate(((d.M1, d.J1), (d.M2, d.J2), (d.M3, d.J3))):
        b[:, 3 * link], b[:, 3 * link + 1] = mass * a[link]
        b[:, 3 * link + 2] = inertia * e[link]
    ex = d.AB * c1 + d.E_X * c2 - d.E_Y * s2 - centre[1, 0]
    ey = d.AB * s1 + d.E_X * s2 + d.E_Y * c2 - centre[1, 1]
    b[:, 3] -= d.FE_X
    b[:, 4] -= d.FE_Y
    b[:, 5] -= ex * d.FE_Y - ey * d.FE_X
    b[:, 8] -= d.M3_APPLIED
    return A, b


# Friction torque of joint A, B, C, D in the moment equations (rows 2, 5, 8), moved to the right side
FRICTION_COLUMNS = np.zeros((9, 4))
FRICTION_COLUMNS[2, 0], FRICTION_COLUMNS[2, 1] = -1.0, 1.0
FRICTION_COLUMNS[5, 1], FRICTION_COLUMNS[5, 2] = -1.0, 1.0
FRICTION_COLUMNS[8, 2], FRICTION_COLUMNS[8, 3] = -1.0, -1.0


def _slips(w: Array, omega: float) -> Array:
    """Speed of the second link of each joint against the first, (N, 4)."""
    return np.stack([w[0], w[1] - omega, w[2] - w[1], w[2]], axis=1)


def _stacked_signs(motion: dict[str, Array], omega: float, at_zero: float) -> Array:
    """sgn of the slip of each joint, (N, 4); `at_zero` where it is rounding noise."""
    slip = _slips(motion["w"], omega)
    return np.where(np.abs(slip) > ZERO_SLIP * abs(omega), np.sign(slip), at_zero)


def _settle_by_solving(A: Array, b: Array, signed_radius: Array) -> tuple[Array, Array, int]:
    """Successive approximation, a fresh solve of the stack in each step: (x, friction torques, iterations)."""
    torques: Array = np.zeros((len(b), 4))
    last: Array = np.zeros((len(b), 4))
    iterations = 0
    for _ in range(MAX_ITERATIONS):
        iterations += 1
        x = np.linalg.solve(A, (b + torques @ FRICTION_COLUMNS.T)[..., None])[..., 0]
        load = np.hypot(x[:, 0:8:2], x[:, 1:8:2])
        torques = -signed_radius * load
        if np.all(np.abs(load - last).max(axis=1) <= TOLERANCE * load.max(axis=1)):
            break
        last = load
    return x, torques, iterations


def _settle_by_superposition(A: Array, b: Array, signed_radius: Array) -> tuple[Array, Array, int]:
    """The same from one solve: x = x_loads + Σ_j torque_j x_j."""
    right = np.empty((len(b), 9, 5))
    right[..., 0] = b
    right[..., 1:] = FRICTION_COLUMNS
    solution = np.linalg.solve(A, right)
    ideal, response = solution[..., 0], solution[..., 1:]
    torques: Array = np.zeros((len(b), 4))
    last: Array = np.zeros((len(b), 4))
    iterations = 0
    for _ in range(MAX_ITERATIONS):
        iterations += 1
        x = ideal + (response @ torques[..., None])[..., 0]
        load = np.hypot(x[:, 0:8:2], x[:, 1:8:2])
        torques = -signed_radius * load
        if np.all(np.abs(load - last).max(axis=1) <= TOLERANCE * load.max(axis=1)):
            break
        last = load
    return x, torques, iterations


def _store(out: Array, motion: dict[str, Array], omega: float, x: Array, torques: Array, iterations: int) -> None:
    """One chunk into the table."""
    out[:, 0:3], out[:, 3:6], out[:, 6:9] = motion["t"].T, motion["w"].T, motion["e"].T
    out[:, 9:17], out[:, 17:21] = x[:, :8], torques
    out[:, 21:25] = -torques * _slips(motion["w"], omega)
    out[:, 25], out[:, 26] = x[:, 8], iterations


def numba_side(job: Job) -> Side | None:
    """The compiled loop, for any of the three jobs; None if Numba is not installed."""
    if not HAS_NUMBA:
        return None
    name, note = "Numba loop", f"by hand, numba {version('numba')}"
    if job == "motion":
        return Side(name, job, lambda n: numba_motion(crank_angles(n)), np.asarray, MOTION_COLUMNS, note=note)
    radius = d.FRICTION_RADIUS if job == "friction" else 0.0
    return Side(
        name, job, lambda n: numba_loop(crank_angles(n), friction_radius=radius), np.asarray, OUTPUTS, note=note
    )


def numba_threads_side(job: Job) -> Side | None:
    """The same with half the positions on each of two threads."""
    one = numba_side(job)
    if one is None:
        return None
    pool, radius = ThreadPoolExecutor(2), d.FRICTION_RADIUS if job == "friction" else 0.0

    def run(n: int) -> Array:
        theta, out = crank_angles(n), np.empty((n, len(one.columns)))
        parts = [slice(0, n // 2), slice(n // 2, n)]
        if job == "motion":
            done = [pool.submit(_fill_motion, theta[part], d.OMEGA1, 1.0, out[part]) for part in parts]
        else:
            done = [pool.submit(_fill, theta[part], d.OMEGA1, 1.0, radius, 0.0, out[part]) for part in parts]
        for each in done:
            each.result()
        return out

    return replace(one, name="Numba loop, 2 threads", run=run)


def stacked_side(job: Job) -> Side:
    """The stacked equations, solved anew in each friction iteration."""
    note = "solved in each iteration"
    return Side("stacked 9×9", job, lambda n: stacked_newton_euler(crank_angles(n)), np.asarray, OUTPUTS, note=note)


def superposed_side(job: Job) -> Side:
    """The stacked equations, solved once for five right sides."""
    return Side(
        "stacked 9×9, superposed",
        job,
        lambda n: stacked_newton_euler(crank_angles(n), solve_once=True),
        np.asarray,
        OUTPUTS,
        note="one solve, 5 right sides",
    )
