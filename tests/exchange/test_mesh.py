"""Meshes in closed form, written here byte by byte; GLB out, parsed byte by byte, with the poses of the analysis."""

import json
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import trunnion
from trunnion.exchange import export_model, import_file
from trunnion.exchange.draft import positions_of

BOX = np.array([40.0, 20.0, 10.0])
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip


def stl(corners, faces, text=False):
    triangles = np.asarray(corners)[np.asarray(faces)]
    if text:
        corner = "vertex {!r} {!r} {!r}\n"
        facet = f"facet normal 0 0 0\nouter loop\n{3 * corner}endloop\nendfacet\n"
        return f"solid box\n{''.join(facet.format(*t.ravel().tolist()) for t in triangles)}endsolid box\n".encode()
    data = b"".join(struct.pack("<12fH", 0, 0, 0, *triangle.ravel(), 0) for triangle in triangles)
    return b"\0" * 80 + struct.pack("<I", len(triangles)) + data


def model_3mf(objects, build, unit="millimeter", head=""):
    stated = "" if unit is None else f' unit="{unit}"'
    core = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>{head}<model{stated} xmlns="{core}">'
        f"<resources>{objects}</resources><build>{build}</build></model>"
    ).encode()


def solid(number, corners, faces, name=""):
    vertices = "".join(f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>' for x, y, z in np.asarray(corners).tolist())
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in np.asarray(faces).tolist())
    label = f' name="{name}"' if name else ""
    mesh = f"<mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>"
    return f'<object id="{number}" type="model"{label}>{mesh}</object>'


def packed(folder, data, name="3D/3dmodel.model"):
    path = folder / "part.3mf"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("[Content_Types].xml", "<Types/>")
        archive.writestr(name, data)
    return path


def written(folder, data, name="part.stl"):
    (folder / name).write_bytes(data)
    return folder / name


def codes(draft):
    return sorted(finding.code.removeprefix("exchange.") for finding in draft.findings)


def is_box(draft, name, sides, rotation, shift, density=7850.0):
    """A box of these sides, m, whose corner lies at shift, m."""
    body = draft.bodies[name]
    mass = density * np.prod(sides)
    square = np.asarray(sides) ** 2
    inertia = rotation @ np.diag(mass / 12 * (square.sum() - square)) @ rotation.T
    assert body.mass == pytest.approx(mass, rel=1e-9)
    np.testing.assert_allclose(body.centre, rotation @ np.asarray(sides) / 2 + shift, atol=1e-9)
    np.testing.assert_allclose(body.inertia, inertia, atol=1e-9 * np.trace(inertia))


@pytest.mark.parametrize("text", [False, True])
@pytest.mark.parametrize(("unit", "metre"), [("mm", 1e-3), ("in", 0.0254), ("m", 1.0)])
def test_a_box_as_stl(text, unit, metre, tmp_path):
    draft = import_file(written(tmp_path, stl(BOX * CORNERS, FACES, text)), unit=unit, material="aluminium")
    is_box(draft, "part", metre * BOX, np.eye(3), np.zeros(3), 2700.0)
    assert codes(draft) == (["lost", "unit"] if unit == "mm" else ["lost"])  # stated, it is no guess


@settings(deadline=None, max_examples=10)
@given(seed=st.integers(0, 2**31 - 1), inside_out=st.booleans())
def test_a_tetrahedron_anywhere(seed, inside_out, tmp_path_factory):
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(4, 3)) * 50
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    span = corners[1:] - corners[0]
    if (np.linalg.det(span) < 0) != inside_out:
        faces = faces[:, ::-1]
    path = written(tmp_path_factory.mktemp("stl"), stl(corners, faces, text=True))
    body = import_file(path, density=1000).bodies["part"]
    metres = 1e-3 * corners
    mass = 1000 * abs(np.linalg.det(1e-3 * span)) / 6
    second = mass / 20 * (metres.T @ metres + 16 * np.outer(metres.mean(axis=0), metres.mean(axis=0)))
    second -= mass * np.outer(metres.mean(axis=0), metres.mean(axis=0))
    assert body.mass == pytest.approx(mass, rel=1e-9)
    np.testing.assert_allclose(body.centre, metres.mean(axis=0), atol=1e-9)
    np.testing.assert_allclose(body.inertia, np.trace(second) * np.eye(3) - second, atol=1e-9 * np.trace(second))


