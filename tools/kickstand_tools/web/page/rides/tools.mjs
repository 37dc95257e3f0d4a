// The page's side of worker.mjs.

export class Tools {
  #worker = null;
  #answer = null;
  #before = Promise.resolve(); // the calls are made one after the other
  #tell;

  /** tell(done, of, loading): the progress of what is worked on, or fetched for it; (1, 1, true) once all of it is. */
  constructor(tell) {
    this.#tell = tell;
  }

  /** False: there are no files, because nothing was opened, or the work was stopped or has failed. */
  get open() {
    return this.#worker !== null;
  }

  /** Fetch and start Python, if that is not done. */
  begin() {
    this.#worker ??= this.#start();
  }

  /** Take these File objects in place of all before; what was being worked on is given up. True if all that was made of
   * files before is gone. */
  give(files) {
    if (this.#answer) this.stop();
    const begins = !this.open;
    this.begin();
    this.#worker.postMessage({ files });
    return begins;
  }

  /** The result of a function of web/rides_guest.py: what it returns, with `made`, the bytes of the file it made.
   *
   * Throws an Error with the line of a refusal. */
  call(...call) {
    const said = this.#before.then(
      () =>
        new Promise((resolve, reject) => {
          this.#answer = { resolve, reject };
          this.#worker.postMessage({ call });
        }),
    );
    this.#before = said.catch(() => {});
    return said;
  }

  /** Give up what is being worked on, and the files: whoever waits for it waits for ever. */
  stop() {
    this.#worker?.terminate();
    this.#worker = null;
    this.#answer = null;
    this.#before = Promise.resolve();
  }

  #start() {
    const worker = new Worker(new URL("./worker.mjs", import.meta.url), { type: "module" });
    worker.onmessage = ({ data }) => {
      if (data.of !== undefined) return this.#tell(data.done, data.of, data.loading);
      if (data.ready) return this.#tell(1, 1, true);
      if (!this.#answer) return this.stop(); // what was fetched ahead is missing: the next call tries again, and says so
      const { resolve, reject } = this.#answer;
      this.#answer = null;
      if (data.failed || data.said.refused) reject(new Error(data.failed ?? data.said.refused));
      else resolve({ ...data.said, made: data.made });
      if (data.failed) this.stop(); // Python does not go on after an error of its own
    };
    worker.onerror = (event) => {
      this.#answer?.reject(new Error(event.message || "the page cannot start its worker"));
      this.stop();
    };
    return worker;
  }
}
