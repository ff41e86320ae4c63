"""Mechanisms with tolerances, the same worked out by closed forms of their own, and samples as a study draws them."""

import copy
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechanisms_parts import Data, corner, joined, slide
from trunnion import Mechanism
from trunnion.studies.tolerance.inputs import inputs_of
from trunnion.studies.tolerance.linear import ToleranceStudy, study
from trunnion.studies.tolerance.sampling import Sampler, Sampling

Array = NDArray[np.float64]


# ---- one-way clutch -------------------------------------------------------------------------------------------

CLUTCH = {"a": 27.645e-3, "c": 11.43e-3, "e": 50.8e-3}


def clutch(**options: Any) -> Mechanism:
    """A link of length e − c between the hub and a roller that lies on a guide at height a + c; nothing drives it."""
    return Mechanism(**{
        "dimensions": {"a": "27.645 mm ± 0.0125 mm", "c": "11.43 mm ± 0.01 mm", "e": "50.8 mm ± 0.0125 mm"},
        "links": {
            "frame": {"points": {"O": [0, 0], "G": {"at": [0, "a + c"], "axis": [1, 0]}}},
            "strut": {"points": {"O": [0, 0], "P": [0, "e - c"]}},
            "roller": {"points": {"P": [0, 0], "G": {"at": [0, 0], "axis": [1, 0]}}},
        },
        "joints": joined("frame -O- strut -P- roller, frame =G= roller"),
        "measures": {"wedge": {"angle": "strut"}},
        "assembly": {"P": ["-5 mm", "39 mm"]},
        **options,
    })  # fmt: skip


def clutch_angle(a: Any, c: Any, e: Any) -> Any:
    """The wedge angle, rad."""
    return np.arccos((a + c) / (e - c))


# ---- four-bar -------------------------------------------------------------------------------------------------

FOURBAR = {"l1": 0.1, "l2": 0.03, "l3": 0.09, "l4": 0.07}


def link(points: Data, mass: float = 0.0, centre: Sequence[Any] = (0.0, 0.0), inertia: float = 0.0) -> Data:
    return {"points": points} | ({"mass": mass, "centre": list(centre), "inertia": inertia} if mass else {})


def fourbar(tolerance: str = "±0.05 mm", loaded: bool = False, speed: float = 4.0, **options: Any) -> Mechanism:
    """Ground, crank, coupler and rocker of 100, 30, 90 and 70 mm, open branch; loaded: with masses and a load."""
    weights = [(0.4, 0.012, 2e-4), (0.9, 0.04, 7e-4), (0.7, 0.03, 4e-4)] if loaded else [(0.0, 0.0, 0.0)] * 3
    bodies = [(mass, (centre, 0.004), inertia) for mass, centre, inertia in weights]
    data: Data = {
        "dimensions": {name: f"{1e3 * value:g} mm" for name, value in FOURBAR.items()},
        "links": {
            "ground": {"points": {"A": [0, 0], "D": ["l1", 0]}},
            "crank": link({"A": [0, 0], "B": ["l2", 0]}, *bodies[0]),
            "coupler": link({"B": [0, 0], "C": ["l3", 0]}, *bodies[1]),
            "rocker": link({"D": [0, 0], "C": ["l4", 0]}, *bodies[2]),
        },
        "joints": joined("ground -A- crank -B- coupler -C- rocker, ground -D- rocker"),
        "drivers": {"A": {"speed": speed}},
        "tolerances": dict.fromkeys(FOURBAR, tolerance),
        "measures": {"angle": {"angle": "rocker", "at": "60 deg"}},
        "assembly": {"C": [0.1, 0.07]},
    }
    if loaded:
        data |= {"gravity": [0, -9.81], "loads": {"brake": {"link": "rocker", "moment": "-3 N m"}}}
        data["joint_defaults"] = {"friction": 0.1, "pin": {"radius": "5 mm"}}
    return Mechanism(**{**data, **options})


def fourbar_angle(l1: Any, l2: Any, l3: Any, l4: Any, crank: Any = np.pi / 3) -> Any:
    """Angle of the rocker, rad, by two circles: NaN where they do not meet."""
    return np.angle(corner(l2 * np.exp(1j * np.asarray(crank)), l1, l3, l4, 1) - l1)


