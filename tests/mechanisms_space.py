"""Spatial mechanisms that tests share, as plain data in SI numbers, each with a pose in which it is assembled.

A random one is drawn assembled: links and joints lie anywhere, and each joint's second element is where a random motion
of its pair takes it. So every kind of pair can stand anywhere in a chain.
"""

import copy
import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy import optimize

from mechanisms_parts import joined
from reference.maximal_space import Array, Data, Drive, Frame, Linkage, element, point, rotation, unrolled

REACH = 0.15  # of the drawn drivers on both sides of the drawn pose, rad or m/10
SPEED = 3.0


class Drawn(NamedTuple):
    """A model, and frames of its moving links near which it is assembled at the start of the cycle."""

    data: Data
    home: dict[str, Frame]


def random_rotation(rng: np.random.Generator) -> Array:
    axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return axes * np.sign(np.linalg.det(axes))


def frame_of(place: Any, axes: Any = None) -> Frame:
    return Frame(np.asarray(place, float), np.eye(3) if axes is None else np.asarray(axes, float))


def pair_motion(kind: str, rng: np.random.Generator, pitch: float) -> tuple[Frame, float]:
    """A random relative motion of a pair, and its coordinate."""
    turn, slide = rng.uniform(-2.5, 2.5), rng.uniform(0.1, 0.4)
    about, tilt = rotation([0, 0, 1], turn), rotation([1, 0, 0], np.pi / 2)
    place, axes, coordinate = {
        "revolute": lambda: ([0, 0, 0], about, turn),
        "prismatic": lambda: ([0, 0, slide], None, slide),
        "cylindrical": lambda: ([0, 0, slide], about, turn),
        "helical": lambda: ([0, 0, pitch * turn / (2 * np.pi)], about, turn),
        "universal": lambda: ([0, 0, 0], about @ tilt @ rotation([0, 0, 1], rng.uniform(-2.5, 2.5)), 0.0),
        "planar": lambda: ([*rng.uniform(-0.2, 0.2, 2), 0], about, 0.0),
        "fixed": lambda: ([0, 0, 0], None, 0.0),
        "spherical": lambda: ([0, 0, 0], random_rotation(rng), 0.0),
    }[kind]()
    return frame_of(place, axes), coordinate


def body(rng: np.random.Generator, size: float = 0.4) -> Data:
    """Mass, centre and a physically possible inertia in no particular axes, of the lighter ones about the origin."""
    mass = rng.uniform(1, 3)
    axes, second = random_rotation(rng), mass * (size * rng.uniform(0.2, 0.6, 3)) ** 2  # ∫ x² dm of the three axes
    inertia = axes @ np.diag(np.sum(second) - second) @ axes.T
    centre = rng.uniform(-0.3, 0.3, 3) * size
    about = "origin" if mass < 2 else "centre"
    if about == "origin":
        inertia = inertia + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    named = {key: inertia[i, j] for key, (i, j) in TENSOR.items()}
    return {"mass": mass, "centre": list(centre), "inertia": named, "inertia_about": about}


TENSOR = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}


def draw(seed: int, chains: str, drivers: tuple[str, ...] = ("A",)) -> Drawn:
    """A random mechanism of joints along chains of links, with masses and loads on all links.

    A link with two ball joints and no other is a slender rod: its mass is spread evenly along their line. Each is drawn
    once in a run of the tests; everyone gets a copy of its own.
    """
    return copy.deepcopy(_drawn(seed, chains, drivers))


