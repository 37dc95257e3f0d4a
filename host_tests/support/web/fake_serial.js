window.boardAnswersAtOnce = false;
// A fake board starts again at once, so the page need not wait 2 s for it.
const later = setTimeout;
window.setTimeout = (done, ms, ...rest) => later(done, boardAnswersAtOnce && ms === 2000 ? 0 : ms, ...rest);
const line = {
  getInfo: () => ({ usbVendorId: boardAnswersAtOnce ? 1 : undefined }),
  setSignals: async () => {},
  async open() {
    let going = true;
    this.readable = new ReadableStream({
      async pull(sink) {
        while (going) {
          const said = await boardSays();
          if (said === null) return sink.error(new Error("The device has been lost."));
          if (said) return sink.enqueue(Uint8Array.from(atob(said), (c) => c.charCodeAt(0)));
          await new Promise((done) => setTimeout(done, 1));
        }
      },
      cancel() { going = false; },
    });
    this.writable = new WritableStream({
      async write(bytes) {
        if (!(await boardHears(btoa(String.fromCharCode(...bytes))))) throw new Error("The device has been lost.");
      },
    });
  },
  async close() {},
};
Object.defineProperty(navigator, "serial", { value: { requestPort: async () => line }, configurable: true });