def test_the_parts_of_a_3mf_lie_where_they_are_built(tmp_path):
    turn = Rotation.from_rotvec([0.3, -0.5, 0.7]).as_matrix()

    def transform(rotation, shift):  # points are rows, so the matrix is written transposed
        return " ".join(repr(float(n)) for n in [*rotation.T.ravel(), *shift])

    quarter = Rotation.from_rotvec([0, 0, np.pi / 2]).as_matrix()
    objects = solid(1, BOX * CORNERS, FACES, "Gehäuse") + solid(2, 2 * CORNERS, FACES)
    component = f'<component objectid="2" transform="{transform(quarter, [5, 6, 7])}"/>'
    objects += f'<object id="3" name="group"><components>{component}</components></object>'
    build = '<item objectid="1"/>' + f'<item objectid="3" transform="{transform(turn, [1, 2, 3])}"/>'
    draft = import_file(packed(tmp_path, model_3mf(objects, build, "centimeter")))
    assert list(draft.bodies) == ["ground", "Gehäuse", "part 2"]
    is_box(draft, "Gehäuse", 1e-2 * BOX, np.eye(3), np.zeros(3))
    is_box(draft, "part 2", [0.02] * 3, turn @ quarter, 1e-2 * (turn @ [5, 6, 7] + [1, 2, 3]))
    assert codes(draft) == ["lost"]


@pytest.mark.parametrize(
    "faces",
    [FACES[:-1], np.vstack([FACES[:-1], FACES[-1:, ::-1]]), np.vstack([FACES, [[0, 1, 7]]]), FACES[:2]],
    ids=["hole", "flipped", "fin", "sheet"],
)
def test_an_open_mesh_has_no_mass_and_says_so(faces, tmp_path):
    draft = import_file(written(tmp_path, stl(BOX * CORNERS, faces)))
    assert draft.bodies["part"].mass == 0
    assert "open_mesh" in codes(draft)


def test_a_cavity_is_subtracted(tmp_path):
    corners = np.vstack([BOX * CORNERS, BOX * (0.25 + 0.5 * CORNERS)])
    draft = import_file(written(tmp_path, stl(corners, np.vstack([FACES, FACES[:, ::-1] + 8]))))
    assert draft.bodies["part"].mass == pytest.approx(7850 * np.prod(1e-3 * BOX) * 7 / 8, rel=1e-6)


PARTS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


class Glb:
    """The JSON of a GLB and its arrays."""

    def __init__(self, path):
        data = path.read_bytes()
        magic, version, length = struct.unpack_from("<4sII", data)
        assert (magic, version, length) == (b"glTF", 2, len(data))
        size, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON"
        self.json = json.loads(data[20 : 20 + size])
        binary, kind = struct.unpack_from("<I4s", data, 20 + size)
        assert kind == b"BIN\0"
        assert 28 + size + binary == len(data)
        self.bytes = data[28 + size :]

    def array(self, number):
        accessor = self.json["accessors"][number]
        view = self.json["bufferViews"][accessor["bufferView"]]
        assert view["byteOffset"] % 4 == 0
        assert view["byteOffset"] + view["byteLength"] <= len(self.bytes)
        kind = {5126: np.float32, 5125: np.uint32}[accessor["componentType"]]
        parts = PARTS[accessor["type"]]
        array = np.frombuffer(self.bytes, kind, accessor["count"] * parts, view["byteOffset"]).reshape(-1, parts)
        if "min" in accessor:
            np.testing.assert_array_equal(array.min(axis=0), np.array(accessor["min"], kind))
            np.testing.assert_array_equal(array.max(axis=0), np.array(accessor["max"], kind))
        return array

    def poses(self):
        """The keys of every moving node: time, translation, rotation."""
        (animation,) = self.json["animations"]
        poses = {}
        for channel in animation["channels"]:
            sampler = animation["samplers"][channel["sampler"]]
            node = self.json["nodes"][channel["target"]["node"]]["name"]
            poses.setdefault(node, {})[channel["target"]["path"]] = self.array(sampler["output"])
            poses[node]["time"] = self.array(sampler["input"])[:, 0]
        return poses