@functools.cache
def _drawn(seed: int, chains: str, drivers: tuple[str, ...]) -> Drawn:
    joints = {name: (joint["type"], *joint["links"]) for name, joint in joined(chains).items()}
    rng = np.random.default_rng(seed)
    names = list(dict.fromkeys(link for _, *ends in joints.values() for link in ends if link != "ground"))
    home = {link: frame_of(rng.uniform(-1, 1, 3), random_rotation(rng)) for link in names}
    links: Data = {"ground": {"points": {}}} | {link: {"points": {}, **body(rng)} for link in names}
    stated: Data = {}
    driven: Data = {}
    for name, (kind, first, second) in joints.items():
        pitch = rng.uniform(0.1, 0.3)
        one = frame_of(rng.uniform(-1, 1, 3), random_rotation(rng))
        motion, coordinate = pair_motion(kind, rng, pitch)
        for link, place in ((first, one), (second, one @ motion)):
            links[link]["points"][name] = point(home.get(link, frame_of(np.zeros(3))).inverse() @ place)
        stated[name] = {"type": kind, "links": [first, second], **pair_data(kind, rng, pitch)}
        if name in drivers:
            reach = REACH * (0.3 if kind == "prismatic" else 1)
            driven[name] = {"speed": SPEED * reach / REACH, "range": [coordinate - reach, coordinate + reach]}
    rods = []
    for link in names:
        links[link]["points"]["grip"] = list(rng.uniform(-0.3, 0.3, 3))
        balls = [name for name, (kind, *ends) in joints.items() if link in ends and kind == "spherical"]
        if len(balls) == 2 == sum(link in ends for _, *ends in joints.values()):
            one, two = (np.array(links[link]["points"][ball]["at"]) for ball in balls)
            links[link] |= rod(one, two)
            links[link]["points"]["grip"] = list(one + 0.3 * (two - one))
            rods.append(link)
    loads: Data = {
        f"push-{link}": {"link": link, "at": "grip", "force": list(rng.uniform(-20, 20, 3))} for link in names
    }
    loads["twist"] = {
        "link": [link for link in names if link not in rods][-1],
        "moment": list(rng.uniform(-5, 5, 3)),
        "frame": "link",
    }
    data: Data = {
        "space": "spatial", "gravity": [1.0, -2.0, -9.0], "links": links, "joints": stated, "drivers": driven,
        "loads": loads,
    }  # fmt: skip
    return started(data, home)


def pair_data(kind: str, rng: np.random.Generator, pitch: float) -> Data:
    """Dimensions of a pair's contact."""
    if kind == "prismatic":
        return {"guide": {"length": rng.uniform(0.2, 0.5), "width": rng.uniform(0.1, 0.3)}}
    if kind in ("planar", "fixed"):
        return {}
    pin: Data = {"radius": rng.uniform(0.01, 0.03)}
    if kind != "spherical":
        pin["bearing"] = rng.uniform(0.1, 0.3)
    if kind not in ("spherical", "universal"):
        pin["offset"] = rng.uniform(-0.05, 0.05)
    return {"pin": pin, **({"pitch": pitch} if kind == "helical" else {})}


def rod(one: Array, two: Array) -> Data:
    """A slender rod along a line, with a little inertia about it, centre off the middle: the spin stays neutral."""
    u = (two - one) / np.linalg.norm(two - one)
    inertia = 0.08 * (np.eye(3) - np.outer(u, u)) + 0.01 * np.outer(u, u)
    named = {key: inertia[i, j] for key, (i, j) in TENSOR.items()}
    return {"mass": 1.3, "centre": list(one + 0.4 * (two - one)), "inertia": named, "inertia_about": "centre"}


def started(data: Data, home: dict[str, Frame]) -> Drawn:
    """The drawn model with pose and assembly hints at the start of its range, gone to in small steps."""
    linkage, frames = Linkage(data), home
    ranges = {name: driver["range"] for name, driver in data["drivers"].items()}
    for share in np.linspace(0.5, 0.0, 11):
        drive = {name: Drive(low + share * (high - low)) for name, (low, high) in ranges.items()}
        frames = linkage.placed_by(frames, drive)
    hints: Data = {}
    for link, frame in frames.items():
        for name, at in data["links"][link]["points"].items():
            at = at["at"] if isinstance(at, dict) else at
            hints[f"{link}.{name}"] = [float(n) for n in frame.place + frame.axes @ np.asarray(at)]
    return Drawn({**data, "assembly": hints}, frames)


