"""The studio's server: who is answered, which files it reads and writes, and what goes over its socket."""

import http.client
import json
import os
import stat
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import quote

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

import trunnion
from served import served as serving
from studio.asking import EXAMPLES, model_of, unpacked


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


def raw(studio, method, path, body=None, token=True, **headers):
    """Status, headers and bytes of an answer."""
    if token:
        headers["Authorization"] = f"Bearer {studio.token}"
    connection = http.client.HTTPConnection("127.0.0.1", studio.port, timeout=20)
    connection.request(method, path, body, headers)
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer.status, dict(answer.getheaders()), content


def fetched(studio, method, path, body=None, token=True, **headers):
    """Status, headers and text of an answer."""
    status, stated, content = raw(studio, method, path, body, token, **headers)
    return status, stated, content.decode()


def saved(studio, name, text, **how):
    """Status and words of an attempt to save."""
    status, _, told = fetched(studio, "PUT", f"/file/{name}", json.dumps({"text": text, **how}).encode())
    return status, json.loads(told)


GUARDED = ["/files", "/file/R%C3%A4der.yaml"]
CODE = ["/", "/modules.js", "/studio/index.html", "/web/chart.js"]  # of the page: the same for everybody
WRONG = ["x", "é", "\xff\xfe", "", "Räder" * 2000]


@pytest.mark.parametrize("path", GUARDED)
def test_without_the_token_there_is_nothing(served, path):
    """A cookie is no token: any port of this machine gets those."""
    for cookie in (f"trunnion_studio_{served.port}={served.token}", f"token={served.token}"):
        assert fetched(served, "GET", path, token=False, Cookie=cookie)[0] == 403
    for wrong in WRONG:
        bearer = f"Bearer {wrong}".encode("latin-1")
        assert fetched(served, "GET", path, token=False, Authorization=bearer)[0] == 403
    assert fetched(served, "PUT", "/file/new.yaml", b'{"text": "x"}', token=False)[0] == 403
    assert not (served.folder / "new.yaml").exists()


@pytest.mark.parametrize("path", CODE)
def test_the_code_of_the_page_tells_nothing_of_the_folder(served, path):
    status, headers, text = fetched(served, "GET", path, token=False)
    assert status == 200
    assert "set-cookie" not in headers
    assert served.token not in text
    assert "Räder" not in text


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize("key", ["token", "once"])
def test_an_address_with_a_wrong_token_is_refused(served, key, wrong):
    status, _, text = fetched(served, "GET", f"/?{key}={quote(wrong)}", token=False)
    assert status == 403
    assert "not let in" in text


def test_an_address_of_a_browsers_arguments_lets_in_once(served):
    address = served.entrance()
    assert served.token not in address
    path = address.partition(str(served.port))[2]
    assert served.token in fetched(served, "GET", path, token=False)[2]
    status, _, text = fetched(served, "GET", path, token=False)
    assert (status, served.token in text) == (403, False)
    assert "another program has opened it" in text


@pytest.mark.slow
def test_the_arguments_of_the_browser_hold_no_token(tmp_path):
    """The program that is to be the browser writes down what everybody may read of it."""
    recorder, record = tmp_path / "browser", tmp_path / "arguments"
    recorder.write_text(f'#!/bin/sh\necho "$@" > {record}\n', "utf-8")
    recorder.chmod(0o700)
    record.touch()
    command = [sys.executable, "-m", "trunnion", "studio", str(tmp_path), "--port", "0"]
    environment = os.environ | {"BROWSER": f"{recorder} %s"}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        address = process.stdout.readline().split()[-1]
        for _ in range(200):
            if record.stat().st_size:
                break
            time.sleep(0.1)
        arguments = record.read_text("utf-8")
        studio = SimpleNamespace(port=int(address.split(":")[2].split("/")[0]), token=address.split("=")[1])
        assert studio.token not in arguments
        page = fetched(studio, "GET", "/" + arguments.strip().rpartition("/")[2], token=False)[2]
        assert f'content="{studio.token}"' in page
        process.terminate()


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:é".encode("latin-1")},
        {"Host": "evil.example"},
        {"Host": "127.0.0.1:1"},
        {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"},
        {"Sec-Fetch-Site": "same-site", "Sec-Fetch-Mode": "cors"},  # another port
    ],
)
@pytest.mark.parametrize("path", [*GUARDED, *CODE])
def test_other_pages_and_names_get_nothing(served, path, headers):
    assert fetched(served, "GET", path, **headers)[0] == 403
    assert fetched(served, "GET", f"/?token={served.token}", token=False, **headers)[0] == 403
    assert fetched(served, "PUT", "/file/new.yaml", b'{"text": "x"}', **headers)[0] == 403
    assert not (served.folder / "new.yaml").exists()


def test_the_page_fetches_from_here_alone(served):
    status, headers, text = fetched(served, "GET", f"/?token={served.token}", token=False)
    assert status == 200
    assert f'content="{served.token}"' in text
    assert "default-src 'none'" in headers["content-security-policy"]
    assert "{{nonce}}" not in text
    assert "https://" not in text


