"""Every key that a joint of every pair may state changes a result, or a finding says that it does not."""

import copy

import numpy as np
import pytest

import trunnion
from mechanisms_parts import joined
from mechanisms_space import chain
from trunnion import MechanismError
from trunnion.cycle.positions import positions
from trunnion.joints.pairs import PAIRS
from trunnion.model.checks.check import check_model
from trunnion.model.joint_parts import Guide, Misalignment, Pin
from trunnion.solve.run import prepare

STEPS = 3
CHAINS = {  # one closed chain for each pair, which is its joint B
    "revolute": ("RRSC", 1), "prismatic": ("RPSC", 404), "cylindrical": ("RCCC", 404), "spherical": ("RSCR", 404),
    "universal": ("RUSR", 4), "helical": ("RHSC", 1), "planar": ("RECR", 1), "fixed": ("RFSCR", 404),
}  # fmt: skip
PLANAR = {
    "space": "planar", "gravity": [0, -9.81], "fits": "mean",
    "links": {"ground": {"points": {"A": [0, 0], "D": {"at": [0, 0], "axis": [1, 0]}}},
              "crank": {"points": {"A": [0, 0], "B": ["40 mm", 0]}, "mass": 1},
              "rod": {"points": {"B": [0, 0], "C": ["0.15 m", 0]}, "mass": 1},
              "slider": {"points": {"C": [0, "10 mm"], "D": {"at": [0, 0], "axis": [1, 0]}}, "mass": 2}},
    "joints": joined("ground -A- crank -B- rod -C- slider, ground =D= slider"),
    "drivers": {"A": {"speed": "60 rpm", "start": "20 deg"}},
    "loads": {"work": {"link": "slider", "at": "D", "force": ["-500 N", 0]}},
    "assembly": {"C": ["0.19 m", "10 mm"]},
}  # fmt: skip
VALUES = {  # two of each key, which differ
    "pin.radius": ("16 mm", "18 mm"), "pin.hole_radius": ("16.1 mm", "16.2 mm"), "pin.length": ("60 mm", "80 mm"),
    "pin.bearing": ("50 mm", "70 mm"), "pin.clearance": ("0.1 mm", "0.2 mm"),
    "pin.fit": ("32 mm H8/d9", "32 mm H8/e9"), "pin.offset": ("5 mm", "15 mm"),
    "pin.cylindricity": ("20 um", "90 um"), "pin.end_float": ("0.1 mm", "0.4 mm"),
    "guide.length": ("0.3 m", "0.4 m"), "guide.width": ("0.1 m", "0.2 m"), "guide.height": ("40 mm", "50 mm"),
    "guide.clearance": ("0.1 mm", "0.2 mm"),
    "misalignment.tilt": ("0.1 deg", "0.2 deg"), "misalignment.towards": ("10 deg", "80 deg"),
    "misalignment.offset": ("0.1 mm", "0.2 mm"), "misalignment.offset_towards": ("10 deg", "80 deg"),
    "friction.coefficient": (0.02, 0.03), "friction.model": ("two-contact", "pezzuti"),
    "friction.pair_factor": (1, 1.2), "pitch": ("0.2 m", "0.21 m"),
    "stiffness.radial": ("2e6 N/m", "3e6 N/m"),
}  # fmt: skip
BASES = [  # beside what the key is stated: alone, with friction, with a play, with an axis off
    {},
    {"friction": 0.02, "pin": {"radius": "15 mm", "bearing": "50 mm"}, "guide": {"length": "0.3 m", "width": "0.1 m"}},
    {"friction": 0.02, "pin": {"radius": "15 mm"}, "guide": {"length": "0.3 m"}},
    {"pin": {"radius": "16 mm", "clearance": "0.1 mm", "length": "60 mm"}, "seat": "loaded",
     "guide": {"length": "0.3 m", "clearance": "0.1 mm"}},
    {"pin": {"radius": "16 mm", "length": "60 mm"}, "guide": {"length": "0.3 m"}, "seat": "loaded"},
    {"pin": {"length": "60 mm"}, "seat": "loaded"},
    {"misalignment": {"tilt": "0.1 deg", "offset": "0.1 mm"}},
    {"misalignment": {"offset": "0.1 mm"}},
]  # fmt: skip


def test_every_key_is_tried():
    stated = {f"{name}.{key}" for name, part in (("pin", Pin), ("guide", Guide), ("misalignment", Misalignment))
              for key in part.model_fields}  # fmt: skip
    assert stated <= VALUES.keys()
    assert CHAINS.keys() == PAIRS.keys()


