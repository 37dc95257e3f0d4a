// Shared by the pages that connect to a board: the browser's serial port, and the command-line tools on CPython for
// WebAssembly. CPython is fetched when it is first needed.

import { keptOffline } from "../offline.mjs";

const BAUD = 115200;
const BUFFER = 65_536; // number of bytes that may arrive while the page is busy
const BACK_MS = 10_000; // longest wait for a restarting board
const AGAIN_MS = 300;
export const ASKING = "Asking the board, which takes up to 15 seconds …"; // time limit for a silent board

/** Show the share of the work that is done. NaN if unknown, null to hide the bar. */
export function showShare(bar, share) {
  bar.hidden = share === null;
  if (share >= 0) bar.value = share;
  else bar.removeAttribute("value");
}

/** Passes the bytes of a serial port to web/browser_board.py. lost: true if nothing more can arrive. */
export class SerialLine {
  lost = false;
  #port;
  #received = [];
  #reader;

  constructor(port) {
    this.#port = port;
  }

  /** restarted: true if the board may be starting; its port is absent until it has started. */
  async open(restarted = false) {
    const until = performance.now() + (restarted ? BACK_MS : 0);
    for (;;) {
      try {
        await this.#port.open({ baudRate: BAUD, bufferSize: BUFFER });
        break;
      } catch (error) {
        if (performance.now() > until) throw error;
        await this.sleep(AGAIN_MS);
      }
    }
    // Terminal programs set these signals too. A Pico sends nothing to a host that does not set them.
    try {
      await this.#port.setSignals?.({ dataTerminalReady: true, requestToSend: true });
    } catch (error) {
      await this.close(); // if it stayed open, it could not be opened again
      throw error;
    }
    this.#read();
  }

  async #read() {
    let ended;
    // After a disturbed byte or a break, the port continues with a new stream
    while (!this.lost && this.#port.readable && this.#port.readable !== ended) {
      ended = this.#port.readable;
      try {
        this.#reader = ended.getReader();
        for (;;) {
          const { value, done } = await this.#reader.read();
          if (done) {
            this.lost = true; // this page closed the port
            break;
          }
          this.#received.push(value);
        }
      } catch {
        // a disturbance, or the cable was pulled, or the board has restarted
      }
    }
    this.lost = true;
  }

  /** Return all bytes received since the last call as a Uint8Array. */
  take() {
    const all = new Uint8Array(this.#received.reduce((length, chunk) => length + chunk.length, 0));
    let at = 0;
    for (const chunk of this.#received.splice(0)) {
      all.set(chunk, at);
      at += chunk.length;
    }
    return all;
  }

  /** Send bytes. data: a bytes object of Python. Returns false if they could not be sent. */
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
    this.lost = true; // otherwise #read would continue with the port's next stream
    // Each of these calls fails if the cable is unplugged. All are tried, because a port that stays open cannot be
    // opened again.
    await this.#reader?.cancel().catch(() => {});
    this.#reader?.releaseLock();
    await this.#port.close().catch(() => {});
  }
}

/** Start a new Python with the tools. withNumpy: true to load numpy, which is needed to write rides. */
export async function python(withNumpy = false) {
  await keptOffline(); // the files that are fetched now must be kept too
  const { PACKAGES, loadPython } = await import("../python.mjs");
  const made = await loadPython(["install.zip", ...(withNumpy ? ["numpy/numpy.zip"] : [])]);
  made.runPython(`import sys; sys.path[:0] = ["${PACKAGES}/tools", "${PACKAGES}/firmware"]`);
  return made;
}

/** Return a function that calls load() once and returns its result. If load() fails, the function calls tell(text) with
 * the reason and returns null. Its next call tries again. */
export function loadOnce(load) {
  let loaded;
  return async (tell) => {
    try {
      return await (loaded ??= load());
    } catch (error) {
      loaded = undefined;
      tell(`The tools cannot be loaded. Is there a network? Press the button again to retry. (${error.message})`);
      return null;
    }
  };
}

/** Ask the rider to choose a port. Returns the port. If none is chosen, calls tell(text) with the reason and returns
 * null. */
export async function choosePort(tell) {
  try {
    return await navigator.serial.requestPort();
  } catch {
    tell("No port was chosen. Is the board on a cable that carries data? On Windows it may need a driver: that of its chip CP2102 or CH340.");
    return null;
  }
}

/**
 * Open a SerialLine and return the result of use(line, name). The name of the port is for messages. After an error,
 * call tell(text) with the error and return null.
 */
export async function overCable(port, tell, use, restarted = false) {
  const line = new SerialLine(port);
  try {
    await line.open(restarted);
  } catch (error) {
    const why = error.message.replace(/\.+$/, "");
    tell(`The port cannot be opened: ${why}. Does another program have it? On Linux: are you in the group dialout?`);
    return null;
  }
  try {
    return await use(line, "this port");
  } catch (error) {
    console.error(error);
    tell(`This went wrong: ${error.message.trim().split("\n").at(-1)}. Load the page again.`);
    return null;
  } finally {
    await line.close();
  }
}
