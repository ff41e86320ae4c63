"""The studio's server: who is answered, which files it reads and writes, and what goes over its socket."""

from __future__ import annotations

import http.client
import json
import os
import re
from pathlib import Path

import numpy as np
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

import trunnion
from served import served as serving
from trunnion.model.file import entries_of
from trunnion.model.mechanism import Mechanism
from trunnion.studio.message import unpacked
from trunnion.studio.page import document, script

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "src" / "trunnion" / "studio" / "web"
EXAMPLES = {path.stem: path.read_text("utf-8") for path in (ROOT / "examples").glob("*.yaml")}


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    """A studio that runs, on a folder with a model, a text that is none, and a link that leads out."""
    folder = tmp_path_factory.mktemp("models")
    (folder / "Räder.yaml").write_text(EXAMPLES["hoecken"], encoding="utf-8")
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    secret = tmp_path_factory.mktemp("elsewhere") / "secret.yaml"
    secret.write_text("trunnion: 1", encoding="utf-8")
    (folder / "out.yaml").symlink_to(secret)
    with serving(folder, "Räder.yaml") as studio:
        yield studio


def fetched(studio, method, path, body=None, cookie=True, **headers):
    """Status, headers and text of an answer."""
    if cookie:
        headers["Cookie"] = f"trunnion_studio_{studio.port}={studio.token}"
    connection = http.client.HTTPConnection("127.0.0.1", studio.port, timeout=20)
    connection.request(method, path, body, headers)
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    return answer.status, dict(answer.getheaders()), text


def raw(studio, path):
    """The bytes of an answer."""
    connection = http.client.HTTPConnection("127.0.0.1", studio.port, timeout=20)
    connection.request("GET", path, None, {"Cookie": f"trunnion_studio_{studio.port}={studio.token}"})
    content = connection.getresponse().read()
    connection.close()
    return content


PATHS = [
    "/",
    "/files",
    "/first/R%C3%A4der.yaml",
    "/thumbnail/hoecken",
    "/file/R%C3%A4der.yaml",
    "/studio/index.html",
    "/web/chart.js",
    "/?token=wrong",
]


@pytest.mark.parametrize("path", PATHS)
def test_without_the_token_there_is_nothing(served, path):
    assert fetched(served, "GET", path, cookie=False)[0] == 403
    assert fetched(served, "GET", path, cookie=False, Cookie=f"trunnion_studio_{served.port}=x")[0] == 403


@pytest.mark.parametrize(
    "headers",
    [{"Origin": "http://evil.example"}, {"Origin": "null"}, {"Host": "evil.example"}, {"Host": "127.0.0.1:1"}],
)
@pytest.mark.parametrize("path", PATHS)
def test_other_pages_and_names_get_nothing(served, path, headers):
    assert fetched(served, "GET", path, **headers)[0] == 403
    assert fetched(served, "PUT", "/file/new.yaml", b"x", **headers)[0] == 403
    assert not (served.folder / "new.yaml").exists()


def test_the_token_of_the_address_becomes_a_cookie(served):
    status, headers, _ = fetched(served, "GET", f"/?token={served.token}", cookie=False)
    assert (status, headers["location"]) == (303, "/")
    assert "HttpOnly" in headers["set-cookie"]
    assert "samesite=strict" in headers["set-cookie"].lower()
    assert fetched(served, "GET", f"/?token={served.token}", cookie=False, Host="evil.example")[0] == 403


def test_the_page_fetches_from_here_alone(served):
    status, headers, text = fetched(served, "GET", "/")
    assert status == 200
    assert "default-src 'none'" in headers["content-security-policy"]
    assert "{{nonce}}" not in text
    assert "https://" not in text


def test_files_of_the_folder_alone(served):
    told = json.loads(fetched(served, "GET", "/files")[2])
    assert (told["open"], told["files"]) == ("Räder.yaml", ["Räder.yaml"])
    assert fetched(served, "GET", "/file/R%C3%A4der.yaml")[2] == EXAMPLES["hoecken"]


def test_what_the_first_picture_is_drawn_of(served):
    result = trunnion.analyse(Mechanism(**entries_of(EXAMPLES["hoecken"])[0]), 360)
    found = unpacked(raw(served, "/first/R%C3%A4der.yaml"))
    assert found["text"] == EXAMPLES["hoecken"]
    for key, track in found["tracks"].items():
        places = result["point_position"].sel(point=key).values[:2]
        np.testing.assert_allclose([track["x"], track["y"]], places, rtol=0, atol=1e-6 * np.abs(places).max() + 1e-9)
    assert fetched(served, "GET", "/first/notes.txt")[0] == 404