def test_files_of_the_folder_alone(served):
    told = json.loads(fetched(served, "GET", "/files")[2])
    assert (told["open"], told["files"]) == ("Räder.yaml", ["Räder.yaml"])
    assert json.loads(raw(served, "GET", "/file/R%C3%A4der.yaml")[2])["text"] == EXAMPLES["hoecken"]
    assert fetched(served, "GET", "/file/notes.txt")[0] == 404


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
    assert fetched(served, "PUT", f"/file/{name}", b'{"text": "evil", "over": true}')[0] in (400, 404, 405)
    assert sorted(os.walk(served.folder.parent)) == before
    assert (served.folder / "out.yaml").read_text() == "trunnion: 1"


def test_a_model_is_saved(served):
    assert saved(served, "saved.yaml", "name: Kurbel ±") == (200, {"saved": "saved.yaml"})
    assert (served.folder / "saved.yaml").read_text("utf-8") == "name: Kurbel ±"
    (served.folder / "saved.yaml").unlink()
    status, told = saved(served, "large.yaml", "x" * 2_000_001)
    assert (status, "2,000,001 bytes" in told["error"]) == (400, True)


@pytest.mark.parametrize(
    "body", [b"", b"name: x", b"[]", b"{}", b'{"text": 5}', b'{"text": "\\ud800"}', b"[" * 100_000]
)
def test_what_is_no_text_is_not_saved(served, body):
    status, _, text = fetched(served, "PUT", "/file/odd.yaml", body)
    assert status in (400, 500)
    assert json.loads(text)["error"]
    assert not (served.folder / "odd.yaml").exists()


@pytest.mark.parametrize("content", [b"services: {}\n", b"\xff\xfe", b"x" * 2_000_001], ids=["text", "bytes", "large"])
def test_another_file_is_replaced_only_where_that_is_said(served, content):
    """What is there is looked at in the folder, under the name with its ending."""
    there = served.folder / "compose.yaml"
    there.write_bytes(content)
    other, former = (
        {"opened": "other.yaml", "saved": "services: {}\n"},
        {"opened": "compose.yaml", "saved": "as it was"},
    )
    for how in ({}, former, other):
        status, told = saved(served, "compose", "name: mine", **how)
        assert (status, told["existing"]) == (409, "compose.yaml")
        assert there.read_bytes() == content
    assert saved(served, "compose", "name: mine", over=True) == (200, {"saved": "compose.yaml"})
    assert saved(served, "compose.yaml", "name: more", opened="compose.yaml", saved="name: mine")[0] == 200
    assert there.read_text("utf-8") == "name: more"
    there.unlink()


def test_a_file_that_comes_while_another_is_saved_stays(served, monkeypatch):
    there, touch = served.folder / "race.yaml", Path.touch
    monkeypatch.setattr(Path, "touch", lambda path, **how: there.write_text("first", "utf-8") and touch(path, **how))
    assert saved(served, "race", "second")[0] == 400
    assert there.read_text("utf-8") == "first"
    there.unlink()


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o444])
def test_saving_keeps_the_permissions(served, mode):
    there = served.folder / "private.yaml"
    there.write_text("a: 1", "utf-8")
    there.chmod(mode)
    assert saved(served, "private.yaml", "a: 2", opened="private.yaml", saved="a: 1")[0] == 200
    assert stat.S_IMODE(there.stat().st_mode) == mode
    there.unlink()


def test_what_is_no_regular_file_holds_nothing_up(tmp_path):
    (tmp_path / "good.yaml").write_text("a: 1", "utf-8")
    (tmp_path / "loop.yaml").symlink_to("loop.yaml")
    (tmp_path / "nothing.yaml").symlink_to("gone.yaml")
    (tmp_path / "folder.yaml").mkdir()
    os.mkfifo(tmp_path / "pipe.yaml")
    (Path(os.fsdecode(os.fsencode(tmp_path) + b"/\xff.yaml"))).write_text("a: 1", "utf-8")
    with serving(tmp_path, "pipe.yaml") as studio:
        assert json.loads(fetched(studio, "GET", "/files")[2])["files"] == ["good.yaml"]
        for name in ("loop.yaml", "nothing.yaml", "folder.yaml", "pipe.yaml"):
            assert fetched(studio, "GET", f"/file/{name}")[0] == 404
            assert saved(studio, name, "a: 2", over=True)[0] == 400
        assert saved(studio, "good.yaml", "a: 2", over=True)[0] == 200


def test_folders_of_one_name_are_two(tmp_path):
    told = []
    for name in ("one/models", "two/models", "one/models/../models"):
        (tmp_path / name).mkdir(parents=True, exist_ok=True)
        with serving(tmp_path / name, None) as studio:
            told.append(json.loads(fetched(studio, "GET", "/files")[2]))
    assert {one["folder"] for one in told} == {"models"}
    assert told[0]["id"] == told[2]["id"] != told[1]["id"]


@pytest.mark.parametrize(
    "path", ["/web/../answers.py", "/studio/..%2Fserver.py", "/web/%2e%2e/__init__.py", "/cli/app.py", "/web/"]
)
def test_no_other_part_of_the_program_is_served(served, path):
    assert fetched(served, "GET", path)[0] == 404


