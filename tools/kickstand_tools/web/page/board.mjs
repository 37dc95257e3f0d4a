// The page's side of worker.mjs: sends orders to the worker, and receives what the board shows.

// Shortest press: as long as a finger's press. A program's click is shorter than the bouncing of a contact.
const SHORTEST_PRESS_MS = 120;

export class Board {
  #worker = new Worker(new URL("./worker.mjs", import.meta.url), { type: "module" });
  #pressedMs = 0;
  #down = false;

  /** handlers: an object with the functions ready(), tick(tick), pressed(down), rate(rate) and failed(text). */
  constructor(handlers) {
    this.#worker.onmessage = ({ data }) => {
      if (data.ready) handlers.ready();
      if (data.failed) handlers.failed(data.failed);
      data.ticks?.forEach(handlers.tick);
      if (data.rate !== undefined) handlers.rate(data.rate);
    };
    this.#worker.onerror = (event) => handlers.failed(event.message || "a file of this page cannot be loaded");
    this.#worker.addEventListener("message", ({ data }) => {
      for (const [, name, value] of data.orders ?? []) if (name === "button") handlers.pressed(value);
    });
    document.addEventListener("visibilitychange", () => this.#worker.postMessage({ awake: !document.hidden }));
  }

  /** Send an order. name, value: the arguments of PageDevice.act() in web/device.py. */
  order(name, value) {
    this.#worker.postMessage({ order: [name, value] });
  }

  /** Send orders that the board carries out at certain times, as fast as it can. orders: [[s, name, value], ...] with
   * the board's time in seconds. */
  ahead(orders) {
    this.#worker.postMessage({ ahead: orders });
  }

  /** Stop the board after its worker has failed. */
  end() {
    this.#worker.terminate();
  }

  /** Press the button (true) or release it (false). */
  button(down) {
    if (down === this.#down) return;
    this.#down = down;
    if (down) {
      this.#pressedMs = performance.now();
      this.order("button", true);
      return;
    }
    const leftMs = SHORTEST_PRESS_MS - (performance.now() - this.#pressedMs);
    if (leftMs > 0) setTimeout(() => this.#down || this.order("button", false), leftMs);
    else this.order("button", false);
  }
}
