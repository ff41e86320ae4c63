// Light, dark, or as the system is: the report's colours for dark screens are switched by the rule that holds them.

import { effect, signal } from "@preact/signals";

const CHOICES = ["system", "light", "dark"];
const KEY = "trunnion studio colours";
const WHEN = { system: "screen and (prefers-color-scheme: dark)", light: "not all", dark: "screen" };

export const theme = signal(stored());

function stored() {
  try {
    const found = localStorage.getItem(KEY);
    return CHOICES.includes(found) ? found : "system";
  } catch {
    return "system"; // storage is off
  }
}

export function nextTheme() {
  theme.value = CHOICES[(CHOICES.indexOf(theme.value) + 1) % CHOICES.length];
  try {
    localStorage.setItem(KEY, theme.value);
  } catch {
    // storage is off: the choice lives as long as the page
  }
}

/** Keep the page in the chosen colours. */
export function keepTheme() {
  const rules = [...document.styleSheets].flatMap((sheet) => [...sheet.cssRules]);
  const dark = rules.flatMap((rule) => (rule instanceof CSSMediaRule && rule.conditionText.includes("prefers-color-scheme") ? [rule] : []));
  effect(() => dark.forEach((rule) => (rule.media.mediaText = WHEN[theme.value])));
}
