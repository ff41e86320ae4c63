"""Faults of the studio: what is dragged, who is answered, which assembly a ghost is."""

from __future__ import annotations

from benchmarks.faults.fault import Fault

__all__ = ["FAULTS"]

FAULTS = (
    Fault(
        "dragged-link-turned-the-other-way",
        "studio/sketch.py",
        "frame = Frame(x, y, sign * (a - x) / length, sign * (b - y) / length)",
        "frame = Frame(x, y, sign * (a - x) / length, -sign * (b - y) / length)",
        ("tests/studio/test_answers.py", "-k", "three_joints"),
    ),
    Fault(
        "guide-that-does-not-follow-its-block",
        "studio/sketch.py",
        "yield from self._at(first, joint, (base[0] - across * y / norm, base[1] + across * x / norm))",
        "yield from self._at(first, joint, base)",
        ("tests/studio/test_answers.py", "-k", "guide"),
    ),
    Fault(
        "other-pages-are-answered",
        "studio/server.py",
        "if origin is not None and origin not in",
        "if origin is None and origin not in",
        ("tests/studio/test_server.py", "-k", "other_pages"),
    ),
    Fault(
        "files-by-links-out-of-the-folder",
        "studio/server.py",
        "if path.resolve().parent != self.folder.resolve():",
        "if path.parent != self.folder:",
        ("tests/studio/test_server.py", "-k", "file_is"),
    ),
)
