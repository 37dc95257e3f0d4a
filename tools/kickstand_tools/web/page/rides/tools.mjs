// The page's side of worker.mjs.

export class Tools {
  #worker;
  #answer;
  #tell;

  /** tell(done, of): the progress of what is worked on. */
  constructor(tell) {
    this.#tell = tell;
  }

  /** Take these File objects in place of all before; what was being worked on is given up. */
  open(files) {
    if (this.#answer) this.stop();
    this.#worker ??= this.#start();
    this.#worker.postMessage({ files });
  }

  /** The result of a function of web/rides_guest.py: what it returns, with `made`, the bytes of the file it made.
   *
   * Throws an Error with the line of a refusal. One call at a time. */
  call(...call) {
    return new Promise((resolve, reject) => {
      this.#answer = { resolve, reject };
      this.#worker.postMessage({ call });
    });
  }

  /** Give up what is being worked on. */
  stop() {
    this.#worker?.terminate();
    this.#worker = null;
    this.#answer = null;
  }

  #start() {
    const worker = new Worker(new URL("./worker.mjs", import.meta.url), { type: "module" });
    worker.onmessage = ({ data }) => {
      if (data.of !== undefined) return this.#tell(data.done, data.of);
      const { resolve, reject } = this.#answer;
      this.#answer = null;
      if (data.failed || data.said.refused) reject(new Error(data.failed ?? data.said.refused));
      else resolve(Array.isArray(data.said) ? data.said : { ...data.said, made: data.made });
      if (data.failed) this.stop(); // Python does not go on after an error of its own
    };
    worker.onerror = (event) => {
      this.#answer?.reject(new Error(event.message || "the page cannot start its worker"));
      this.stop();
    };
    return worker;
  }
}
