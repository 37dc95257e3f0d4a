// Puts the firmware onto a board at the browser's serial port: `kickstand flash` itself, on CPython for WebAssembly.

import { choosePort, inPages, overCable, python, showIfAble } from "../cable/cable.mjs";
import { keepOffline } from "../offline.mjs";

const byId = (id) => document.getElementById(id);

function tell(text, share = null) {
  byId("install-said").textContent = text;
  byId("install-bar").hidden = share === null;
  byId("install-bar").value = share ?? 0;
}

async function install() {
  const port = await choosePort(tell);
  if (!port) return;
  byId("install").disabled = true;
  tell("Loading the tools …", 0);
  const tools = await python(); // a new one: one that has posed as a board cannot pose as another
  const said = await overCable(port, tell, (line, name) => {
    tell("Asking the board …", 0);
    return tools
      .pyimport("kickstand_tools.web.install_guest")
      .install.callPromising(line, name, byId("side").value, (what, done, total) => tell(what, done / total));
  });
  if (said) told(JSON.parse(said));
  byId("install").disabled = false;
}

function told({ refused, board, copied, kept, config_kept }) {
  if (refused) {
    tell(`Not installed: ${inPages(refused)}.`);
    return;
  }
  const files = copied ? `${copied} files copied and verified, ${kept} as they were` : "it was up to date";
  const config = config_kept ? " Its own config.py stays." : "";
  tell(`Done: ${board}. ${files}.${config} The board starts now: press its button on the stand, then upright.`);
}

showIfAble(byId("install-form"), byId("install-unable"));
byId("install").addEventListener("click", install);
keepOffline();