def socket_of(studio, origin=None, token=None, **headers):
    protocols = ["trunnion", token or studio.token]
    address = f"ws://127.0.0.1:{studio.port}/socket"
    return connect(address, origin=origin, subprotocols=protocols, additional_headers=headers)


def test_figures_of_a_cycle_hold_nothing_up(served):
    text = EXAMPLES["jansen"]
    with socket_of(served, f"http://127.0.0.1:{served.port}") as line:
        line.send(json.dumps({"ask": "model", "revision": 1, "text": text}))
        motion = unpacked(line.recv(timeout=60))
        assert motion["solved"]
        assert "figures" not in motion
        line.send(json.dumps({"ask": "cycle", "revision": 1, "text": text}))
        line.send(json.dumps({"ask": "example", "revision": 1, "name": "hoecken"}))
        answers = [unpacked(line.recv(timeout=60)) for _ in range(2)]
    assert [found["ask"] for found in answers] == ["example", "cycle"]
    assert answers[1]["figures"]


QUESTIONS = [
    "", "no question", "[", "[" * 100_000, "5", "null", b"", b"\xff\xfe", b'{"ask": "start"}', b"\x00" * 9, "{}",
    '{"ask": "\\ud800"}', '{"ask": "start", "revision": "\\ud800"}', '{"ask": ["start"], "revision": {}}',
    '{"ask": "start", "revision": ' + "[" * 900 + "]" * 900 + "}", '{"ask": "model", "text": "\\ud800"}',
    '{"ask": "model", "text": "trunnion: 1\\nname: \\ud800\\n"}', '{"ask": "model", "text": "a", "steps": 1e999}',
    '{"ask": "model", "text": "' + "x" * 5_000_000 + '"}', '{"ask": "edit", "text": "' + "- a\\n" * 1_000_000 + '"}',
    *(
        json.dumps({"ask": kind, "text": EXAMPLES["hoecken"], **how})
        for kind, how in [
            ("model", {"steps": float("inf")}), ("model", {"steps": "x"}), ("model", {"steps": 10**400}),
            ("drag", {}), ("drag", {"point": "B", "to": [1e308, 1e308]}), ("drag", {"point": "B", "to": ["nan", 1]}),
            ("drag", {"point": "B", "to": [1, 1], "index": float("inf")}),
            ("edit", {"gestures": [{"do": "move", "point": "B", "to": [1e999, 1]}]}), ("edit", {"gestures": 5}),
            ("edit", {"gestures": [5]}), ("edit", {"gestures": [None]}), ("edit", {"gestures": [], "places": [1]}),
            ("edit", {"gestures": [{"do": "set", "path": []}]}), ("edit", {"gestures": [{"do": "set", "path": 5}]}),
            ("edit", {"gestures": [{"do": "set", "path": ["name"], "value": "\ud800"}]}), ("compare", {"others": [5]}),
            ("compare", {"others": [{"text": {}}]}), ("layers", {"wanted": 5}), ("layers", {"names": 5}),
            ("layers", {"names": [1e999]}), ("export", {"what": [1]}),
            ("tolerances", {"steps": -1e999}), ("example", {"name": "../x"}), ("assemblies", {"steps": None}),
        ]
    ),
]  # fmt: skip


def test_every_question_is_answered_over_the_same_socket(served):
    with socket_of(served, f"http://127.0.0.1:{served.port}") as line:
        for question in QUESTIONS:
            line.send(question)
            found = unpacked(line.recv(timeout=60))
            sound = len(found) > 2  # more than the head: there is nothing wrong with it
            assert found.get("error") or found.get("findings") or sound, question[-200:]
        line.send('{"ask": "example", "revision": 1, "name": "hoecken"}')
        assert unpacked(line.recv())["text"] == EXAMPLES["hoecken"]


@pytest.mark.parametrize(
    "how", [{"origin": "http://evil.example"}, {"origin": None}, {"token": "x"}, {"token": "x" * 4000}]
)
def test_nobody_else_may_ask(served, how):
    how = {"origin": f"http://127.0.0.1:{served.port}", "Cookie": f"trunnion_studio_{served.port}={served.token}"} | how
    with pytest.raises(InvalidStatus, match="403"):
        socket_of(served, **how)


def test_a_dropped_file_of_another_program_becomes_a_model(served, tmp_path):
    mechanism = model_of(EXAMPLES["durango-fourbar"])
    path = tmp_path / "arm.urdf"
    trunnion.exchange.export_model(mechanism, path, at="60 deg")
    status, _, content = raw(served, "PUT", "/import/arm.urdf", path.read_bytes())
    assert status == 200
    assert set(model_of(json.loads(content)["text"]).links) == set(mechanism.links)
    status, _, content = raw(served, "PUT", "/import/arm.urdf", b"<robot><link")
    assert status == 400
    assert "arm.urdf" in json.loads(content)["error"].lower()
    assert raw(served, "PUT", "/import/arm.urdf", b"", token=False)[0] == 403
