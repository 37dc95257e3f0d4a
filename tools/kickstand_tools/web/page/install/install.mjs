// Puts the firmware onto a board at the browser's serial port: `kickstand flash` itself, on CPython for WebAssembly, which
// is fetched for this only.

import { SerialLine, able, python } from "../cable/cable.mjs";
import { keepOffline } from "../offline.mjs";

const byId = (id) => document.getElementById(id);

function tell(text, share = null) {
  byId("install-said").textContent = text;
  byId("install-bar").hidden = share === null;
  byId("install-bar").value = share ?? 0;
}

async function install() {
  let port;
  try {
    port = await navigator.serial.requestPort();
  } catch {
    tell("No port was chosen. Is the board on a cable that carries data?");
    return;
  }
  byId("install").disabled = true;
  const line = new SerialLine(port);
  try {
    tell("Loading the tools …", 0);
    const tools = await python();
    await line.open();
    tell("Asking the board …", 0);
    // A line that is not USB, as a bridge to an emulated board is, is given time as `kickstand flash` gives it
    const name = port.getInfo?.().usbVendorId ? "the board" : "socket:the board";
    const said = tools
      .pyimport("kickstand_tools.web.install_guest")
      .install.callPromising(line, name, byId("side").value, (what, done, total) => tell(what, done / total));
    told(JSON.parse(await said));
  } catch (error) {
    console.error(error);
    tell(`The port cannot be used: ${error.message.trim().split("\n").at(-1)}. Does another program have it?`);
  } finally {
    await line.close();
    byId("install").disabled = false;
  }
}

function told({ refused, board, copied, kept, config_kept }) {
  if (refused) {
    tell(`Not installed: ${refused.replaceAll("socket:", "")}.`);
    return;
  }
  const files = copied ? `${copied} files copied and verified, ${kept} as they were` : "it was up to date";
  const config = config_kept ? " Its own config.py stays." : "";
  tell(`Done: ${board}. ${files}.${config} The board starts now: press its button on the stand, then upright.`);
}

byId("install-form").hidden = !able();
byId("install-unable").hidden = able();
byId("install").addEventListener("click", install);
keepOffline();
