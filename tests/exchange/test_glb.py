"""GLB out: the file is parsed here byte by byte, and its poses are those of the analysis."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import trunnion
from trunnion.exchange import export_model, import_file
from trunnion.exchange.skeleton import positions_of
from trunnion.model.mechanism import Mechanism

PARTS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


class Glb:
    """The JSON of a GLB and its arrays."""

    def __init__(self, path: Path) -> None:
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

    def array(self, number: int) -> Any:
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

    def poses(self) -> dict[str, dict[str, Any]]:
        """The keys of every moving node: time, translation, rotation."""
        (animation,) = self.json["animations"]
        poses: dict[str, dict[str, Any]] = {}
        for channel in animation["channels"]:
            sampler = animation["samplers"][channel["sampler"]]
            node = self.json["nodes"][channel["target"]["node"]]["name"]
            poses.setdefault(node, {})[channel["target"]["path"]] = self.array(sampler["output"])
            poses[node]["time"] = self.array(sampler["input"])[:, 0]
        return poses


def example(name: str) -> Mechanism:
    return trunnion.read(Path("examples") / f"{name}.yaml")


@pytest.mark.spread(1, "rssr")
@pytest.mark.parametrize(
    "name", ["durango-fourbar", "scotch-yoke", "jansen", "rssr", "double-cardan", "swash-plate-pump"]
)
def test_keys_are_the_poses_of_the_analysis(name: str, tmp_path: Path) -> None:
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
    times = result["time"].values - result["time"].values[0]
    np.testing.assert_allclose(next(iter(poses.values()))["time"], times, atol=1e-6 * times[-1])


def test_meshes_lie_where_the_joints_are_and_face_outwards(tmp_path: Path) -> None:
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


def test_z_points_up_in_space(tmp_path: Path) -> None:
    export_model(example("rssr"), tmp_path / "out.glb", frames=8)
    root = Glb(tmp_path / "out.glb").json["nodes"][0]
    np.testing.assert_allclose(Rotation.from_quat(root["rotation"]).apply([0, 0, 1]), [0, 1, 0], atol=1e-12)


def test_positions_without_a_solution_are_left_out_and_counted(tmp_path: Path) -> None:
    mechanism = example("durango-fourbar").with_values({"AD": "7.5 m"})  # longest and shortest link are too long
    noted = export_model(mechanism, tmp_path / "out.glb", frames=36)
    (finding,) = (finding for finding in noted if finding.code == "exchange.unsolved")
    solved = np.isfinite(trunnion.analyse(mechanism, 36)["link_angle"].sel(link="rocker").values).sum()
    assert f"{36 - solved} of 36" in finding.what
    assert len(Glb(tmp_path / "out.glb").poses()["rocker"]["time"]) == solved


def test_its_meshes_can_be_read_as_bodies(tmp_path: Path) -> None:
    export_model(example("durango-fourbar"), tmp_path / "out.glb", frames=4)
    draft = import_file(tmp_path / "out.glb")
    assert {"crank", "coupler", "rocker"} <= set(draft.bodies)
    assert all(draft.bodies[name].mass > 0 for name in ("crank", "coupler", "rocker"))
