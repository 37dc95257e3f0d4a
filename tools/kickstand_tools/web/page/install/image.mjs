// Writes MicroPython to an ESP32 with Espressif's esptool-js. The rider chooses the image file.

import { choosePort } from "../cable/cable.mjs";

const BAUD = 460_800; // baud rate for the image; the chip is identified at its own rate
const IMAGE = 0xe9; // first byte of an image for an ESP32
const CHIP_AT = 12; // offset of the chip's number in the image, 2 bytes
const CHIPS = { 0: "ESP32", 2: "ESP32-S2", 5: "ESP32-C3", 9: "ESP32-S3", 12: "ESP32-C2", 13: "ESP32-C6", 16: "ESP32-H2" };
const MOST_BYTES = 16 << 20; // size of the largest flash
const byId = (id) => document.getElementById(id);

/** Return the number of the chip that an image is for. Throws an Error with the reason if the data is not an image. */
export function chipOf(data) {
  if (data.length > MOST_BYTES || data[0] !== IMAGE) {
    throw new Error("This is no image for an ESP32: take the .bin file of your chip from micropython.org");
  }
  return data[CHIP_AT] | (data[CHIP_AT + 1] << 8);
}

/** Connect the controls for an image. atWork(on) is called when work on a board begins and ends. */
export function connectImage(atWork) {
  byId("image").addEventListener("click", async () => {
    const [file] = byId("image-file").files;
    if (!file) return tell("Choose the .bin file first.");
    let data, wanted;
    try {
      data = new Uint8Array(await file.arrayBuffer());
      wanted = chipOf(data);
    } catch (error) {
      return tell(`${error.message}.`);
    }
    const port = await choosePort(tell);
    if (!port) return;
    atWork(true);
    try {
      await write(port, data, wanted);
      tell("MicroPython is on the board. Go on below with Kickstand itself.");
    } catch (error) {
      console.error(error);
      tell(`Not written: ${error.message}.`);
    } finally {
      atWork(false);
    }
  });
}

async function write(port, data, wanted) {
  tell("Loading esptool …", 0);
  const { ESPLoader, Transport } = await import("../esptool/bundle.js").catch((error) => {
    throw new Error("esptool cannot be loaded. Is there a network? Press the button again to retry", { cause: error });
  });
  const transport = new Transport(port);
  const quiet = { clean() {}, write() {}, writeLine() {} };
  const loader = new ESPLoader({ transport, baudrate: BAUD, terminal: quiet });
  try {
    tell("Asking the chip …", 0);
    try {
      await loader.main();
    } catch (error) {
      throw new Error("no ESP32 answers: hold its button BOOT, press EN or RST, let BOOT go and try again", { cause: error });
    }
    const { CHIP_NAME, IMAGE_CHIP_ID, BOOTLOADER_FLASH_OFFSET } = loader.chip;
    if (IMAGE_CHIP_ID !== wanted) {
      throw new Error(`the file is for an ${CHIPS[wanted] ?? `ESP32 of another kind (${wanted})`}, the board has an ${CHIP_NAME}`);
    }
    const eraseAll = byId("image-erase").checked;
    if (eraseAll) tell("Erasing, which takes up to a minute …", 0);
    await loader.writeFlash({
      fileArray: [{ data, address: BOOTLOADER_FLASH_OFFSET }],
      flashMode: "keep",
      flashFreq: "keep",
      flashSize: "keep",
      eraseAll,
      compress: true,
      reportProgress: (_, done, total) => tell("Writing MicroPython", done / total),
    });
    await loader.after("hard_reset");
  } finally {
    await transport.disconnect().catch(() => {}); // the port may already be gone
  }
}

function tell(text, share = null) {
  byId("image-said").textContent = text;
  byId("image-bar").hidden = share === null;
  byId("image-bar").value = share ?? 0;
}
