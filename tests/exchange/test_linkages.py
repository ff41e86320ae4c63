"""Drawings of PMKS+ and mechanisms of pylinkage: read as what the other program has, or refused in a sentence.

Links of PMKS+ are of its public library of templates (MIT), files of pylinkage were written by its release 1.3.0.
"""

import json
import math
import time

import numpy as np
import pytest

from trunnion import analyse
from trunnion.errors import MechanismError
from trunnion.exchange import import_file, model_text
from trunnion.model.mechanism import read_mechanism

SITE = "https://app.pmksplus.com/?"
PMKS = {
    "four-bar": "2P.Ay,1E8.K,0.1011.MA,A,0mv,0VU,0.GB,B,0e_,E6,0.GC,C,l1,WW,0.KD,D,qD,0Pk,0..YRAB,AB,Fe,Fe,0ix,08i,"
    "c5cae9,A,B,,.YRBC,BC,Fe,Fe,32,NJ,303e9f,B,C,,.YRCD,CD,Fe,Fe,nd,3P,0d125a,C,D,,...N_v",
    "slider-crank": "2P.Ay,1E8.K,0.1011.MA,A,0mA,0c,0.GB,B,0Yt,bK,0.GC,C,il,H-,0.LD,D,il,H-,0..YRAB,AB,Fe,Fe,0fW,IN,"
    "c5cae9,A,B,,.YRBC,BC,Fe,Fe,4y,Rf,303e9f,B,C,,.YPCD,CD,Fe,0,0,0,,C,D,,...N_j",
    "jansen": "2P.1jO,1E8.K,0.1011.MO,O,0,0,0.GA,A,3gO,0,0.KG,G,09Hm,01vu,0.GB,B,05tE,7ee,0.GC,C,0IGg,1-F,0.GD,D,06b8,"
    "0B7B,0.GE,E,0ETW,06sL,0.GF,F,0AYO,0MPj,0..YROA,OA,Fe,Fe,1rC,0,c5cae9,O,A,,.YRAB,AB,Fe,Fe,016R,3qK,303e9f,A,B,,."
    "YRGBC,GBC,Fe,Fe,0B8Z,2ag,0d125a,G,B,C,,.YRAD,AD,Fe,Fe,01TO,05Zc,B2DFDB,A,D,,.YRGD,GD,Fe,Fe,07xS,06WY,26A69A,G,D,,"
    ".YRCE,CE,Fe,Fe,0GN5,02RZ,00695C,C,E,,.YRDEF,DEF,Fe,Fe,0AXh,0DT4,c5cae9,D,E,F,,...N_c",
    "shaper": "2P.Ay,1E8.K,0.1011.MA,A,0,0,0.GB,B,Fe,0,0.KC,C,0,0ku,0.GD,D,Oj,RF,0.GR,R,qW,si,0.HP,P,Fe,0,0,CD,C,D.LQ,"
    "Q,qW,si,0..YRAB,AB,Fe,Fe,7q,0,c5cae9,A,B,,.YRCD,CD,Fe,Fe,CN,09q,303e9f,C,D,,.YRDR,DR,Fe,Fe,cd,e_,0d125a,D,R,,."
    "YPBP,BP,Fe,0,0,0,,B,P,,.YPRQ,RQ,Fe,0,0,0,,R,Q,,...N_H",
}
FOUR_BAR = {
    "name": "fourbar",
    "joints": [
        {"id": "crank.motor_ground.A", "type": "ground", "position": [0.0, 0.0]},
        {"id": "coupler.0_crank.tip", "type": "revolute", "position": [30.0, 0.0]},
        {"id": "ground.D_rocker.1", "type": "ground", "position": [90, 0.0]},
        {"id": "coupler.1_rocker.0", "type": "revolute", "position": [83.33333333333334, 59.62847939999439]},
        {"id": "T", "type": "tracker", "position": [40.0, 20.0], "ref_joint1_id": "coupler.0_crank.tip",
         "ref_joint2_id": "coupler.1_rocker.0", "distance": 22.360679774997898, "angle": 0.0},
    ],
    "links": [
        {"id": "ground", "type": "ground", "joints": ["crank.motor_ground.A", "ground.D_rocker.1"]},
        {"id": "crank", "type": "driver", "joints": ["crank.motor_ground.A", "coupler.0_crank.tip"],
         "angular_velocity": 0.7853981633974483, "initial_angle": 0.0, "motor_joint": "crank.motor_ground.A"},
        {"id": "coupler", "type": "link", "joints": ["coupler.0_crank.tip", "coupler.1_rocker.0"]},
        {"id": "rocker", "type": "link", "joints": ["coupler.1_rocker.0", "ground.D_rocker.1"]},
    ],
    "ground": "ground",
}  # fmt: skip
# where pylinkage has the pin of coupler and rocker after each eighth of a turn
PATH = [
    (91.1881774942888, 59.98823413172008), (74.91295768304002, 58.07220638245336),
    (54.133412449212635, 48.09977024333591), (41.66666666666667, 35.55121501283589),
    (38.94639553853296, 31.520302528561977), (43.087042316959995, 37.4055397157867),
    (57.195429152111984, 50.238034709629076), (83.33333333333333, 59.62847939999438),
]  # fmt: skip
SLIDER = {
    "name": "slider-crank",
    "joints": [
        {"id": "O", "type": "ground", "position": [0.0, 0.0]},
        {"id": "A", "type": "revolute", "position": [30.0, 0.0]},
        {"id": "B", "type": "prismatic", "position": [-60.0, 0.0], "axis": [1.0, 0.0], "line_point": [0.0, 0.0]},
    ],
    "links": [
        {"id": "ground", "type": "ground", "joints": ["O", "B"]},
        {"id": "crank", "type": "driver", "joints": ["O", "A"], "angular_velocity": 0.1, "motor_joint": "O"},
        {"id": "rod", "type": "link", "joints": ["A", "B"]},
    ],
}


