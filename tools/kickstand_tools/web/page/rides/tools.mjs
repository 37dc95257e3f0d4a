// The page's side of worker.mjs.

export class Tools {
  #worker = null;
  #answer = null;
  #before = Promise.resolve(); // calls run one after the other
  #tell;

  /** tell(done, of, loading): the progress of a call, or with loading of the files fetched for it; (1, 1, true) when
   * all are fetched. */
  constructor(tell) {
    this.#tell = tell;
  }

  /** False if the worker has no files: none was opened, or the work was stopped or has failed. */
  get open() {
    return this.#worker !== null;
  }

  /** Fetch and start Python, unless done. */
  begin() {
    this.#worker ??= this.#start();
  }

  /** Use these File objects instead of all earlier ones. Work in progress is abandoned. True if all results of earlier
   * files are gone. */
  give(files) {
    if (this.#answer) this.stop();
    const begins = !this.open;
    this.begin();
    this.#worker.postMessage({ files });
    return begins;
  }

  /** The result of a function of web/rides_guest.py, with `made`: the bytes of the file that it made.
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

  /** Abandon work in progress, and the files. A caller that waits for a result waits for ever. */
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
      if (!this.#answer) return this.stop(); // fetching in advance failed: the next call tries again, and reports it
      const { resolve, reject } = this.#answer;
      this.#answer = null;
      if (data.failed || data.said.refused) reject(new Error(data.failed ?? data.said.refused));
      else resolve({ ...data.said, made: data.made });
      if (data.failed) this.stop(); // Python cannot continue after an internal error
    };
    worker.onerror = (event) => {
      this.#answer?.reject(new Error(event.message || "the page cannot start its worker"));
      this.stop();
    };
    return worker;
  }
}
