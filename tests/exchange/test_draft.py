"""Drafts: a mechanism as bodies and pairs in one frame, and the model file made of it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import trunnion
from trunnion.exchange.draft import Body, Draft, Pair, moved, positions_of, steiner
from trunnion.exchange.formats import FORMATS
from trunnion.exchange.model_file import complete, model_text


def read(text, folder):
    path = folder / "model.yaml"
    path.write_text(text, "utf-8")
    return trunnion.read(path)


def four_bar():
    return positions_of(trunnion.read(Path("examples/durango-fourbar.yaml")), 4).draft()


TURNED = ("durango-fourbar", "slider-crank", "jansen", "rssr", "double-cardan", "rccc", "whitworth-quick-return")


@pytest.mark.slow
@settings(deadline=None, max_examples=6)
@given(name=st.sampled_from(TURNED), seed=st.integers(0, 2**31 - 1))
def test_the_drive_torque_does_not_depend_on_the_frame(name, seed, tmp_path_factory):
    stated = trunnion.read(Path("examples") / f"{name}.yaml")
    stated = stated.with_friction("off").model_copy(update={"loads": {}, "measures": {}})
    draft = positions_of(stated, 4).draft()
    draft = replace(draft, plane=False)
    rotation = Rotation.random(random_state=seed).as_matrix()
    turned = moved(draft, rotation, np.random.default_rng(seed).normal(size=3))
    if stated.space == "planar":  # a plane has no third component of gravity
        turned.gravity = draft.gravity if draft.gravity is None else rotation @ draft.gravity
    again = read(model_text(complete(turned)), tmp_path_factory.mktemp("turned"))
    assert again.space == stated.space
    expected = trunnion.analyse(stated, 24)["drive_effort"].values
    found = trunnion.analyse(again, 24)["drive_effort"].values
    np.testing.assert_allclose(abs(found), abs(expected), atol=1e-8 * np.nanmax(abs(expected)))


def test_fixed_pairs_make_one_body_with_the_mass_of_both_and_the_name_of_the_ground():
    one = Body("one", 2.0, np.array([0.0, 0.0, 0.0]), np.diag([1.0, 2.0, 3.0]))
    two = Body("two", 1.0, np.array([3.0, 0.0, 0.0]), np.diag([1.0, 1.0, 1.0]))
    pairs = {
        "weld": Pair("weld", "fixed", ("one", "two"), np.zeros(3)),
        "screws": Pair("screws", "fixed", ("bracket", "base"), np.zeros(3)),
        "A": Pair("A", "revolute", ("base", "two"), np.zeros(3)),
    }
    bodies = {"one": one, "two": two, "bracket": Body("bracket"), "base": Body("base")}
    draft = Draft("", bodies, pairs, "base").welded()
    assert list(draft.bodies) == ["one", "base"]
    assert list(draft.pairs) == ["A"]
    assert draft.pairs["A"].links == ("base", "one")
    united = draft.bodies["one"]
    assert united.mass == 3.0
    np.testing.assert_allclose(united.centre, [1.0, 0.0, 0.0])
    np.testing.assert_allclose(
        *(sum(b.inertia + b.mass * steiner(b.centre) for b in bodies) for bodies in ([united], [one, two]))
    )


def test_ground_and_drive_are_taken_where_the_file_says_neither_and_said_so():
    draft = replace(four_bar(), ground="", drives={})
    made = complete(draft)
    assert made.ground == "ground"
    assert len(made.drives) == 1
    assert [finding.code for finding in made.findings] == ["exchange.ground", "exchange.drive"]


def test_names_and_comments_of_any_kind_stay_names_and_comments(tmp_path):
    draft = four_bar()
    names = dict(zip(draft.bodies, ("yes", 'a "b" \\ c', "Kurbel: Ø 8 # links", "杆"), strict=True))
    bodies = {names[name]: replace(body, name=names[name]) for name, body in draft.bodies.items()}
    bodies["yes"].comments.append("two\nlines: [not a key]\x00")
    pairs = {
        name: replace(pair, links=(names[pair.links[0]], names[pair.links[1]])) for name, pair in draft.pairs.items()
    }
    made = read(model_text(complete(replace(draft, bodies=bodies, pairs=pairs, ground=names[draft.ground]))), tmp_path)
    assert set(made.links) == set(names.values())


def test_extensions_that_nothing_reads_are_refused(tmp_path):
    path = tmp_path / "model.xyz"
    path.write_text("text")
    with pytest.raises(trunnion.MechanismError, match=r"'\.xyz', which is not read here"):
        trunnion.exchange.import_file(path)
    for suffix in FORMATS:
        empty = tmp_path / f"empty{suffix}"
        empty.touch()
        if FORMATS[suffix].reads:
            with pytest.raises(trunnion.MechanismError, match="is empty"):
                trunnion.exchange.import_file(empty)
            with pytest.raises(trunnion.MechanismError, match="cannot be read"):
                trunnion.exchange.import_file(tmp_path / f"missing{suffix}")


def test_a_speed_is_one_of_the_joint_that_it_drives():
    draft = replace(four_bar(), drives={})
    driven = next(iter(complete(draft).drives))
    assert complete(draft, drive=driven, speed=3.0, turns=True).drives == {driven: 3.0}
    assert complete(four_bar(), drive=driven, speed=3.0).drives == {driven: 3.0}  # the user's goes before the file's
    assert complete(draft).drives[driven] == pytest.approx(2 * np.pi)
    with pytest.raises(trunnion.MechanismError, match="a joint that slides, and A turns"):
        complete(draft, drive="A", speed=0.1, turns=False)


@pytest.mark.parametrize(
    ("part", "value", "says"),
    [
        ("mass", -1.0, "has the mass -1 kg"),
        ("centre", np.full(3, np.nan), "that is no number"),
        ("at", np.array([2e9, 0, 0]), "lies 2e.09 m away"),
        ("axis", np.zeros(3), "has no place or no axis"),
        ("links", ("crank", "wall"), "joins 'wall', which it does not have"),
    ],
)
def test_what_is_no_body_or_pair_is_refused(part, value, says):
    draft = four_bar()
    setattr(next(iter((draft.bodies if part in ("mass", "centre") else draft.pairs).values())), part, value)
    with pytest.raises(trunnion.MechanismError, match=says):
        draft.checked()


def test_a_drive_with_limits_keeps_within_them(tmp_path):
    draft = four_bar()
    driven = next(iter(draft.drives))
    draft.pairs[driven] = replace(draft.pairs[driven], limits=(np.radians(-11), np.radians(17)))
    made = read(model_text(complete(draft)), tmp_path)
    result = trunnion.analyse(made, 12)
    turned = np.degrees(result["joint_rotation"].sel(joint=driven).values)
    assert (turned.min(), turned.max()) == pytest.approx((-11, 17), abs=1e-6)
    assert (result["status"].values < 3).all()
