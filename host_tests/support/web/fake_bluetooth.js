// Replaces navigator.bluetooth. Its radio is a bumble central, see bluetooth_bridge.py. From the choice of the board on,
// the page's clock is the board's, so a busy machine, which slows the board down, delays no packet.
class Device extends EventTarget {
  name = "Kickstand 1A2B";
  gatt = {
    connect: async () => {
      await radioDo("connect", "", "");
      this.connected = true;
      this.heard();
      return { getPrimaryService: async (service) => ({ getCharacteristic: async (kind) => this.characteristic(service, kind) }) };
    },
    disconnect: () => {
      if (this.connected) radioDo("disconnect", "", "");
      this.connected = false;
    },
  };
  known = {};

  characteristic(service, kind) {
    return (this.known[kind] ??= Object.assign(new EventTarget(), {
      readValue: async () => view(await radioDo("read", kind, "")),
      startNotifications: async () => radioDo("subscribe", kind, ""),
      writeValueWithResponse: async (bytes) => radioDo("write", kind, btoa(String.fromCharCode(...bytes))),
    }));
  }

  async heard() {
    while (this.connected) {
      const { lost, packets } = await radioHeard();
      for (const [kind, data] of packets) {
        this.known[kind].value = view(data);
        this.known[kind].dispatchEvent(new Event("characteristicvaluechanged"));
      }
      if (lost) {
        this.connected = false;
        this.dispatchEvent(new Event("gattserverdisconnected"));
      }
      await new Promise((done) => setTimeout(done, 10));
    }
  }
}
const view = (text) => new DataView(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
const onFrame = window.requestAnimationFrame.bind(window);
async function followBoard() {
  let ms = await radioMs();
  performance.now = () => ms;
  window.requestAnimationFrame = (draw) => onFrame(() => draw(ms));
  const next = async () => {  // one question at a time: on a busy machine they would pile up
    ms = await radioMs();
    setTimeout(next, 10);
  };
  setTimeout(next, 10);
}
window.asked = [];
window.boardThere = true;
Object.defineProperty(navigator, "bluetooth", {
  configurable: true,
  value: {
    async requestDevice(options) {
      asked.push(options);
      if (!boardThere) throw new DOMException("User cancelled the requestDevice() chooser.", "NotFoundError");
      await followBoard();
      return new Device();
    },
  },
});
window.awake = 0;
Object.defineProperty(navigator, "wakeLock", {
  configurable: true,
  value: { request: async () => ((awake += 1), { release: () => (awake -= 1) }) },
});
