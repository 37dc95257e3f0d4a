// The page's side of worker.mjs: orders go there, what is to be seen comes back.

const SHORTEST_PRESS_MS = 120; // a finger's; the click of a program is shorter than contacts bounce

export class Board {
  #worker = new Worker(new URL("./worker.mjs", import.meta.url), { type: "module" });
  #pressedMs = 0;
  #down = false;

  /** handlers: an object with the functions ready(), tick(tick), pressed(down), rate(rate), failed(text). */
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

  /** name, value: as Device.act() in web/device.py takes them. */
  order(name, value) {
    this.#worker.postMessage({ order: [name, value] });
  }

  /** Orders at times of the board, [[s, name, value], ...], which it reaches as fast as it can. */
  ahead(orders) {
    this.#worker.postMessage({ ahead: orders });
  }

  /** The board is gone. */
  end() {
    this.#worker.terminate();
  }

  /** Press the button (true) or let it go. */
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
