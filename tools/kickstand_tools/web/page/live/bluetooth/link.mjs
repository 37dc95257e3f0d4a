// The connection to a board over Web Bluetooth. A lost connection is restored automatically.

import { BOARD, NOW, PERIOD_MS, RATE, RIDE, SERVICE, VERSION } from "./packets.mjs";

const AGAIN_MS = 1000;
const QUIET_MS = 5000; // a connection without data for this time is treated as lost

/** Ask the rider to choose a board, and return it. If none is chosen, call tell(reason) and return null. */
export async function chooseBoard(tell) {
  try {
    return await navigator.bluetooth.requestDevice({ filters: [{ services: [SERVICE] }] });
  } catch (error) {
    tell(`No board was chosen. Is LIVE = True in its config.py, Bluetooth on, and no other phone connected? (${error.message})`);
    return null;
  }
}

/** A connection that receives packets. device: from chooseBoard(). on: object of the callbacks now(view) and ride(view)
 * for packets, state(text), and back() after a restored connection. */
export class Link {
  #device;
  #on;
  #ended = false;
  #lost = () => {};

  constructor(device, on) {
    this.#device = device;
    this.#on = on;
    device.addEventListener("gattserverdisconnected", () => this.#lost());
  }

  /** Run until stop(). Returns null, or one sentence with the reason for the end. */
  async run() {
    for (let count = 0; !this.#ended; count += 1) {
      try {
        this.#on.state(count ? "The connection is lost. Trying again …" : "Connecting …");
        const lost = new Promise((done) => (this.#lost = done));
        const refused = await this.#open();
        if (refused) return refused;
        this.#on.back();
        await this.#listen(lost);
      } catch (error) {
        if (error.name === "SecurityError") return `The browser does not allow it: ${error.message}`;
      }
      this.#device.gatt.disconnect();
      if (!this.#ended) await new Promise((done) => setTimeout(done, AGAIN_MS));
    }
    return null;
  }

  stop() {
    this.#ended = true;
    this.#lost();
  }

  async #open() {
    const service = await (await this.#device.gatt.connect()).getPrimaryService(SERVICE);
    const version = (await (await service.getCharacteristic(BOARD)).readValue()).getUint8(0);
    if (version !== VERSION) return `The board sends version ${version}, this page reads ${VERSION}: load the page again, and update the board`;
    await this.#hear(service, NOW, this.#on.now);
    await this.#hear(service, RIDE, this.#on.ride);
    const rate = await service.getCharacteristic(RATE);
    await rate.writeValueWithResponse(Uint8Array.of(PERIOD_MS, 0));
    return null;
  }

  async #hear(service, kind, take) {
    const characteristic = await service.getCharacteristic(kind);
    characteristic.addEventListener("characteristicvaluechanged", ({ target }) => {
      this.#heardMs = performance.now();
      take(target.value);
    });
    await characteristic.startNotifications();
  }

  #heardMs = 0;

  /** Listen until the connection is lost or silent. */
  async #listen(lost) {
    this.#heardMs = performance.now();
    for (let over = false; !over && !this.#ended && performance.now() - this.#heardMs < QUIET_MS; ) {
      over = await Promise.race([lost.then(() => true), new Promise((done) => setTimeout(done, 500, false))]);
    }
  }
}
