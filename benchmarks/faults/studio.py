"""Faults of the studio: what is dragged, who is answered, which assembly a ghost is."""

from __future__ import annotations

from benchmarks.faults.fault import Fault

__all__ = ["FAULTS"]

FAULTS = (
    Fault(
        "dragged-link-turned-the-other-way",
        "studio/sketch.py",
        "direction = places[ahead] - places[origin]",
        "direction = (places[ahead] - places[origin]).conjugate()",
        ("tests/studio/test_answers.py", "-k", "three_joints"),
    ),
    Fault(
        "guide-that-does-not-follow-its-block",
        "studio/sketch.py",
        "base = self.local(first, joint) + 1j * axis * across",
        "base = self.local(first, joint)",
        ("tests/studio/test_answers.py", "-k", "guide"),
    ),
    Fault(
        "other-pages-are-answered",
        "studio/server.py",
        'headers.get("origin") not in {None, *(f"http://{host}" for host in hosts)}',
        'headers.get("origin") == ""',
        ("tests/studio/test_server.py", "-k", "other_pages"),
    ),
    Fault(
        "files-by-links-out-of-the-folder",
        "studio/server.py",
        "if os.path.dirname(os.path.realpath(path)) != os.path.realpath(self.folder):",
        "if path.parent != self.folder:",
        ("tests/studio/test_server.py", "-k", "file_is"),
    ),
    Fault(
        "folder-is-read-without-the-token",
        "studio/server.py",
        'Route("/files", self._own(self._files, admitted=True))',
        'Route("/files", self._own(self._files))',
        ("tests/studio/test_server.py", "-k", "without_the_token"),
    ),
    Fault(
        "address-that-lets-in-twice",
        "studio/server.py",
        'self.entrances.discard(code or "")',
        "pass",
        ("tests/studio/test_server.py", "-k", "lets_in_once"),
    ),
    Fault(
        "another-file-is-replaced",
        "studio/server.py",
        'body.get("over") is not True and',
        "False and",
        ("tests/studio/test_server.py", "-k", "another_file"),
    ),
)