KINDS = {
    "R": "revolute", "P": "prismatic", "C": "cylindrical", "S": "spherical", "U": "universal", "H": "helical",
    "E": "planar", "F": "fixed",
}  # fmt: skip


def chain(symbols: str, seed: int, drivers: tuple[str, ...] = ("A",)) -> Drawn:
    """A random closed chain: joints A, B, C … of the given symbols, every other one with its links named backwards."""
    links = ["ground", *(f"link-{k}" for k in range(1, len(symbols)))]
    parts = []
    for k, symbol in enumerate(symbols):
        ends = [links[k], links[(k + 1) % len(symbols)]][:: 1 if k % 2 == 0 else -1]
        parts.append(f" -{'ABCDEFG'[k]}:{KINDS[symbol]}- ".join(ends))
    return draw(seed, ", ".join(parts), drivers)


def rssr(start: float = 0.0, friction: float = 0.0) -> Drawn:
    """The RSSR of THEORY section 7 with mass, gravity and a brake; m."""
    a, b, c, d, alpha, s1, s4 = 0.030, 0.120, 0.070, 0.100, np.radians(60), 0.010, 0.020
    k, x = np.array([0, -np.sin(alpha), np.cos(alpha)]), np.array([1.0, 0, 0])
    psi = np.radians(73.843222) if start == 0 else 0.0
    names = ("xx", "yy", "zz")

    def mass(m: float, centre: list[float], inertia: tuple[float, float, float]) -> Data:
        return {"mass": m, "centre": centre, "inertia": dict(zip(names, inertia, strict=True))}

    data: Data = {
        "space": "spatial",
        "gravity": [0.0, -9.81, 0.0],
        "joint_defaults": {"pin": {"radius": 0.005, "bearing": 0.02}, "friction": friction},
        "links": {
            "ground": {"points": {"A": {"at": [0, 0, 0], "axis": [0, 0, 1], "x": [1, 0, 0]},
                                  "D": {"at": [d, 0, 0], "axis": list(k), "x": [1, 0, 0]}}},
            "crank": {"points": {"A": {"at": [0, 0, 0], "axis": [0, 0, 1], "x": [1, 0, 0]}, "B": [a, 0, s1]},
                      **mass(0.2, [0.01, 0.002, 0.004], (2e-5, 3e-5, 4e-5))},
            "rod": {"points": {"B": [0, 0, 0], "C": [b, 0, 0]}, **mass(0.1, [b / 2, 0, 0], (4e-6, 1.2e-4, 1.2e-4))},
            "rocker": {"points": {"D": {"at": [0, 0, 0], "axis": [0, 0, 1], "x": [1, 0, 0]}, "C": [c, 0, s4]},
                       **mass(0.15, [0.03, 0.001, 0.01], (3e-5, 9e-5, 1e-4))},
        },
        "joints": joined("ground -A- crank -B:spherical- rod -C:spherical- rocker, ground -D- rocker",
                         B={"pin": {"radius": 0.006}}, C={"pin": {"radius": 0.007}}),
        "drivers": {"A": {"speed": 30.0, "start": start}},
        "loads": {"brake": {"joint": "D", "resisting_torque": 2.0, "useful": True}},
    }  # fmt: skip
    theta = start if start else np.radians(60)
    ball = np.array([a * np.cos(theta), a * np.sin(theta), s1])
    rocker = np.column_stack([x, np.cross(k, x), k]) @ rotation([0, 0, 1], psi)
    end = np.array([d, 0, 0]) + rocker @ [c, 0, s4]
    u = (end - ball) / np.linalg.norm(end - ball)
    side = np.cross([0, 0, 1], u) / np.linalg.norm(np.cross([0, 0, 1], u))
    home = {
        "crank": frame_of([0, 0, 0], rotation([0, 0, 1], theta)),
        "rod": frame_of(ball, np.column_stack([u, side, np.cross(u, side)])),
        "rocker": frame_of([d, 0, 0], rocker),
    }
    return Drawn({**data, "assembly": {"C": [float(n) for n in end]}}, home)


