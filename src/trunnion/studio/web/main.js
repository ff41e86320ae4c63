// The start of the page.

import { render } from "preact";
import { start } from "./actions.js";
import { App, keepAwaited } from "./app.js";
import { keepBlocks } from "./blocks.js";
import { keepCurves } from "./plots.js";
import { listenToFailures } from "./boundary.js";
import { listenToDrops } from "./dialogs.js";
import { keepOthers } from "./ghosts.js";
import { listenToKeys } from "./keys.js";
import { keepLayers } from "./layers.js";
import { enter } from "./socket.js";
import { keepTheme } from "./theme.js";
import { html } from "./ui.js";
import { keepCompared } from "./variants.js";

listenToFailures();
enter();
keepTheme();
render(html`<${App} />`, document.getElementById("studio"));
listenToKeys(document);
listenToDrops(document);
start();
keepAwaited();
keepOthers();
keepLayers();
keepBlocks();
keepCurves();
keepCompared();
