// What the pages that speak to a board share: the browser's serial port, and the tools of the command line on CPython for
// WebAssembly, which is fetched for this only.

const BAUD = 115200;
const ROOT = "/kickstand";

/** The bytes of a serial port, for web/serial_port.py. lost: nothing more can come. */
export class SerialLine {
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
export async function python() {
  const { loadPyodide } = await import("../pyodide/pyodide.mjs");
  const archive = fetch("./install.zip").then((answer) => answer.arrayBuffer());
  const made = await loadPyodide();
  made.unpackArchive(await archive, "zip", { extractDir: ROOT });
  made.runPython(`import sys; sys.path.insert(0, "${ROOT}/tools")`);
  return made;
}

/** True if this browser has a serial port, and lets Python wait for it. */
export function able() {
  return "serial" in navigator && "Suspending" in WebAssembly;
}