def model(draft, tmp_path):
    (tmp_path / "model.yaml").write_text(model_text(draft), encoding="utf-8")
    return read_mechanism(tmp_path / "model.yaml")


def written(data, tmp_path, name="linkage.json"):
    text = data if isinstance(data, str) else json.dumps(data)
    (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path / name


def codes(draft):
    return [finding.code.removeprefix("exchange.") for finding in draft.findings]


@pytest.mark.parametrize("name", PMKS)
def test_every_template_runs_for_its_whole_cycle(name, tmp_path):
    mechanism = model(import_file(SITE + PMKS[name]), tmp_path)
    assert np.all(analyse(mechanism, 72)["status"].values == 0)


def test_a_saved_file_and_a_shortcut_are_the_link(tmp_path):
    wanted = model_text(import_file(SITE + PMKS["four-bar"])).splitlines()[3:]
    shortcut = f"[InternetShortcut]\nURL={SITE}{PMKS['four-bar']}\n"
    for name, text in (
        ("one.pmks", PMKS["four-bar"]),
        ("one.txt", "\n" + SITE + PMKS["four-bar"]),
        ("one.url", shortcut),
    ):
        assert model_text(import_file(written(text, tmp_path, name))).splitlines()[3:] == wanted


def test_places_masses_and_speed_are_in_their_units():
    """By hand: -0mv is −(48·64 + 57) thousandths of a cm."""
    draft = import_file(SITE + PMKS["four-bar"])
    assert draft.pairs["A"].at == pytest.approx([-(48 * 64 + 57) * 1e-5, -(31 * 64 + 30) * 1e-5, 0.0], rel=1e-12)
    assert draft.pairs["A"].links == ("ground", "AB")
    assert draft.drives == {"A": pytest.approx(-20 * 2 * math.pi / 60)}
    assert draft.bodies["BC"].mass == pytest.approx(1e-3)
    assert draft.bodies["BC"].inertia[2, 2] == pytest.approx(1e-4)
    assert draft.gravity is not None
    assert codes(draft) == ["unit"]


def test_jansens_leg_has_the_lengths_that_he_states():
    draft = import_file(SITE + PMKS["jansen"])
    places = {name: pair.at for name, pair in draft.pairs.items()} | {"F": draft.bodies["DEF"].points["F"]}
    lengths = {"OA": 15.0, "AB": 50.0, "GB": 41.5, "BC": 55.8, "GC": 40.1, "AD": 61.9, "GD": 39.3, "CE": 39.4,
               "DE": 36.7, "EF": 65.7, "DF": 49.0}  # fmt: skip
    for (first, second), length in lengths.items():
        assert np.linalg.norm(places[second] - places[first]) == pytest.approx(length * 1e-2, abs=2e-5)


def test_the_ram_of_the_shaper_is_where_its_proportions_have_it(tmp_path):
    """Crank 1, 3 above the pivot of a lever of 5, a rod of 2.5 to a ram 3.5 above the crank; in cm."""
    mechanism = model(import_file(SITE + PMKS["shaper"]), tmp_path)
    result = analyse(mechanism, 360, variables=["point_position", "joint_rotation"])
    angle = -np.arange(360) * math.pi / 180  # it turns clockwise
    lever = np.arctan2(np.sin(angle) + 3, np.cos(angle))
    ram = 5 * np.cos(lever) + np.sqrt(2.5**2 - (3.5 + 3 - 5 * np.sin(lever)) ** 2)
    place = result["point_position"].sel(point="DR.R").values
    np.testing.assert_allclose(place[0], ram * 1e-2, atol=3e-5)  # its places are rounded to 0.001 cm
    np.testing.assert_allclose(place[1], 0.035, atol=1e-12)


def check(text):
    """The signs at the end of a link, as its site makes them."""
    signs = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
    text += signs[len(text) % 62]
    code = 0x811C9DC5
    for sign in text:
        code = (code ^ ord(sign)) * 0x01000193 % 2**32
    digest = "".join(signs[code // 62**k % 62] for k in range(5, -1, -1))
    return f"{text}*{digest}"


def test_newer_links_have_a_digest_corrections_and_one_joint_for_a_slider(tmp_path):
    text = "2P.Ay,1E8.K,0.2011.MA,A,0,0,0.GB,B,Fe,0,0.LC,C,_W,0,0..YRAB,AB,Fe,Fe,7q,0,c5cae9,A,B,,."
    text += "YRBC,BC,Fe,Fe,MG,0,303e9f,B,C,,...N_.PJB~0~1.23456789,PLBC~1~0.000125,PJC~4~0.5,PI~0~1.5"
    draft = import_file(SITE + check(text))
    assert draft.pairs["B"].at[0] == 1.23456789  # m
    assert draft.bodies["BC"].inertia[2, 2] == 0.000125
    assert draft.bodies["C block"].mass == 0.5
    assert draft.drives == {"A": pytest.approx(-1.5 * 2 * math.pi / 60)}
    assert np.all(analyse(model(draft, tmp_path), 36)["status"].values == 0)
    with pytest.raises(MechanismError, match="is damaged"):
        import_file(SITE + check(text).replace("7q", "7r"))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (SITE + PMKS["four-bar"][:-1] + "w", "is damaged"),  # its length does not fit
        (SITE + PMKS["four-bar"].replace("0mv", "0m!"), "is damaged"),
        (SITE + "pmks2:0123abcd.eyJ9", "newest format"),
        (SITE + "j=A,0,0&l=AB", "no link of PMKS"),
        ("https://example.org/", "no link of PMKS"),
        (SITE + "x" * 2_000_000, "at most 1,000,000"),
        (SITE + check(PMKS["four-bar"][:-1].replace("..YRAB", ".GE,E,0,0,0" * 3000 + "..YRAB")), "at most 2,000"),
        (SITE + check(PMKS["four-bar"][:-1].replace("A,B,,", "A,Q,,")), "is damaged"),
        (SITE + check(PMKS["four-bar"][:-1].replace("KD,D", "KC,D")), "is damaged"),
    ],
)
def test_bad_links_are_refused_in_a_sentence(text, says):
    begin = time.perf_counter()
    with pytest.raises(MechanismError, match=says) as error:
        import_file(text)
    assert len(error.value.findings) == 1
    assert time.perf_counter() - begin < 60  # some 6 s where nothing else runs; it must not hang


def test_a_mechanism_of_pylinkage_moves_as_it_does_there(tmp_path):
    draft = import_file(written(FOUR_BAR, tmp_path))
    assert draft.ground == "ground"
    assert list(draft.drives) == ["crank-motor_ground-A"]
    assert codes(draft) == ["unit", "speed"]
    assert draft.bodies["coupler"].points["T"] == pytest.approx([0.040, 0.020, 0.0])
    result = analyse(model(draft, tmp_path), 8)
    place = result["point_position"].sel(point="coupler.coupler-1_rocker-0").values.T
    np.testing.assert_allclose(np.roll(place, -1, axis=0) * 1e3, PATH, atol=1e-9)


def test_a_slider_of_pylinkage_is_a_pin_on_a_line(tmp_path):
    mechanism = model(import_file(written(SLIDER, tmp_path), unit="in"), tmp_path)
    place = analyse(mechanism, 4)["point_position"].sel(point="rod.B").values.T / 0.0254
    np.testing.assert_allclose(place[:, 0], [-60, -math.sqrt(7200), -120, -math.sqrt(7200)], atol=1e-9)


def test_joints_without_a_place_of_their_own_or_too_many_are_refused(tmp_path):
    twice = {**FOUR_BAR, "joints": [*FOUR_BAR["joints"], FOUR_BAR["joints"][1]]}
    many = {"joints": [{"id": str(k), "type": "revolute", "position": [k, 0]} for k in range(100_000)], "links": []}
    first, *others = FOUR_BAR["links"]
    strange = {**FOUR_BAR, "links": [{**first, "joints": ["zz"]}, *others]}
    bare = {**FOUR_BAR, "links": [{key: value for key, value in first.items() if key != "joints"}, *others]}
    for data, says in (
        (twice, "two joints of the same name"),
        (many, "at most 2,000"),
        (strange, "'zz' is no joint of the file"),
        (bare, f"{first['id']!r} without 'joints'"),
        ({**FOUR_BAR, "links": ["?"]}, "no joints and links"),
        ([], "no joints and links"),
    ):
        with pytest.raises(MechanismError, match=says):
            import_file(written(data, tmp_path))
