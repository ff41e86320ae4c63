"""The studio in a real browser: start to first picture and to the solved cycle; drags and pulls of a slider that are
solved, with forces and margin, and drawn a second; pictures a second while it is scrubbed and played at its fastest;
memory while it plays and over runs again; how long a chain of many links takes. Needs Chromium and the extra dev.

    python -m benchmarks.studio [--play MINUTES] [--links DYADS] [--runs COUNT]
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

ROOT = Path(__file__).resolve().parents[1]
SECONDS = 3.0
NEAR = 4  # px that the last pivot of the chain is dragged, seen eight times as large; farther it cannot be assembled
COMPILED = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}  # as installed
DRAGGED = {"durango-fourbar": "C", "jansen": "K"}
SLIDERS = {"durango-fourbar": "BC", "jansen": "b"}

DRAG = """async ([name, seconds, far]) => {
  const { module_studio_state: state } = await import("/modules.js");
  const handle = document.querySelector(`.handle[data-name="${name}"]`);
  const box = handle.getBoundingClientRect();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  const sent = (kind, dx, target) => target.dispatchEvent(new PointerEvent(kind, {
    bubbles: true, cancelable: true, pointerId: 1, pointerType: "mouse", isPrimary: true,
    button: kind === "pointermove" ? -1 : 0, buttons: kind === "pointerup" ? 0 : 1,
    altKey: true, clientX: x + dx, clientY: y - dx / 2 })); // with Alt it changes lengths on its path too
  const target = handle.closest("svg"); // it captures the pointer: handles come and go with what has a place
  target.setPointerCapture = () => {};
  sent("pointerdown", 0, handle);
  let [drawn, last] = [0, state.live.value];
  const begin = performance.now();
  await new Promise((done) => {
    const frame = (now) => {
      if (state.live.value !== last) { last = state.live.value; drawn += 1; }
      if (now - begin > seconds * 1000) return done();
      sent("pointermove", far * Math.sin((now - begin) / 300), target);
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  });
  sent("pointerup", 0, target);
  return drawn / seconds;
}"""

SCRUB = """async (seconds) => {
  const { crank } = (await import("/modules.js")).module_studio_motion;
  let [frames, index] = [0, 0];
  const begin = performance.now();
  await new Promise((done) => {
    const frame = (now) => {
      if (now - begin > seconds * 1000) return done();
      crank.go((index += 3) % 360);
      frames += 1;
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  });
  return frames / seconds;
}"""


SLIDE = """async ([name, seconds]) => {
  const { module_studio_state: state } = await import("/modules.js");
  state.selection.value = null; // then the panel has the dimensions
  await new Promise((done) => setTimeout(done, 500));
  const slider = document.querySelector(`input[aria-label="${name}, slider"]`);
  const from = Number(slider.value);
  let [drawn, last] = [0, state.live.value];
  const begin = performance.now();
  await new Promise((done) => {
    const frame = (now) => {
      if (state.live.value !== last) { last = state.live.value; drawn += 1; }
      if (now - begin > seconds * 1000) return done();
      slider.value = String(from * (1 + 0.02 * Math.sin((now - begin) / 300)));
      slider.dispatchEvent(new Event("input", { bubbles: true }));
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  });
  slider.value = String(from);
  slider.dispatchEvent(new Event("pointerup", { bubbles: true }));
  return drawn / seconds;
}"""

PLAY = """async (seconds) => {
  const { module_studio_state: state, module_studio_motion: { crank } } = await import("/modules.js");
  document.querySelector(".pace select").value = "2"; // a turn in two seconds, four times as fast as usual
  crank.toggle();
  let [frames, last] = [0, -1];
  const begin = performance.now();
  await new Promise((done) => {
    const frame = (now) => {
      const at = state.index.value + state.share.value;
      if (at !== last) { last = at; frames += 1; }
      if (now - begin > seconds * 1000) return done();
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  });
  crank.toggle();
  return frames / seconds;
}"""

IDLE = """async () => {
  const { module_studio_state: state } = await import("/modules.js");
  for (let quiet = 0; quiet < 10; quiet += 1) { // a hand that lets go has not asked yet
    if (state.busy.value || state.answer.value?.coming) quiet = 0;
    await new Promise((done) => setTimeout(done, 50));
  }
}"""

LOOK = """async (name) => {
  const { module_studio_motion: { crank }, module_studio_sheet: { sheet } } = await import("/modules.js");
  crank.go(40); // at 0 the chain is near to where it cannot be assembled
  const handle = document.querySelector(`.handle[data-name="${name}"]`).getBoundingClientRect();
  const window = sheet.view.root.getBoundingClientRect();
  sheet.zoom(8, [handle.x + handle.width / 2 - window.x, handle.y + handle.height / 2 - window.y]);
}"""

ANSWER = """async (text) => {
  const { module_studio_state: state, module_studio_actions: actions } = await import("/modules.js");
  const begin = performance.now();
  state.text.value = text;
  const whole = actions.solve();
  const frame = () => new Promise(requestAnimationFrame);
  while (state.answer.value?.text !== text || !state.answer.value.scene) await frame();
  await frame();
  await frame();
  const drawn = performance.now() - begin;
  await whole;
  return [drawn / 1000, (performance.now() - begin) / 1000];
}"""


def chain(dyads: int) -> str:
    """A crank with dyads in a row, friction in every joint, a load on the last rocker."""
    numbers = range(dyads)
    rows = [
        "trunnion: 1", "name: chain", "dimensions: {a: 40 mm, b: 140 mm, c: 100 mm, d: 150 mm}", "links:",
        "  ground: {points: {O: [0, 0]" + "".join(f", C{k}: [{150 + 150 * k} mm, 0]" for k in numbers) + "}}",
        "  crank: {points: {O: [0, 0], A0: [a, 0]}, mass: 0.2 kg, centre: [a/2, 0]}",
    ]  # fmt: skip
    for k in numbers:
        end = f", A{k + 1}: [c, 0]" if k + 1 < dyads else ""
        rows.append(f"  coupler{k}: {{points: {{A{k}: [0, 0], B{k}: [{'d' if k else 'b'}, 0]}}}}")
        rows.append(f"  rocker{k}: {{points: {{C{k}: [0, 0], B{k}: [c, 0]{end}}}, mass: 0.3 kg, centre: [c/2, 0]}}")
    rows += ["joints:", "  O: {type: revolute, links: [ground, crank]}"]
    for k in numbers:
        before = f"rocker{k - 1}" if k else "crank"
        for joint, links in (
            ("A", f"{before}, coupler{k}"),
            ("B", f"coupler{k}, rocker{k}"),
            ("C", f"ground, rocker{k}"),
        ):
            rows.append(f"  {joint}{k}: {{type: revolute, links: [{links}]}}")
    hints = ", ".join(f"B{k}: [{170 + 150 * k} mm, 100 mm]" for k in numbers)
    return "\n".join(
        [*rows, "joint_defaults: {friction: 0.1, pin: {radius: 5 mm}}", "drivers: {O: {speed: 10 rad/s}}",
         f"loads: {{F: {{joint: C{dyads - 1}, resisting_torque: 1 N m}}}}", f"assembly: {{{hints}}}", ""]
    )  # fmt: skip


def main() -> None:
    """Print the figures of both mechanisms."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.studio", description=__doc__)
    parser.add_argument("--play", type=int, default=0, metavar="MINUTES", help="of play whose memory is measured")
    parser.add_argument("--links", type=int, default=0, metavar="DYADS", help="of a chain that is solved and drawn")
    parser.add_argument("--runs", type=int, default=0, metavar="COUNT", help="again of a model; memory is measured")
    minutes, dyads, runs = (asked := parser.parse_args()).play, asked.links, asked.runs
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        for name, joint in DRAGGED.items():
            begin = time.perf_counter()
            command = [sys.executable, "-m", "trunnion", "studio", f"examples/{name}.yaml", "--no-open", "--port", "0"]
            with subprocess.Popen(command, cwd=ROOT, env=COMPILED, stdout=subprocess.PIPE, text=True) as process:
                try:
                    assert process.stdout is not None
                    address = process.stdout.readline().split()[-1]
                    page = browser.new_page(viewport={"width": 1280, "height": 720})
                    _measure(page, name, joint, address, begin)
                    if minutes and name == next(iter(DRAGGED)):
                        _played(page, minutes, process.pid)
                    if runs and name == next(iter(DRAGGED)):
                        _run_again(page, runs, process.pid)
                    if dyads and name == next(iter(DRAGGED)):
                        page.click("role=tab[name=Properties]")
                        drawn, whole = page.evaluate(ANSWER, chain(dyads))
                        print(f"  {2 * dyads + 2} links: drawn with forces {drawn:.1f} s, ", end="")
                        page.keyboard.press("0")
                        page.wait_for_timeout(1500)
                        page.evaluate(LOOK, f"C{dyads - 1}")
                        page.wait_for_timeout(500)
                        rate = page.evaluate(DRAG, [f"C{dyads - 1}", SECONDS, NEAR])
                        again = page.evaluate(DRAG, [f"C{dyads - 1}", SECONDS, NEAR])  # while its text is solved
                        page.evaluate(IDLE)
                        frames = page.evaluate(PLAY, SECONDS)
                        print(f"figures {whole:.1f} s, {rate:.1f} drags/s, again at once {again:.1f}/s, ", end="")
                        print(f"play {frames:.0f} frames/s")
                    page.close()
                finally:
                    process.terminate()
        browser.close()


def _measure(page: Page, name: str, joint: str, address: str, begin: float) -> None:
    page.goto(address)
    page.wait_for_selector(f'.handle[data-name="{joint}"]')
    cold = time.perf_counter() - begin
    page.wait_for_selector(".motion .player")
    whole = time.perf_counter() - begin
    page.wait_for_timeout(1500)
    rate = page.evaluate(DRAG, [joint, SECONDS, 10])
    page.wait_for_timeout(1500)
    pulls = page.evaluate(SLIDE, [SLIDERS[name], SECONDS])
    page.wait_for_timeout(1000)
    frames, played = page.evaluate(SCRUB, SECONDS), page.evaluate(PLAY, SECONDS)
    page.click("role=tab[name=Plots]")
    page.wait_for_timeout(500)
    plots = page.evaluate(SCRUB, SECONDS)
    print(f"{name}: first picture {cold:.2f} s, solved {whole:.2f} s, {rate:.0f} drags solved and drawn/s, ", end="")
    print(f"slider {pulls:.0f}/s, scrubbing {frames:.0f} frames/s, with plots {plots:.0f}, ", end="")
    print(f"play {played:.0f}", flush=True)


def _played(page: Page, minutes: int, served: int) -> None:
    page.keyboard.press("Space")
    for minute in range(minutes + 1):
        _memory(page, served, f"{minute} min of play")
        if minute < minutes:
            page.wait_for_timeout(60_000)
    page.keyboard.press("Space")


def _run_again(page: Page, runs: int, served: int) -> None:
    """A model with another length each time, solved and drawn with its plots."""
    text = (ROOT / "examples" / f"{next(iter(DRAGGED))}.yaml").read_text("utf-8")
    for run in range(runs + 1):
        if run % max(runs // 5, 1) == 0:
            _memory(page, served, f"{run} runs")
        page.evaluate(ANSWER, text.replace("BC: 6.00 m", f"BC: {6 + 1e-4 * (run + 1):.4f} m"))


def _memory(page: Page, served: int, when: str) -> None:
    """Memory of the page after its rubbish is collected, its nodes and listeners, and memory of the server."""
    watched = page.context.new_cdp_session(page)
    watched.send("Performance.enable")
    watched.send("HeapProfiler.collectGarbage")
    told = {one["name"]: one["value"] for one in watched.send("Performance.getMetrics")["metrics"]}
    watched.detach()
    status = Path(f"/proc/{served}/status").read_text(encoding="ascii")
    resident = int(status.split("VmRSS:")[1].split()[0]) / 1024
    print(f"  {when}: page {told['JSHeapUsedSize'] / 2**20:.1f} MiB, {told['Nodes']:.0f} nodes, ", end="")
    print(f"{told['JSEventListeners']:.0f} listeners; server {resident:.0f} MiB", flush=True)


if __name__ == "__main__":
    main()