def example(name):
    return trunnion.read(Path("examples") / f"{name}.yaml")


@pytest.mark.spread(0, "rssr")
@pytest.mark.parametrize(
    "name", ["durango-fourbar", "scotch-yoke", "jansen", "rssr", "double-cardan", "swash-plate-pump"]
)
def test_keys_are_the_poses_of_the_analysis(name, tmp_path):
    mechanism = example(name)
    export_model(mechanism, tmp_path / "out.glb", frames=40)
    glb, result = Glb(tmp_path / "out.glb"), trunnion.analyse(mechanism, 40)
    poses, size = glb.poses(), float(np.ptp(result["point_position"].values))
    assert set(poses) == set(mechanism.effective_links) - {mechanism.fixed_link}
    values = mechanism.parameters()
    for point in result["point"].values.astype(str):
        link, _, own = point.partition(".")
        paths = [f"links.{link}.points.{own}{at}.{axis}" for axis in "xyz" for at in ("", ".at")]
        local = np.zeros(3)
        local[: sum(path in values for path in paths)] = [float(values[path]) for path in paths if path in values]
        if link not in poses or link not in mechanism.links or not any(path in values for path in paths):
            continue
        keys = poses[link]
        assert len(keys["time"]) == len(keys["translation"]) == len(keys["rotation"]) == 40
        turned = Rotation.from_quat(keys["rotation"].astype(float)).apply(local)
        expected = result["point_position"].sel(point=point).values.T
        np.testing.assert_allclose((keys["translation"] + turned)[:, : expected.shape[1]], expected, atol=1e-6 * size)
        np.testing.assert_allclose(np.linalg.norm(keys["rotation"], axis=1), 1, atol=1e-6)
        assert (np.sum(keys["rotation"][1:] * keys["rotation"][:-1], axis=1) > 0).all()
    up = Rotation.from_quat(glb.json["nodes"][0].get("rotation", [0, 0, 0, 1])).apply([0, 0, 1])
    np.testing.assert_allclose(up, [0, 1, 0] if mechanism.space == "spatial" else [0, 0, 1], atol=1e-12)
    times = result["time"].values - result["time"].values[0]
    np.testing.assert_allclose(next(iter(poses.values()))["time"], times, atol=1e-6 * times[-1])


def test_meshes_lie_where_the_joints_are_and_face_outwards(tmp_path):
    mechanism = example("durango-fourbar")
    export_model(mechanism, tmp_path / "out.glb", frames=12)
    glb = Glb(tmp_path / "out.glb")
    draft = positions_of(mechanism, 12).draft()
    for node in glb.json["nodes"][1:]:
        (part,) = glb.json["meshes"][node["mesh"]]["primitives"]
        vertices, faces = glb.array(part["attributes"]["POSITION"]), glb.array(part["indices"]).reshape(-1, 3)
        mesh = trimesh.Trimesh(vertices, faces)
        assert mesh.is_watertight
        assert all(shell.volume > 0 for shell in mesh.split())
        placed = Rotation.from_quat(node["rotation"]).apply(vertices) + node["translation"]
        ends = [pair.at for pair in draft.pairs.values() if node["name"] in pair.links]
        for end in ends:
            assert np.linalg.norm(placed - end, axis=1).min() < 0.2
    scene = trimesh.load_scene(tmp_path / "out.glb")
    assert len(scene.geometry) == 4


@pytest.mark.slow
def test_positions_without_a_solution_are_left_out_and_counted(tmp_path):
    mechanism = example("durango-fourbar").with_values({"AD": "7.5 m"})  # longest and shortest link are too long
    noted = export_model(mechanism, tmp_path / "out.glb", frames=36)
    (finding,) = (finding for finding in noted if finding.code == "exchange.unsolved")
    solved = np.isfinite(trunnion.analyse(mechanism, 36)["link_angle"].sel(link="rocker").values).sum()
    assert f"{36 - solved} of 36" in finding.what
    assert len(Glb(tmp_path / "out.glb").poses()["rocker"]["time"]) == solved
