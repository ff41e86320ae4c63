// Studies: the verbs of the command line with their settings, run beside the page, their reports kept.

import { signal } from "@preact/signals";
import { useEffect, useState } from "preact/hooks";
import { request } from "./socket.js";
import * as state from "./state.js";
import { Button, html } from "./ui.js";

/** What a study is called; others by their verb. */
const TITLES = {
  assemble: "Assembly", sweep: "Sweep of a number", tolerance: "Tolerances", allocate: "Tolerances to buy", simulate: "Motion in time",
  compare: "Compare with measured data", identify: "Identify from measured data",
}; // prettier-ignore
const titleOf = (name) => TITLES[name] ?? `${name[0].toUpperCase()}${name.slice(1)}`;
/** Help of an option without what is for the command line alone. */
const plainHelp = (help) => help.replace(/\s*\([^()]*--[^()]*\)/g, "").replace(/[;,] [^;,.]*exit status[^;,.]*/g, "");
const OFTEN = 400; // ms between two looks at what runs
/** What the chips of the bar below ask, by the study that answers it. */
export const STUDY_OF = { play: "play", tolerance: "tolerance", time: "simulate" };

/** {forms, jobs}: the studies there are, and those that were started. */
const known = signal({ forms: [], jobs: [] });
/** The study whose form is open. */
const verb = signal("tolerance");
/** The text that each study was started with, and whether it was saved. */
const begun = new Map();
/** Settings by study: {flag: text or true}. */
const settings = signal({});

export function openStudy(name) {
  if (name) verb.value = name;
  state.dialog.value = "studies";
}

async function look() {
  const reply = await request("/jobs");
  if (reply.ok) known.value = await reply.json();
}

/** The options as the command line takes them: several values of an option stand one a line. */
function optionsOf(form) {
  const own = settings.value[form.verb] ?? {};
  const entries = Object.entries(own).filter(([, value]) => value !== "" && value !== false);
  return Object.fromEntries(entries.map(([flag, value]) => [flag, typeof value === "string" && form.fields.find((one) => one.flag === flag)?.several ? value.split("\n") : value]));
}

async function run(form, mapping) {
  const name = state.fileName.value ?? "model.yaml";
  const body = JSON.stringify({ text: state.text.value, name, verb: form.verb, options: optionsOf(form), mapping });
  const reply = await request("/jobs", { method: "PUT", body });
  const told = await reply.json().catch(() => ({ error: "The study could not be started." }));
  if (told.id) begun.set(told.id, { text: state.text.value, saved: !state.unsaved.value });
  if (told.error) state.say(told.error, true);
  await look();
  return told.error ?? "";
}

export function Studies() {
  const [mapping, setMapping] = useState("");
  const [refusal, setRefusal] = useState("");
  const [shown, setShown] = useState(null);
  useEffect(() => {
    look();
    const timer = setInterval(() => known.value.jobs.some(({ running }) => running) && look(), OFTEN);
    return () => clearInterval(timer);
  }, []);
  const form = known.value.forms.find((one) => one.verb === verb.value) ?? known.value.forms[0];
  if (!form) return html`<h2>Studies</h2><p class="calm">Start the studio by \`trunnion studio\` to have studies in it.</p>`;
  if (shown) return html`<${Report} job=${shown} back=${() => setShown(null)} />`;
  const start = async (event) => {
    event.preventDefault();
    setRefusal(await run(form, mapping));
  };
  return html`<h2>Studies</h2>
    <div class="studies">
      <form onSubmit=${start}>
        <label class="choice">Study <select aria-label="Study" value=${form.verb} onChange=${(event) => (verb.value = event.target.value)}>
          ${known.value.forms.map((one) => html`<option value=${one.verb}>${titleOf(one.verb)}</option>`)}</select></label>
        <p class="calm">${form.help}</p>
        ${form.mapping && html`<label class="field"><span>mapping</span><select aria-label="mapping" value=${mapping} onChange=${(event) => setMapping(event.target.value)}>
          <option value="">the file that describes the measured data</option>${state.folder.value.names.map((name) => html`<option>${name}</option>`)}</select></label>`}
        <div class="options">${form.fields.map((field) => html`<${Field} key=${form.verb + field.flag} study=${form.verb} field=${field} />`)}</div>
        <p class="wrong" role="alert">${refusal}</p>
        <p class="row-of-buttons"><button type="submit" class="plain strong" disabled=${!state.text.value.trim()}>Run</button></p>
      </form>
      <section aria-label="Started studies"><h3>Results</h3>
        ${known.value.jobs.length === 0 && html`<p class="calm">What you run is kept here until the studio ends.</p>`}
        ${known.value.jobs.map((job) => html`<${Job} key=${job.id} job=${job} latest=${job === known.value.jobs[0]} open=${() => setShown(job)} />`)}
      </section>
    </div>`; // prettier-ignore
}