def cardan(
    bearing: float = 0.06,
    misalignment: float = 15.0,
    error: float = 0.1,
    offset: float = 1.0,
    model: str = "two-contact",
) -> Data:
    """The Cardan joint of Pezzuti et al. as a loop; misalignment and error in degrees, offset times the printed."""
    square = np.radians(90 - error)
    twists = (square, square, square, np.radians(180 - misalignment - error))
    rows: list[Data] = []
    table = zip(
        ("input", "pin-1", "pin-2", "output"), ("input-shaft", "cross", "output-shaft", "ground"), twists,
        (1e-5, 1e-5, 2e-5, 1e-5), (0.01001, 0.01002, 0.01001, 0.01002), strict=True,
    )  # fmt: skip
    for name, link, twist, distance, radius in table:
        kind = "revolute" if name == "input" else "cylindrical"
        row: Data = {"joint": name, "type": kind, "link": link, "twist": twist, "distance": offset * distance}
        rows.append({**row, "pin": {"radius": radius}})
    return {
        "space": "spatial",
        "gravity": [0.0, 0.0, 0.0],
        "loop": rows,
        "joint_defaults": {"pin": {"bearing": bearing}, "friction": {"coefficient": 0.42, "model": model}},
        "links": {
            "input-shaft": {
                "frame": "pin-1", "mass": 0.936, "centre": [0, 0.1277, -0.0086], "inertia_about": "origin",
                "inertia": {"xx": 0.019254, "yy": 0.000252, "zz": 0.019182, "yz": 0.001026},
            },
            "cross": {
                "frame": "pin-2", "mass": 0.045, "centre": [0, 0, -0.0085], "inertia_about": "origin",
                "inertia": {"xx": 6e-6, "yy": 6e-6, "zz": 2e-6},
            },
            "output-shaft": {
                "frame": "output", "mass": 0.936, "centre": [0, 0, -0.093782], "inertia_about": "origin",
                "inertia": {"xx": 0.012147, "yy": 0.012148, "zz": 0.000184},
            },
        },
        "drivers": {"input": {"speed": 100.0}},
        "loads": {"brake": {"joint": "output", "resisting_torque": 10.0, "useful": True}},
    }  # fmt: skip


def closed(data: Data, first: float, seed: int = 0) -> Drawn:
    """A loop of one driven and three cylindrical joints as links and points, assembled at a coordinate of the first."""
    rows, rng = data["loop"], np.random.default_rng(seed)
    shifts = [frame_of([row["distance"], 0, 0], rotation([1, 0, 0], row["twist"])) for row in rows]

    def frames(rest: Array) -> list[Frame]:
        turns, slides = [first, *rest[:3]], [rows[0].get("slide", 0.0), *rest[3:]]
        found = [frame_of(np.zeros(3))]
        for turn, slide, shift in zip(turns, slides, shifts, strict=True):
            found.append(found[-1] @ frame_of([0, 0, slide], rotation([0, 0, 1], turn)) @ shift)
        return found

    def missing(rest: Array) -> Array:
        gap = frames(rest)[-1]
        return np.array([*gap.place, gap.axes[2, 1], gap.axes[0, 2], gap.axes[1, 0]])

    for _ in range(200):
        start = np.concatenate([rng.uniform(-np.pi, np.pi, 3), np.zeros(3)])
        found = optimize.root(missing, start, tol=1e-10)
        chain_frames = frames(found.x)
        if np.max(np.abs(chain_frames[-1].axes - np.eye(3))) < 1e-6:
            break
    else:
        raise AssertionError("not assembled")
    plain = unrolled(data)
    home = {}
    for row, after, shift in zip(rows[:-1], chain_frames[1:], shifts, strict=False):
        own = after @ shift.inverse()  # the element of the row's joint
        home[row["link"]] = own @ element(plain["links"][row["link"]], row["joint"]).inverse()
    return Drawn(plain, home)


