// Puts the firmware onto a board at the browser's serial port: `kickstand flash` itself, on CPython for WebAssembly, which
// is fetched for this only.

const BAUD = 115200;
const ROOT = "/kickstand";
const byId = (id) => document.getElementById(id);

/** The bytes of a serial port, for install_guest.py. lost: nothing more can come. */
class SerialLine {
  lost = false;
  #port;
  #heard = [];
  #reader;

  constructor(port) {
    this.#port = port;
  }

  async open() {
    await this.#port.open({ baudRate: BAUD });
    // As a terminal program does: a Pico says nothing to a host without it
    await this.#port.setSignals?.({ dataTerminalReady: true, requestToSend: true });
    this.#read();
  }

  async #read() {
    try {
      this.#reader = this.#port.readable.getReader();
      for (;;) {
        const { value, done } = await this.#reader.read();
        if (done) break;
        this.#heard.push(value);
      }
    } catch {
      // the cable was pulled, or the board has restarted
    }
    this.lost = true;
  }

  /** All that has come since the last call, a Uint8Array. */
  take() {
    const all = new Uint8Array(this.#heard.reduce((length, piece) => length + piece.length, 0));
    let at = 0;
    for (const piece of this.#heard.splice(0)) {
      all.set(piece, at);
      at += piece.length;
    }
    return all;
  }

  /** data: bytes of Python. False: they could not be sent. */
  async send(data) {
    const bytes = data.toJs();
    const writer = this.#port.writable?.getWriter();
    try {
      await writer.write(bytes);
      return true;
    } catch {
      this.lost = true;
      return false;
    } finally {
      writer?.releaseLock();
    }
  }

  sleep(ms) {
    return new Promise((done) => setTimeout(done, ms));
  }

  async close() {
    try {
      await this.#reader?.cancel();
      this.#reader?.releaseLock();
      await this.#port.close();
    } catch {
      // it is gone already
    }
  }
}

/** A new Python with the tools in it: one that has posed as a board cannot pose as another. */
async function python() {
  const { loadPyodide } = await import("./pyodide/pyodide.mjs");
  const archive = fetch("./install.zip").then((answer) => answer.arrayBuffer());
  const made = await loadPyodide();
  made.unpackArchive(await archive, "zip", { extractDir: ROOT });
  made.runPython(`import sys; sys.path.insert(0, "${ROOT}/tools")`);
  return made;
}

/** True if this browser has a serial port, and lets Python wait for it. */
function able() {
  return "serial" in navigator && "Suspending" in WebAssembly;
}

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

export function connectInstall() {
  byId("install-form").hidden = !able();
  byId("install-unable").hidden = able();
  byId("install").addEventListener("click", install);
}
