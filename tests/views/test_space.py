"""Views of spatial results: figures of every kind, a scene that is the result, a page that turns, flat columns."""

import json
import re
import shutil
from itertools import pairwise

import numpy as np
import pytest
from stand_in_space import CHAINS, SPATIAL, of_pair, rssr
from test_report import Page

from trunnion.errors import MechanismError, Status
from trunnion.results.tables import columns
from trunnion.views.bodies import SYMBOLS, best, looking, scenery, solids, space
from trunnion.views.cycle import PLOTS, READY, mechanism
from trunnion.views.draw import save
from trunnion.views.report import report
from trunnion.views.scene import scene, screw_axis
from trunnion.views.shown import plot
from trunnion.views.sketch import facets

BLANK = ("nowhere", "locked")  # no position can be drawn


@pytest.fixture(params=SPATIAL)
def spatial(request):
    """(name, result) of every kind of spatial result."""
    return request.param, SPATIAL[request.param]()


@pytest.mark.sample(9)
@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in PLOTS if name not in READY])
def test_every_figure_of_every_spatial_result(name, spatial, tmp_path):
    kind, result = spatial
    if name == "mechanism" and kind in BLANK:
        with pytest.raises(MechanismError, match="nothing to draw"):
            plot(result, name)
        return
    figure = plot(result, name, ideal=result)
    # in one format each: every figure comes up in both, and so does every result
    suffix = ("png", "svg")[([*PLOTS].index(name) + [*SPATIAL].index(kind)) % 2]
    assert 5_000 < save(figure, tmp_path / f"figure.{suffix}").stat().st_size < 3_000_000


def test_a_position_that_cannot_be_drawn_is_refused():
    with pytest.raises(MechanismError, match="no position 120 among the 120"):
        mechanism(rssr(), index=120)
    with pytest.raises(MechanismError, match="position 50 cannot be assembled"):
        mechanism(rssr(gap=(40, 60, Status.NOT_ASSEMBLED)), index=50)


def test_no_mechanism_is_seen_on_its_edge():
    """Flat ones, turned anyhow: the view shows a good part of their true area."""
    rng = np.random.default_rng(7)
    for _ in range(20):
        result = rssr(24)
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        shown = space(result)
        flat = shown.spots - shown.spots.mean(axis=0)
        flat[:, 2] *= 0.01
        object.__setattr__(shown, "spots", flat @ turn.T)
        object.__setattr__(shown, "joints", {})
        seen = (shown.spots @ looking(*best(shown)))[:, :2]
        true = np.prod(np.linalg.svd(shown.spots, compute_uv=False)[:2])
        assert np.prod(np.linalg.svd(seen, compute_uv=False)) > 0.3 * true


@pytest.mark.slow
def test_every_pair_has_a_symbol():
    from trunnion.joints.pairs import PAIRS

    assert SYMBOLS.keys() == {pair.body for pair in PAIRS.values()}
    drawn = [space(of_pair(kind)) for kind in CHAINS] + [space(rssr())]
    assert {one["type"] for shown in drawn for one in shown.joints.values()} == PAIRS.keys()
    assert all(len(solids(shown)) > 2 * len(shown.joints) for shown in drawn)


@pytest.mark.spread(5)
def test_poses_and_frames_put_the_joints_where_the_points_are(spatial):
    """What the drawings are made of gives the places that the result tells, on both links."""
    kind, result = spatial
    if kind in (*BLANK, "gap"):
        return
    shown = space(result)
    size = max(shown.size, 1e-3)
    for joint, one in shown.joints.items():
        for side, link in enumerate(one["links"]):
            track = result["point_position"].sel(point=f"{link}.{joint}").transpose("axis", "position").values
            assert shown.at(joint, side) == pytest.approx(track, abs=1e-9 * size, nan_ok=True), joint
        if joint in shown.stated["plays"]:  # its pin does not lie in the middle of its hole
            continue
        if one["type"] in ("revolute", "cylindrical", "helical", "prismatic"):
            both = shown.axis(joint, 0), shown.axis(joint, 1)
            assert both[0] == pytest.approx(both[1], abs=1e-9, nan_ok=True), joint
        if one["type"] in ("prismatic", "cylindrical"):
            slide = result["joint_slide"].sel(joint=joint).values
            assert shown.slides(joint) == pytest.approx(slide, abs=1e-9 * size, nan_ok=True), joint


@pytest.mark.spread(3)
@pytest.mark.parametrize("name", ["RSSR", "Cardan", *CHAINS])
def test_facets_look_outwards(name):
    """The volume that the facets of each solid enclose is positive."""
    shown = space(SPATIAL[name]())
    for solid in solids(shown):
        if solid.kind == "wire":
            continue
        found = facets(solid, shown.size)
        middle = np.mean([corner for one in found for corner in one], axis=0)
        fans = [
            (one[0] - middle, one[i] - middle, one[i + 1] - middle) for one in found for i in range(1, len(one) - 1)
        ]
        assert sum(np.linalg.det(fan) for fan in fans) > 0, solid


def test_the_scene_is_the_result():
    result = rssr()
    shown = scene(result, result)
    joint = next(one for one in shown["joints"] if one["name"] == "C")
    for axis in "xyz":
        for what, variable in (("reaction", "reaction_force"), ("moment", "reaction_moment")):
            own = np.broadcast_to(joint[what][axis], 120)
            assert own == pytest.approx(result[variable].sel(joint="C", axis=axis).values, rel=1e-6, abs=1e-12)
    rocker = next(one for one in shown["links"] if one["name"] == "rocker")
    assert rocker["pose"]["w"] == pytest.approx(result.link_rotation.sel(link="rocker", component="w").values, rel=1e-6)
    assert shown["free"][0] == {"key": "rod.E", "link": "rod", "at": pytest.approx([0.06, 0.03, 0], abs=1e-9)}
    work, brake = shown["loads"]
    assert (work["at"], work["force"]) == (pytest.approx([0.11, 0, 0.02]), [0, -150.0, 60.0])
    assert brake["moment"] == [0, 0, -3.0]