# ---- slider-crank ---------------------------------------------------------------------------------------------

SLIDER = {"r": 0.05, "l": 0.2, "e": 0.0}


def slider_crank(offset: float = 0.0, **options: Any) -> Mechanism:
    """Crank of 50 mm, rod of 200 mm, and a guide along x whose height is e."""
    return Mechanism(**{
        "dimensions": {"r": "50 mm", "l": "200 mm", "e": offset},
        "links": {
            "ground": {"points": {"A": [0, 0], "C": {"at": [0, "e"], "axis": [1, 0]}}},
            "crank": {"points": {"A": [0, 0], "B": ["r", 0]}},
            "rod": {"points": {"B": [0, 0], "P": ["l", 0]}},
            "piston": {"points": {"P": [0, 0], "C": slide(0, 0)}},
        },
        "joints": joined("ground -A- crank -B- rod -P- piston, ground =C= piston"),
        "drivers": {"A": {"speed": 5.0}},
        "tolerances": {"r": "±0.02 mm", "l": "±0.05 mm", "e": "±0.1 mm"},
        "measures": {"x": {"point": "piston.P", "axis": "x", "at": "60 deg"}},
        "assembly": {"P": [0.25, 0]},
        **options,
    })  # fmt: skip


def slider_place(r: Any, l: Any, e: Any, crank: float = np.pi / 3) -> Any:  # noqa: E741
    """Place of the piston, m."""
    return r * np.cos(crank) + np.sqrt(l**2 - (r * np.sin(crank) - e) ** 2)


# ---- spatial crank-rocker -------------------------------------------------------------------------------------

RSSR = {"a": 0.03, "b": 0.12, "c": 0.07, "d": 0.1, "alpha": np.pi / 3, "s1": 0.01, "s4": 0.02}


def rssr(pin: Data | None = None, tolerances: Data | None = None, **options: Any) -> Mechanism:
    """Crank ball at height s1, rocker ball at s4 along its axis; ψ from the common normal of both axes."""
    axis = ["0", "-sin(alpha)", "cos(alpha)"]
    widths: Data = dict.fromkeys(RSSR, "±0.02 mm") | {"alpha": "±0.05 deg"}
    data: Data = {
        "space": "spatial",
        "dimensions": {
            "a": "30 mm", "b": "120 mm", "c": "70 mm", "d": "100 mm", "alpha": "60 deg", "s1": "10 mm", "s4": "20 mm",
        },
        "links": {
            "ground": {"points": {
                "A": {"at": [0, 0, 0], "axis": [0, 0, 1], "x": [1, 0, 0]},
                "D": {"at": ["d", 0, 0], "axis": axis, "x": [1, 0, 0]},
            }},
            "crank": {"points": {"A": {"at": [0, 0, 0], "axis": [0, 0, 1], "x": [1, 0, 0]}, "B": ["a", 0, "s1"]}},
            "rod": {"points": {"B": [0, 0, 0], "C": ["b", 0, 0]}},
            "rocker": {"points": {"D": {"at": [0, 0, 0], "axis": [0, 0, 1], "x": [1, 0, 0]}, "C": ["c", 0, "s4"]}},
        },
        "joints": joined("ground -A- crank -B:spherical- rod -C:spherical- rocker, ground -D- rocker",
                         D={"pin": pin} if pin else {}),
        "drivers": {"A": {"speed": 2.0}},
        "tolerances": widths if tolerances is None else tolerances,
        "measures": {"psi": {"rotation": "D", "at": "60 deg"}},
        "assembly": {"D": np.radians(74)},
    }  # fmt: skip
    return Mechanism(**{**data, **options})


def rssr_angle(
    a: Any, b: Any, c: Any, d: Any, alpha: Any, s1: Any, s4: Any, crank: Any = np.pi / 3, side: float = -1.0
) -> Any:
    """ψ: P cos ψ + Q sin ψ = R, from |AB| = b."""
    k = np.array([0.0 * alpha, -np.sin(alpha), np.cos(alpha)])
    x, y = np.array([1.0 + 0 * alpha, 0 * alpha, 0 * alpha]), np.array([0 * alpha, np.cos(alpha), np.sin(alpha)])
    w = np.array([a * np.cos(crank) - d, a * np.sin(crank) + 0 * d, s1 + 0 * d]) - s4 * k
    p, q = np.sum(w * x, axis=0), np.sum(w * y, axis=0)
    return np.arctan2(q, p) + side * np.arccos((np.sum(w * w, axis=0) + c**2 - b**2) / (2 * c * np.hypot(p, q)))


