"""Which data files are read, each with what the mapping says of it."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.rig.reading.mapping import File
from trunnion.rig.reading.mapping_file import Mapped

__all__ = ["files_of", "unused_zero"]


def files_of(
    mapped: Mapped, files: Iterable[str | os.PathLike[str]] | None
) -> tuple[list[tuple[Path, File]], list[Finding]]:
    """Data files with what the mapping says of them; notes of what is kept of it, or lost, where it names other files.

    Files of the command line keep the entry of the same file; what was set also that of the same name, where one entry
    alone has it. A stretch of time is that of one recording.
    """
    entries = mapped.mapping.files
    named = [Path(one) for one in files or ()]
    if not named and not entries:
        finding = Finding(
            "no data file is named", "files", "write files: [{file: run-01.csv}], or name them after the mapping"
        )
        raise MechanismError(mapped.placed([finding]))
    if not named:
        return [(mapped.folder / entry.file, entry) for entry in entries], []
    stated = {(mapped.folder / one.file).resolve(): one for one in entries}
    own, other = [one.name for one in named], [Path(one.file).name for one in entries]
    found: list[tuple[Path, File]] = []
    kept: list[Path] = []
    lost: dict[str, list[Path]] = {}
    for path in named:
        entry = stated.get(path.resolve())
        if entry is None:
            alike = own.count(path.name) == 1 == other.count(path.name)
            like = entries[other.index(path.name)] if alike else None
            entry = File(file=path.name or ".", set=like.set if like else {})
            kept += [path] if entry.set else []
            missing = _says(*([like.model_copy(update={"set": {}})] if like else entries))
            lost.setdefault(missing, []).append(path)
        found.append((path, entry))
    notes = []
    if kept:
        what = f"{_some(kept)} read with the `set` of the file of that name in the mapping"
        notes.append(
            Finding(what, "files", "rename the file if something else was set", Severity.NOTE, code="data.files.set")
        )
    for missing, paths in lost.items():
        what = f"{_some(paths)} read without {missing}, which the mapping states for other files"
        remedy = f"add {{file: {paths[0].name}, {missing.split('`')[1]}: …}} to `files`" if missing else ""
        notes += [Finding(what, "files", remedy, Severity.NOTE, code="data.files.less")] if missing else []
    return found, notes


def unused_zero(mapped: Mapped, entries: Sequence[File]) -> list[Finding]:
    """A note of a zero of the angle that nothing takes, as every file states its own."""
    angle = mapped.mapping.angle
    if angle is None or "zero" not in angle.model_fields_set or not all(entry.angle for entry in entries):
        return []
    what = "is not used: every file states a zero of its own, in place of it"
    remedy = "remove it, or add it to each zero in files: angle: {zero: …}"
    return [Finding(what, "angle.zero", remedy, Severity.NOTE, code="data.angle.zero_unused")]


def _says(*entries: File) -> str:
    """What entries state of their files."""
    keys = ("set", "over", "angle", "channels")
    return " and ".join(f"`{key}`" for key in keys if any(getattr(one, key) for one in entries))


def _some(paths: Sequence[Path]) -> str:
    told = ", ".join(str(one) for one in paths[:4]) + (f" and {len(paths) - 4} more" if len(paths) > 4 else "")
    return f"{told} {'is' if len(paths) == 1 else 'are'}"
