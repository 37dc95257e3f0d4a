// What the pages that connect to a board share: the browser's serial port, and the tools of the command line on CPython for
// WebAssembly, which is fetched for this only.

import { keptOffline } from "../offline.mjs";

const BAUD = 115200;
const BUFFER = 65_536; // bytes that may come while the page is busy
const BACK_MS = 10_000; // until a board that has restarted is there again, at most
const AGAIN_MS = 300;
export const ASKING = "Asking the board, which takes up to 15 seconds …"; // until one that is silent is given up

/** share: of the work that is done; NaN while nobody knows, null to hide it. */
export function showShare(bar, share) {
  bar.hidden = share === null;
  if (share >= 0) bar.value = share;
  else bar.removeAttribute("value");
}

/** The bytes of a serial port, for web/serial_guest.py. lost: nothing more can come. */
export class SerialLine {
  lost = false;
  #port;
  #received = [];
  #reader;

  constructor(port) {
    this.#port = port;
  }

  /** restarted: the board may just be starting, and its port is away until then. */
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
    // As a terminal program does: a Pico says nothing to a host without it
    try {
      await this.#port.setSignals?.({ dataTerminalReady: true, requestToSend: true });
    } catch (error) {
      await this.close(); // it could not be opened again
      throw error;
    }
    this.#read();
  }

  async #read() {
    let ended;
    // After a disturbed byte or a break the port has another stream, which goes on
    while (!this.lost && this.#port.readable && this.#port.readable !== ended) {
      ended = this.#port.readable;
      try {
        this.#reader = ended.getReader();
        for (;;) {
          const { value, done } = await this.#reader.read();
          if (done) {
            this.lost = true; // closed from here
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

  /** All that has come since the last call, a Uint8Array. */
  take() {
    const all = new Uint8Array(this.#received.reduce((length, chunk) => length + chunk.length, 0));
    let at = 0;
    for (const chunk of this.#received.splice(0)) {
      all.set(chunk, at);
      at += chunk.length;
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
    this.lost = true; // or what reads would go on with the port's next stream
    // Each of these fails where the cable is out. A port that is not closed could not be opened again.
    await this.#reader?.cancel().catch(() => {});
    this.#reader?.releaseLock();
    await this.#port.close().catch(() => {});
  }
}

/** A new Python with the tools in it. withNumpy: those that write rides need it. */
export async function python(withNumpy = false) {
  await keptOffline(); // so that what is fetched now is kept too
  const { PACKAGES, loadPython } = await import("../python.mjs");
  const made = await loadPython(["install.zip", ...(withNumpy ? ["numpy/numpy.zip"] : [])]);
  made.runPython(`import sys; sys.path[:0] = ["${PACKAGES}/tools", "${PACKAGES}/firmware"]`);
  return made;
}

/** A function that does load() once and returns what came of it. Where that fails it returns null, tell(text) is given
 * why, and the next call tries again. */
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

/** The port that the rider chooses, or null; tell(text) says why there is none. */
export async function choosePort(tell) {
  try {
    return await navigator.serial.requestPort();
  } catch {
    tell("No port was chosen. Is the board on a cable that carries data? On Windows it may need a driver: that of its chip CP2102 or CH340.");
    return null;
  }
}

/**
 * What use(line, name) returns, with a SerialLine open meanwhile, and the port's name for messages. tell(text) is given
 * what goes wrong, and null is returned then.
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