@pytest.fixture(scope="module")
def bare():
    found = {("spatial", kind): chain(*one).data for kind, one in CHAINS.items()}
    return found | {("planar", kind): PLANAR for kind, one in PAIRS.items() if one.planar}


def models(data, joint, key, value):
    """The model with a key stated, over every base."""
    found = []
    for base in BASES:
        own = {name: value for name, value in data["joints"][joint].items() if name in ("type", "links", "pitch")}
        part, _, name = key.rpartition(".")
        if part in base or not base:
            stated = base.get(part)
            rest = {"coefficient": stated} if part == "friction" and not isinstance(stated, dict) and stated else stated
            own = {**own, **base, **({part: {**(rest or {}), name: value}} if part else {name: value})}
            if part in ("pin", "guide"):
                own.pop("guide" if part == "pin" else "pin", None)
            else:
                own.pop("guide" if "rotation" in PAIRS[own["type"]].freedoms else "pin", None)
            if name in ("fit", "hole_radius"):
                own["pin"].pop("clearance", None)
            if name == "fit":
                own["pin"].pop("radius", None)
            found.append({**copy.deepcopy(data), "joints": {**data["joints"], joint: own}})
    return found


def figures(mechanism):
    """At each position: what holds over the cycle, as its findings, takes far longer."""
    with np.errstate(all="ignore"):
        arrays = positions(prepare(mechanism), STEPS, margin=False, averaged=False).arrays
    names = (
        "drive_effort", "friction_power", "reaction_force", "joint_rotation", "joint_slide", "link_error",
        "pin_pressure",
    )  # fmt: skip
    return np.concatenate([arrays[name].ravel() for name in names if name in arrays])


@pytest.mark.sample(80)
@pytest.mark.slow
@pytest.mark.parametrize("key", VALUES)
@pytest.mark.parametrize(
    ("space", "kind"),
    [("spatial", kind) for kind in PAIRS] + [("planar", kind) for kind in PAIRS if PAIRS[kind].planar],
)
def test_a_key_changes_something_or_is_told(space, kind, key, bare):
    data = bare[space, kind]
    joint = ("D" if kind == "prismatic" else "B") if space == "planar" else "B"
    accepted = 0
    for one, two in zip(*(models(data, joint, key, value) for value in VALUES[key]), strict=True):
        try:
            mechanisms = [trunnion.Mechanism(**each) for each in (one, two)]
        except MechanismError:
            continue
        if any("not used" in found.what and key in found.where for found in check_model(mechanisms[1])):
            continue
        accepted += 1
        first, second = map(figures, mechanisms)
        if first.shape != second.shape or not np.array_equal(first, second, equal_nan=True):
            return
    assert not accepted, f"{key} of a {kind} joint is accepted {accepted} times and changes nothing"


@pytest.mark.spread(4)
@pytest.mark.parametrize("kind", ["universal", "helical"])
@pytest.mark.parametrize("play", [{"clearance": "0.1 mm"}, {"hole_radius": "15.1 mm"}, {"cylindricity": "10 um"},
                                  {"fit": "30 mm H7/f7", "radius": None}])  # fmt: skip
def test_a_play_that_is_not_modelled_is_refused_with_advice_that_works(kind, play, bare):
    """Stated with the joint or by default; what is to be written in its place is accepted."""
    data = copy.deepcopy(bare["spatial", kind])
    pin = {key: value for key, value in {"radius": "15 mm", "bearing": "50 mm", **play}.items() if value}
    data["joints"]["B"] |= {"pin": pin, "friction": 0.1}
    by_default = copy.deepcopy(data)
    by_default["joints"]["B"].pop("pin")
    by_default["joint_defaults"] = {"pin": pin}
    for model in (data, *([] if "hole_radius" in play else [by_default])):  # the other pins are thicker than that
        with pytest.raises(MechanismError) as caught:
            trunnion.Mechanism(**model)
        (only,) = (found for found in caught.value.findings if found.where == "joints.B.pin")
        assert f"of a {kind} joint is not modelled" in only.what
        stated = only.remedy.partition("state pin: {")[2].partition("}")[0]
        advised = dict(part.split(": ") for part in stated.split(", "))
        model["joints"]["B"]["pin"] = {"bearing": "50 mm", **advised}
        assert trunnion.Mechanism(**model)
