"""The gallery: every example that is analysed, by section, with its checked fact.

`docs/gallery_page.py` makes the page of it, `test_gallery.py` checks it. To add an example: put the file into
`examples/`, with `notes:` that say in a sentence or two what it is, and an `Entry` of the file's name into one of the
modules below, or into a module of its own that gets a line here.
"""

from collections.abc import Mapping

from gallery import benchmarks, drawing, four_bars, in_time, presses, several_loops, sliders, spatial, toleranced
from gallery.entry import Entry

SECTIONS: Mapping[str, Mapping[str, Entry]] = {
    "Four-bars": four_bars.ENTRIES, "Linkages with slides": sliders.ENTRIES, "Several loops": several_loops.ENTRIES,
    "Straight lines and walking legs": drawing.ENTRIES, "Gears": several_loops.GEARED, "Presses": presses.ENTRIES,
    "Moved by motors and weights": in_time.ENTRIES, "Two drives, a large group, a benchmark": benchmarks.ENTRIES,
    "In space": spatial.ENTRIES, "With play and misaligned axes": toleranced.PLAYED,
    "With tolerances": toleranced.ENTRIES,
}  # fmt: skip
ENTRIES: Mapping[str, Entry] = {name: entry for section in SECTIONS.values() for name, entry in section.items()}

# Examples that are there for their diagnosis: what the finding says that keeps them from being analysed.
REFUSED: Mapping[str, str] = {"fourbar-in-space": "3 constraints are redundant, in the joints A, B, C, D"}