def test_pictures_of_examples(served):
    found = unpacked(raw(served, "/thumbnail/durango-fourbar"))
    assert [one["ground"] for one in found["links"]] == [True, False, False, False]
    crank = next(track for track in found["paths"] if np.ptp(np.hypot(track["x"], track["y"])) < 1e-6)
    assert max(crank["x"]) == pytest.approx(2.0, rel=0.01)  # m, as the file states
    assert fetched(served, "GET", "/thumbnail/none")[0] == 404


def test_the_page_fetches_few_files():
    exported = set(re.findall(r"module_studio_\w+", script()[script().rindex("export {") :]))
    assert exported == {f"module_studio_{one.stem}" for one in PAGE.glob("*.js")}
    page = document("n", "/first/%22.yaml")
    files = [f"/studio/vendor/{one.name}" for one in PAGE.glob("vendor/*.js")] + ["/modules.js"]
    assert all(f'<link rel="modulepreload" href="{file}">' in page for file in files)
    assert '<link rel="preload" as="fetch" href="/first/%22.yaml" crossorigin>' in page
    assert page.count("<link") == len(files) + 6
    assert "{{" not in page


@pytest.mark.parametrize(
    "name", ["notes.txt", "out.yaml", "..%2Fsecret.yaml", "%2Fetc%2Fpasswd", ".hidden.yaml", "a%5Cb.yaml", "none.yaml",
             "x" * 300 + ".yaml", "a%00.yaml"],
)  # fmt: skip
def test_no_other_file_is_read(served, name):
    status, _, text = fetched(served, "GET", f"/file/{name}")
    assert status == 404
    assert "trunnion: 1" not in text
    assert "mine" not in text


@pytest.mark.parametrize("name", ["notes.txt", "out.yaml", "..%2Fnew.yaml", ".x.yaml", "x.py"])
def test_no_other_file_is_written(served, name):
    before = sorted(os.walk(served.folder.parent))
    assert fetched(served, "PUT", f"/file/{name}", b"evil")[0] in (400, 404, 405)
    assert sorted(os.walk(served.folder.parent)) == before
    assert (served.folder / "out.yaml").read_text() == "trunnion: 1"


def test_a_model_is_saved(served):
    status, _, text = fetched(served, "PUT", "/file/saved.yaml", "name: Kurbel ±".encode())
    assert (status, json.loads(text)) == (200, {"saved": "saved.yaml"})
    assert (served.folder / "saved.yaml").read_text("utf-8") == "name: Kurbel ±"
    (served.folder / "saved.yaml").unlink()
    status, _, text = fetched(served, "PUT", "/file/large.yaml", b"x" * 2_000_001)
    assert (status, "2,000,001 bytes" in text) == (400, True)


@pytest.mark.parametrize(
    "path", ["/web/../answers.py", "/studio/..%2Fserver.py", "/web/%2e%2e/__init__.py", "/cli/app.py", "/web/"]
)
def test_no_other_part_of_the_program_is_served(served, path):
    assert fetched(served, "GET", path)[0] == 404


def socket_of(studio, origin=None, cookie=None):
    headers = {"Cookie": f"trunnion_studio_{studio.port}={cookie or studio.token}"}
    return connect(f"ws://127.0.0.1:{studio.port}/socket", origin=origin, additional_headers=headers)


def test_questions_over_the_socket(served):
    with socket_of(served, f"http://127.0.0.1:{served.port}") as line:
        line.send(json.dumps({"ask": "model", "revision": 3, "text": EXAMPLES["hoecken"]}))
        found = unpacked(line.recv())
        assert (found["revision"], found["solved"]) == (3, True)
        line.send("no question")
        assert "error" in unpacked(line.recv())


@pytest.mark.parametrize("how", [{"origin": "http://evil.example"}, {"origin": None}, {"cookie": "x"}])
def test_nobody_else_may_ask(served, how):
    how = {"origin": f"http://127.0.0.1:{served.port}"} | how
    with pytest.raises(InvalidStatus, match="403"):
        socket_of(served, **how)