# ---- derivatives and samples ----------------------------------------------------------------------------------


def slopes(of: Callable[..., Any], at: Mapping[str, float], step: float = 1e-6) -> Array:
    """Central differences of fourth order of a closed form by each of its numbers; the step in parts of the number."""
    found = []
    for name, value in at.items():
        h = step * (abs(value) or 0.1)
        one, two = (of(**{**at, name: value + n * h}) - of(**{**at, name: value - n * h}) for n in (1, 2))
        found.append((8 * one - two) / (12 * h))
    return np.array(found)


def many(mechanism: Mechanism, samples: int = 512, **options: Any) -> tuple[ToleranceStudy, Sampler]:
    """A study and what draws and analyses samples of it; options of `study`."""
    found = study(mechanism, **options)
    return found, sampler(found, samples)


def sampler(found: ToleranceStudy, samples: int = 512, method: Any = "monte-carlo", seed: int = 1) -> Sampler:
    """What draws samples of a study, without the first order that a run of it starts with."""
    job = Sampling(
        found.run.system.mechanism.data(), found.measures, 360, method, samples, seed, "numpy", found.friction, 360
    )
    return job.prepare()


def drawn(mechanism: Mechanism, u: Array) -> dict[str, Array]:
    """The toleranced numbers of samples, by path: each its value plus its deviation, worked out by its distribution."""
    from trunnion.solve.run import prepare

    inputs = inputs_of(prepare(mechanism))
    deviations = inputs.population.draw(u[: len(inputs.tolerances)])
    return {one.path: one.nominal + row for one, row in zip(inputs.tolerances, deviations, strict=True)}


def numbers(mechanism: Mechanism, values: Mapping[str, float]) -> Mechanism:
    """The mechanism with other numbers, and without tolerances: one that was built."""
    data: Data = copy.deepcopy(mechanism.with_values(values).data())
    for key in ("tolerances", "correlations", "costs"):
        data.pop(key, None)
    return Mechanism(**data)


LEFT = ("measures", "assembly", "errors", "gravity", "tables", "dimensions", "gears")


def varied(data: Data, share: float = 1e-3, most: int = 14, seed: int = 3, **options: Any) -> Mechanism:
    """A mechanism of plain data whose numbers vary by a share of their size: some of all, drawn at random."""
    mechanism = Mechanism(**{"trunnion": 1, **copy.deepcopy(data), **options})
    known = mechanism.parameter_set
    may = [
        path
        for path, value in known.nominal.items()
        if path.partition(".")[0] not in LEFT
        and not known.entries[path].varies
        and not path.startswith("joint_defaults")
        and (not path.startswith("drivers") or (path.endswith(".speed") and len(mechanism.drivers) == 1))
        and not path.endswith((".range.from", ".range.to", ".axis.x", ".axis.y", ".axis.z", ".start", "pair_factor"))
        and ".x." not in path
        and ".inertia" not in path
        and abs(float(value)) > 1e-9
    ]
    chosen = [may[i] for i in sorted(np.random.default_rng(seed).permutation(len(may))[:most])]
    limits = {path: share * abs(float(known.nominal[path])) for path in chosen}
    return Mechanism(**mechanism.data() | {"tolerances": limits})


def alone(mechanism: Mechanism, values: Mapping[str, Any], i: int) -> Mechanism:
    """Sample i of a batch as a mechanism of its own."""
    paths = [one.path for one in mechanism.tolerated()] + [
        one.direction for one in mechanism.tolerated() if one.direction
    ]
    return numbers(mechanism, {path: float(np.ravel(values[path])[i]) for path in paths})


# a mechanism, its closed form and its sizes
CASES = {
    "clutch": (clutch, clutch_angle, CLUTCH),
    "four-bar": (fourbar, fourbar_angle, FOURBAR),
    "slider-crank": (slider_crank, slider_place, SLIDER),
    "RSSR": (rssr, rssr_angle, RSSR),
}
