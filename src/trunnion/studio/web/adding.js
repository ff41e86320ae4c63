// A new dimension: its name and its value, as the file writes them.

import { setValue } from "./actions.js";
import { usualUnit, written } from "./fields.js";
import { dictionary } from "./geometry.js";
import * as state from "./state.js";
import { focusOn, html } from "./ui.js";

const NAME = /^[^\W\d]\w*$/u;

/** Fields for a dimension that there is not yet; a definition typed for a number elsewhere makes one too. */
export function AddDimension() {
  const add = async (event) => {
    event.preventDefault();
    const form = event.currentTarget;
    const [name, value] = ["name", "value"].map((key) => form.elements[key].value.trim());
    const { entries } = state.answer.value ?? {};
    const why = refused(name, value, dictionary(entries?.dimensions));
    if (why) return state.say(why, true);
    if (await setValue(["dimensions", name], written(value, usualUnit(entries)))) {
      form.reset();
      focusOn(".new-dimension input");
    }
  };
  return html`<form class="new-dimension" aria-label="New dimension" onSubmit=${add}>
    <input name="name" aria-label="Name of the new dimension" placeholder="name" spellcheck=${false} />
    <input name="value" aria-label="Value of the new dimension" placeholder="e.g. 30 mm" spellcheck=${false} />
    <button type="submit" class="plain" title="Then type its name where a number stands; crank = 30 mm typed there makes one, too">Add dimension</button>
  </form>`; // prettier-ignore
}

function refused(name, value, known) {
  if (!NAME.test(name)) return `“${name}” is no name: letters, digits and _, a letter first.`;
  if (name in known) return `There is a dimension ${name} already.`;
  return value ? "" : `What is ${name}? Write its value, such as 30 mm.`;
}
