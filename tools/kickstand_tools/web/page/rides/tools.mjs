// The page's side of worker.mjs.

export class Tools {
  #worker = null;
  #answer = null;
  #before = Promise.resolve(); // calls run one after the other
  #tell;

  /** tell(done, of, loading) is called with the progress. loading: true for the progress of fetching the tools. After
   * the last tool, tell(1, 1, true) is called. */
  constructor(tell) {
    this.#tell = tell;
  }

  /** False if the worker has no files, because none was opened, or because the work was stopped or has failed. */
  get open() {
    return this.#worker !== null;
  }

  /** Fetch and start Python, if this is not yet done. */
  begin() {
    this.#worker ??= this.#start();
  }

  /** Replace the files by these File objects, and abandon work in progress. Returns true if the results of all earlier
   * files are lost. */
  give(files) {
    if (this.#answer) this.stop();
    const begins = !this.open;
    this.begin();
    this.#worker.postMessage({ files });
    return begins;
  }

  /** Call a function of web/browser_rides.py. Returns its result. If it made a file, `made` in the result has the bytes.
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

  /** Abandon work in progress, and the files. A caller that waits for a result never gets one. */
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
      if (!this.#answer) return this.stop(); // fetching in advance has failed; the next call tries again
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