def test_screw_axis_of_a_helix():
    """A body that turns about a line and slides along it: that line, and slide over angle."""
    rng = np.random.default_rng(3)
    along = rng.normal(size=3)
    along /= np.linalg.norm(along)
    base, place = rng.normal(size=(2, 3))
    spin, pitch = 4.0, 0.03
    velocity = spin * np.cross(along, place - base) + pitch * spin * along
    point, direction, h = screw_axis(spin * along[:, None], place[:, None], velocity[:, None], np.zeros(3))
    assert direction[:, 0] == pytest.approx(along)
    assert np.cross(point[:, 0] - base, along) == pytest.approx(np.zeros(3), abs=1e-12)
    assert point[:, 0] @ along == pytest.approx(0, abs=1e-12)
    assert h[0] == pytest.approx(pitch)


def test_screw_axes_of_the_scene():
    result = rssr(360)
    screws = {link["name"]: link["screw"] for link in scene(result)["links"]}
    assert screws["ground"] is None
    assert screws["crank"]["w"] == pytest.approx(np.ones(len(screws["crank"]["w"])))
    assert np.abs(screws["crank"]["x"]).max() < 1e-5
    assert np.abs(screws["rocker"]["pitch"]).max() < 1e-3 * 0.1
    assert np.abs(screws["rod"]["pitch"]).max() > 1e-3
    still = result.copy(deep=True)
    still["link_angular_velocity"][:] = 0.0
    assert set(scene(still)["links"][1]["screw"]["pitch"]) == {None}


@pytest.mark.spread(5)
def test_every_spatial_result_makes_a_page_without_a_net(spatial):
    kind, result = spatial
    text = report(result, result)
    page = Page(text)
    assert not page.open
    shown = page.scene()
    assert (shown["count"], shown["space"]) == (result.sizes["position"], "spatial")
    assert bool(shown["solids"]) == (kind not in BLANK)
    assert "in the plane of two of its axes" in " ".join(page.words)
    assert len(text) < 1_500_000


if shutil.which("node"):  # as in test_scene.py
    from test_scene import page, run

    def test_arithmetic_of_the_drawing():
        run("space.test.mjs")

    @pytest.mark.spread(0)
    def test_every_spatial_result_is_shown(spatial, tmp_path):
        kind, result = spatial
        shown = page(result, tmp_path, result)
        assert shown["polars"] == result.sizes["joint"]
        assert (shown["space"] is None) == (kind in BLANK)
        if shown["space"]:
            turning = [joint for joint in json.loads(result.attrs["scene"])["joints"].values()
                       if joint["type"] not in ("spherical", "universal", "fixed")]  # fmt: skip
            assert shown["space"]["painted"] > 500
            assert shown["space"]["after"]["axes"] >= len(turning)

    def test_a_spatial_scene_is_steered_and_shows_what_is_chosen(tmp_path):
        space = page(rssr(24), tmp_path)["space"]
        assert space["painted"] > 1000
        assert (space["before"]["axes"], space["before"]["screws"], space["before"]["twists"]) == (0, 0, 0)
        assert (space["after"]["axes"], space["after"]["screws"], space["after"]["twists"]) == (2, 3, 2)
        assert [name.split(",")[0] for name in space["after"]["names"]] == ["crank", "rod", "rocker"]
        assert "a turn" in space["after"]["names"][1]
        assert all(one != two for one, two in pairwise(space["views"]))
        assert space["plane"] == ["Fy", "Fz"] * 4
        assert "20" in space["keys"][0]
        assert "mm" in space["keys"][0]

    @pytest.mark.slow
    def test_python_and_browser_look_alike(tmp_path):
        """The first view of the page is that of the figure: its triad points the same way."""
        result = rssr(24)
        camera = scenery(space(result)).camera
        paths = page(result, tmp_path)["space"]["before"]["triad"]
        for path, axis in zip(paths, np.eye(3), strict=True):
            (x0, y0), _, (x1, y1) = (map(float, found) for found in re.findall(r"(-?[\d.]+),(-?[\d.]+)", path)[:3])
            right, up, _ = axis @ camera
            assert (x1 - x0, y0 - y1) == (pytest.approx(26 * right, abs=0.2), pytest.approx(26 * up, abs=0.2))


@pytest.mark.parametrize(
    ("kind", "moves"),
    [("helical", {"rotation", "slide"}), ("prismatic", {"slide"}), ("planar", set()), ("fixed", set()),
     ("universal", {"rotation"}), ("rssr", {"rotation"})],
)  # fmt: skip
def test_flat_columns_of_every_kind(kind, moves):
    result = of_pair(kind)
    flat = {name: values for name, _, values in columns(result)}
    assert len(flat) == len(columns(result))
    assert {"rotation", "slide"} & {name.removeprefix("B.") for name in flat} == moves
    link = str(result["link"].values[1])
    assert {f"{link}.rotation_w", f"{link}.angular_velocity_z"} <= flat.keys()
    for axis in "xyz":
        for what, variable in (("reaction", "reaction_force"), ("reaction_moment", "reaction_moment")):
            own = result[variable].sel(joint="B", axis=axis)
            assert flat[f"B.{what}_{axis}"] == pytest.approx(own.values)
