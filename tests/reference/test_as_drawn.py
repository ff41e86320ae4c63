"""Links that are written in one frame, closed: they are assembled as drawn; and all that `check` prints is a hint."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from mechanisms import MODELS, build
from trunnion import Mechanism, analyse, check
from trunnion.solve.run import prepare
from trunnion.views.assembly.modes import places

JOINTS = {"S": "spherical", "R": "revolute", "P": "prismatic", "C": "cylindrical", "U": "universal"}


class Drawing:
    """A linkage that grows by groups between random points, all in one frame."""

    def __init__(self, rng: np.random.Generator, spatial: bool) -> None:
        self.rng, self.spatial = rng, spatial
        self.links: dict[str, dict[str, Any]] = {"ground": {}}
        self.joints: dict[str, Any] = {}
        self.add("R", ["ground", "crank"], self.place())
        self.moving = ["crank"]

    def place(self) -> list[float]:
        return [float(n) for n in self.rng.uniform(-1, 1, 3 if self.spatial else 2)]

    def direction(self) -> list[float]:
        return [float(n) for n in self.rng.normal(size=3 if self.spatial else 2)]

    def add(self, kind: str, ends: list[str], place: list[float]) -> str:
        """A joint at a place, on both links alike."""
        name = f"{kind}{len(self.joints)}"
        axes: list[dict[str, Any]] = [{}, {}]
        if (self.spatial and kind != "S") or kind == "P":
            axis = self.direction()
            axes = [{"axis": axis}] * 2
        if kind == "U":
            axes = [{"axis": axis}, {"axis": [float(n) for n in np.cross(axis, self.direction())]}]
        self.joints[name] = {"type": JOINTS[kind], "links": ends}
        for link, more in zip(ends, axes, strict=True):
            self.links.setdefault(link, {})[name] = {"at": place, **more} if more else place
        return name

    def anchor(self) -> str:
        return str(self.rng.choice(list(self.links)))

    def dyad(self, kinds: str) -> None:
        """Two links, one on the last that moves, the other on any."""
        first, second = f"link-{len(self.links)}", f"link-{len(self.links) + 1}"
        ends = [self.moving[-1], first], [first, second], [self.anchor(), second]
        for kind, pair in zip(kinds, ends, strict=True):
            self.add(kind, list(pair), self.place())
        self.moving += [second]

    def triad(self) -> None:
        """A link on three rods."""
        body = f"link-{len(self.links)}"
        for k, anchor in enumerate([self.moving[-1], self.anchor(), "ground"]):
            rod = f"rod-{len(self.links)}-{k}"
            self.add("R", [anchor, rod], self.place())
            self.add("R", [rod, body], self.place())
        self.moving += [body]

    def mechanism(self, start: float) -> Mechanism:
        driver = next(iter(self.joints))
        return Mechanism(
            space="spatial" if self.spatial else "planar",
            links={link: {"points": points} for link, points in self.links.items()},
            joints=self.joints,
            drivers={driver: {"speed": 1.0, "range": [start, start + 0.3]}},
        )


def drawn(seed: int) -> Mechanism:
    """Every third in space; some begin before or after where they are drawn."""
    rng = np.random.default_rng(seed)
    drawing = Drawing(rng, seed % 3 == 2)
    if drawing.spatial:
        drawing.dyad(str(rng.choice(["SSR", "USR", "SCR", "CCC", "RSC"])))
    else:
        for _ in range(int(rng.integers(1, 4))):
            if rng.random() < 0.3:
                drawing.triad()
            else:
                drawing.dyad(str(rng.choice(["RRR", "RRP", "PRR", "RPR"])))
    return drawing.mechanism(float(rng.choice([0.0, 0.0, -0.02, 0.02])))


@pytest.mark.parametrize(("first", "count"), [(0, 12), pytest.param(12, 88, marks=pytest.mark.slow)])
def test_random_linkages_are_assembled_as_drawn(first: int, count: int) -> None:
    """Where the driver is as drawn, the frames of all links coincide; without a warning that one had to choose."""
    looked = 0
    for seed in range(first, first + count):
        mechanism = drawn(seed)
        run = prepare(mechanism)
        start = float(run.values[next(path for path in run.values if path.endswith("range.from"))])
        if start > 0.0:
            continue
        assert not any(one.code == "assembly.choice" for one in run.chosen.findings), seed
        walk = run.walk(np.array([-start]))
        for link, motion in walk.motions.items():
            frame = motion.frame
            spatial = walk.system.spatial
            numbers = [n for vector in frame for n in vector] if spatial else list(frame)
            same = [*np.eye(3).ravel(), 0.0, 0.0, 0.0] if spatial else [0.0, 0.0, 1.0, 0.0]
            if not any(link in spin for module in run.system.plan.modules for spin in module.spinning):
                values = [float(np.ravel(n)[0]) for n in numbers]
                np.testing.assert_allclose(values, same, atol=1e-7, err_msg=f"{seed} {link}")
        looked += 1
    assert looked > 0.6 * count


# ---- what check prints ---------------------------------------------------------------------------------------------

PRINTED = re.compile(r"(\S+) (?:\(([^)]*)\)|at (-?[\d.e-]+)|(-?[\d.e+-]+)°)")


def hints_of(text: str) -> dict[str, Any]:
    """What a line of `check` says of a mode, as a hint: 'C (70, 130), P at 12 mm; D 35°'."""
    if text == "at the origin":
        return {}
    unit = next((part.split()[-1] for part in text.split("; ") if not part.endswith("°")), "m")
    hints: dict[str, Any] = {}
    for name, place, slide, angle in PRINTED.findall(text):
        if place:
            hints[name] = [f"{number.strip()} {unit}" for number in place.split(",")]
        else:
            hints[name] = f"{slide} {unit}" if slide else f"{angle} deg"
    return hints


def hinted_modes(mechanism: Mechanism) -> int:
    """Each mode of each group, chosen by what `check` prints of it, is the one that is used; how many there are."""
    looked = 0
    bare = Mechanism(**{**mechanism.data(), "assembly": {}})
    for choice in check(bare, 12).choices:
        for way in choice.ways[:6]:
            hints = hints_of(places(choice, way))
            if not hints:
                continue
            used = next(one for one in check(Mechanism(**{**bare.data(), "assembly": hints}), 12).choices
                        if one.module == choice.module)  # fmt: skip
            assert next(one.name for one in used.ways if one.taken) == way.name, (choice.links, hints)
            looked += 1
    return looked


@pytest.mark.spread(5)
@pytest.mark.parametrize("name", MODELS)
def test_what_check_prints_of_a_mode_is_a_hint(name: str) -> None:
    hinted_modes(build(MODELS[name]()))


@pytest.mark.parametrize("kind", ["R", "U", "C", "S"])
def test_hints_of_every_kind_of_joint_in_space(kind: str) -> None:
    """A crank and a rocker with a coupler: balls, universal joints, sleeves between them."""
    drawing = Drawing(np.random.default_rng(7), True)
    drawing.dyad({"R": "RSC", "U": "USR", "C": "SCR", "S": "SSR"}[kind])
    assert hinted_modes(drawing.mechanism(0.0)) > 0


SCISSORS: dict[str, Any] = {
    "links": {
        "ground": {"points": {"A": [0, 0], "S": {"at": [0.4, 0], "axis": [1, 0]}}},
        "left": {"points": {"A": [0, 0], "M": [0.2, 0.15], "D": [0.4, 0.3]}},
        "right": {"points": {"B": [0.4, 0], "M": [0.2, 0.15], "C": [0, 0.3]}},
        "foot": {"points": {"B": [0.4, 0], "S": {"at": [0.4, 0], "axis": [1, 0]}}},
        "top": {"points": {"C": [0, 0.3], "T": {"at": [0.4, 0.3], "axis": [1, 0]}}},
        "block": {"points": {"D": [0.4, 0.3], "T": {"at": [0.4, 0.3], "axis": [1, 0]}}},
    },
    "joints": {
        "A": {"type": "revolute", "links": ["ground", "left"]},
        "S": {"type": "prismatic", "links": ["ground", "foot"]},
        "B": {"type": "revolute", "links": ["foot", "right"]},
        "M": {"type": "revolute", "links": ["left", "right"]},
        "C": {"type": "revolute", "links": ["right", "top"]},
        "D": {"type": "revolute", "links": ["left", "block"]},
        "T": {"type": "prismatic", "links": ["top", "block"]},
    },
    "drivers": {"S": {"speed": -0.1, "range": [0, -0.1]}},
}


def test_a_scissor_lift_stands_upright() -> None:
    """Its top is at √(l² − x²), l = 0.5 m between the pins of a leg, where the foot is at x: not below the ground."""
    result = analyse(Mechanism(**SCISSORS), 11)
    x = 0.4 - 0.1 * result["time"].values
    top = result["point_position"].sel(point="top.C").values[1]
    np.testing.assert_allclose(top, np.sqrt(0.25 - x**2), rtol=1e-9)
    assert not any(one.code == "assembly.choice" for one in result.trunnion.findings)