function Field({ study, field: { flag, help, kind, choices, several, usual } }) {
  const own = settings.value[study]?.[flag] ?? "";
  const put = (value) => (settings.value = { ...settings.value, [study]: { ...settings.value[study], [flag]: value } });
  const name = flag.slice(2).replaceAll("-", " ");
  const control = () => {
    if (kind === "flag") return html`<input type="checkbox" aria-label=${name} checked=${own === true} onChange=${(event) => put(event.target.checked)} />`;
    if (choices) return html`<select aria-label=${name} value=${own} onChange=${(event) => put(event.target.value)}><option value="">${usual || "as usual"}</option>${choices.map((one) => html`<option>${one}</option>`)}</select>`;
    if (several) return html`<textarea aria-label=${name} rows=${Math.max(own.split("\n").length, 1)} placeholder="one a line" value=${own} onInput=${(event) => put(event.target.value)}></textarea>`;
    return html`<input aria-label=${name} value=${own} placeholder=${usual} inputmode=${kind === "number" ? "decimal" : "text"} onInput=${(event) => put(event.target.value)} />`;
  };
  return html`<label class="field" title=${plainHelp(help)}><span>${name}</span>${control()}<small class="calm">${plainHelp(help)}</small></label>`;
}

function Job({ job, latest, open }) {
  const { id, verb, command, seconds, progress, running, stopped, status, output, report } = job;
  const [done, total] = progress ?? [null, null];
  const words = running ? "runs" : stopped ? "stopped" : status === 0 ? "done" : status === 1 ? "done, with findings" : "failed";
  const { text, saved } = begun.get(id) ?? { text: null, saved: true };
  const doubts = [saved ? "" : "with changes that were not saved: the command reads the file", text !== null && text !== state.text.value ? "the model was changed since" : ""].filter(Boolean).join("; ");
  const copy = () => navigator.clipboard?.writeText(command).then(() => state.say("The command is on the clipboard."));
  const stop = () => request(`/jobs/${id}`, { method: "DELETE" }).then(look);
  return html`<article class="job">
    <p><b>${titleOf(verb)}</b>${doubts && html` <em class="calm">(${doubts})</em>`}</p>
    <p class="row-of-buttons"><span role="status">${words}, ${seconds} s${running && done !== null ? `, ${done}${total ? ` of ${total}` : ""}` : ""}</span>
      ${running && html`<progress aria-label="Progress" value=${total ? done : undefined} max=${total ?? undefined}></progress><${Button} label="Stop" onClick=${stop} />`}
      ${report && html`<${Button} label="Open the report" onClick=${open} /><a class="plain" href=${report} download=${`${verb}.html`}>Save the report</a>`}
      <${Button} label="Copy as command" onClick=${copy} /></p>
    <details><summary>Command</summary><code>${command}</code></details>
    ${output.trim() && html`<details open=${latest || (!report && !running)}><summary>Output</summary><pre>${output}</pre></details>`}
  </article>`; // prettier-ignore
}

function Report({ job, back }) {
  return html`<p class="row-of-buttons"><${Button} label="Back to the studies" onClick=${back} /> <b>${titleOf(job.verb)}</b></p>
    <iframe class="report" title=${`Report of ${job.command}`} sandbox="allow-scripts allow-downloads" src=${job.report}></iframe>`;
}