TWO_LOOPS = (
    "ground -A- crank -B:spherical- triangle -C:universal- rod, ground -D:cylindrical- rod, "
    "arm -E:spherical- triangle, arm -F:cylindrical- ground"
)
TWO_RSSR = (
    "ground -A- crank -B:spherical- rod -C:spherical- rocker -D- ground, rocker -E:spherical- second-rod, "
    "output -F:spherical- second-rod, ground -G- output"
)
FEET = ", ".join(f"{'crank' if k == 1 else 'ground'} -foot-{k}:spherical- leg-{k}" for k in range(1, 7))
HEADS = ", ".join(f"leg-{k} -head-{k}:spherical- platform" for k in range(1, 7))

# name: a mechanism; seeds at which the whole range is well conditioned
MODELS: dict[str, Callable[[], Drawn]] = {
    "RSSR": lambda: chain("RSSR", 24), "RSSP": lambda: chain("RSSP", 24), "RCCC": lambda: chain("RCCC", 7),
    "RRRSR": lambda: chain("RRRSR", 6), "RSUR": lambda: chain("RSUR", 4), "RSSH": lambda: chain("RSSH", 12),
    "HUSR": lambda: chain("HUSR", 16), "PSUR": lambda: chain("PSUR", 20), "RUSP": lambda: chain("RUSP", 9),
    "CRSR": lambda: chain("CRSR", 8), "RECR": lambda: chain("RECR", 3), "RSFRC": lambda: chain("RSFRC", 14),
    "RCSC, two drivers": lambda: chain("RCSC", 13, ("A", "D")), "RRRRRRR": lambda: chain("RRRRRRR", 23),
    "two loops in one group": lambda: draw(21, TWO_LOOPS), "two RSSR in series": lambda: draw(14, TWO_RSSR),
    "platform on six legs": lambda: draw(3, f"ground -A- crank, {FEET}, {HEADS}"),
}  # fmt: skip


def floating(nut: str) -> tuple[Data, Data]:
    """Links and joints from P of the ground to U of a nut that keep it from turning about z, and from nothing else."""
    x, y, z = ({"at": [0, 0, 0], "axis": list(axis)} for axis in np.eye(3))
    links = {
        "carriage": {"points": {"P": z, "X": x}},
        "plate": {"points": {"X": x, "Y": y}},
        "ring": {"points": {"Y": y, "U": x}},
    }
    return links, joined(f"ground =P= carriage =X= plate =Y= ring -U:universal- {nut}")


CARDANS: dict[str, Data] = {
    "Cardan joint of Pezzuti": cardan(),
    "Cardan joint, their sum": cardan(model="pezzuti"),
    "Cardan joint at 45 degrees under gravity": {**cardan(0.08, 45.0, 0.5, 30.0), "gravity": [3.0, -5.0, 8.0]},
    "Cardan joint with clean angles": cardan(error=0.0, offset=0.0),
}
NAMES = [*MODELS, "RSSR of the theory", *CARDANS]
FRICTION = {"RSSR of the theory": 0.15, **dict.fromkeys(CARDANS, 0.42), "two loops in one group": 0.02}  # others 0.05
FRICTION["Cardan joint at 45 degrees under gravity"] = 0.15


def with_friction(name: str, friction: bool) -> Data:
    """One of all these, with friction or without."""
    if name in CARDANS:
        data = {**CARDANS[name], "drivers": {"input": {"speed": 100.0, "start": 0.07}}}  # at 0 a pin is at rest
    else:
        data = dict(rssr().data if name == "RSSR of the theory" else MODELS[name]().data)
    defaults = dict(data.get("joint_defaults", {}))
    law = defaults.pop("friction", {})
    if friction:
        model = {"model": law["model"]} if isinstance(law, dict) and "model" in law else {}
        defaults["friction"] = {"coefficient": FRICTION.get(name, 0.05), **model}
        for joint in data.get("joints", {}).values():
            if joint["type"] in ("planar", "fixed"):
                joint["friction"] = 0.0
    return {**data, "joint_defaults": defaults}
