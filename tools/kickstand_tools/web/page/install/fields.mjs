// The form for config.py: one field per setting. An empty field means the board's default value, which the field shows.

const SIDES = [['"left"', "left"], ['"right"', "right"]];
const SWITCH = [["True", "yes"], ["False", "no"]];
const numbers = (...values) => values.map((value) => [String(value), String(value)]);

// Groups of fields: [title, open at first, fields]. A field is [name, label, choices if no other value is allowed].
export const GROUPS = [
  ["The motorcycle", true, [
    ["SIDE", "Its kickstand leans it to the", SIDES],
    ["VEHICLE", "Vehicle", [['"motorcycle"', "motorcycle"], ['"car"', "car: anything that does not lean"]]],
    ["SPEED", "Speed comes from", [["None", "nothing"], ['"gps"', "a GPS receiver that sends NMEA"], ['"wheel"', "a contact at a wheel"]]],
    ["RECORD", "Record every ride from power-on", SWITCH],
    ["LIVE", "Send the lean to a phone over Bluetooth (Pico W, Pico 2 W, ESP32 but for an S2)", SWITCH],
    ["LIVE_PIN", "Six digits that a phone has to give (ESP32)"],
  ]],
  ["Wiring, where it is not that of step 1", false, [
    ["SENSOR_SDA", "Sensor, SDA: GPIO"],
    ["SENSOR_SCL", "Sensor, SCL: GPIO"],
    ["SENSOR_I2C", "Sensor, number of the I2C bus (Pico)", numbers(0, 1)],
    ["SENSOR_BUS_HZ", "Sensor, speed of the bus in Hz"],
    ["SENSOR_ADDRESS", "Sensor, address", [["0x68", "0x68"], ["0x69", "0x69: AD0 is tied high"]]],
    ["DISPLAY", "Display", [['"auto"', "found by itself"], ['"lcd"', "16x2 characters"], ['"ssd1306"', "OLED, SSD1306"], ['"sh1106"', "OLED, SH1106"], ['"ssd1306-32"', "OLED, 128x32"]]],
    ["LCD_WIRING", "Wiring of a backpack whose display stays blank", [["1", "1: usual"], ["2", "2: MJKDZ, GY-IICLCD"], ["3", "3: RS on P4"], ["4", "4: usual, light inverted"]]],
    ["OLED_CONTRAST", "OLED, contrast, 0 to 255"],
    ["OLED_INVERTED", "OLED, dark on bright", SWITCH],
    ["LCD_SDA", "Display, SDA: GPIO"],
    ["LCD_SCL", "Display, SCL: GPIO"],
    ["LCD_I2C", "Display, number of the I2C bus (Pico)", numbers(0, 1)],
    ["LCD_BUS_HZ", "Display, speed of the bus in Hz"],
    ["LCD_ADDRESSES", "Display, addresses to try"],
    ["BUTTON_PIN", "Button to ground: GPIO"],
  ]],
  ["GPS and wheel", false, [
    ["GPS_UART", "GPS, number of the UART", numbers(0, 1, 2)],
    ["GPS_RX", "GPS, to the receiver’s TX: GPIO"],
    ["GPS_TX", "GPS, stays open: GPIO"],
    ["GPS_BAUD", "GPS, baud"],
    ["WHEEL_PIN", "Wheel contact to ground, never 12 V: GPIO"],
    ["PULSES_PER_METRE", "Wheel, pulses a metre of road"],
  ]],
  ["Sensor", false, [
    ["SAMPLE_HZ", "Readings per second", numbers(50, 100, 125, 200)],
    ["DLPF", "Low-pass of the chip", [["2", "2: 98 Hz"], ["3", "3: 44 Hz"], ["4", "4: 21 Hz"], ["5", "5: 10 Hz"], ["6", "6: 5 Hz"]]],
    ["ACCEL_RANGE_G", "Range of the accelerometer, g", numbers(2, 4, 8, 16)],
    ["GYRO_RANGE_DPS", "Range of the gyro, degrees per second", numbers(250, 500, 1000, 2000)],
    ["ACCEPT_WHO_AM_I", "Number of a chip that is refused as unknown"],
  ]],
  ["SD card, and what else there is", false, [
    ["SD_SPI", "SD card, number of the SPI"],
    ["SD_SCK", "SD card, SCK: GPIO"],
    ["SD_MOSI", "SD card, MOSI: GPIO"],
    ["SD_MISO", "SD card, MISO: GPIO"],
    ["SD_CS", "SD card, CS: GPIO"],
    ["WATCHDOG", "Restart by itself when the program hangs", SWITCH],
  ]],
];

export class Fields {
  #place;
  #marked = null;

  /** changed(): called when a field has changed. */
  constructor(place, changed) {
    this.#place = place;
    place.addEventListener("change", changed);
  }

  /** Fill the form. settings: {name: value in config.py}. usual: {name: default value}. Values are Python literals. */
  fill(settings, usual) {
    this.#place.replaceChildren(...GROUPS.map(([title, open, fields]) => group(title, open, fields, settings, usual)));
    this.#marked = null;
  }

  /** Return {name: value as a Python literal, or null for the default}. */
  values() {
    return Object.fromEntries([...this.#place.querySelectorAll("[name]")].map(({ name, value }) => [name, value.trim() || null]));
  }

  /** Set some fields. settings: {name: value as a Python literal, or "" for the default}. */
  set(settings) {
    for (const [name, value] of Object.entries(settings)) {
      const input = this.#place.querySelector(`[name=${name}]`);
      input.value = value;
      if (value) input.closest("details").open = true;
    }
    this.#place.dispatchEvent(new Event("change"));
  }

  /** Show a fault beside a field, and remove the earlier fault. name: the setting, or null to show no fault. */
  mark(name, text) {
    if (this.#marked) {
      this.#marked.removeAttribute("aria-invalid");
      this.#marked.nextElementSibling.textContent = "";
    }
    this.#marked = name && this.#place.querySelector(`[name=${name}]`);
    if (!this.#marked) return;
    this.#marked.setAttribute("aria-invalid", "true");
    this.#marked.nextElementSibling.textContent = text;
    this.#marked.closest("details").open = true;
  }
}

function group(title, open, fields, settings, usual) {
  const made = Object.assign(document.createElement("details"), { open: open || fields.some(([name]) => name in settings) });
  made.append(Object.assign(document.createElement("summary"), { textContent: title }));
  const grid = Object.assign(document.createElement("div"), { className: "fields" });
  grid.append(...fields.map(([name, label, choices]) => field(name, label, choices, settings[name] ?? "", usual[name] ?? "None")));
  made.append(grid);
  return made;
}

function field(name, label, choices, value, usual) {
  const made = document.createElement("label");
  const input = document.createElement(choices ? "select" : "input");
  const said = Object.assign(document.createElement("small"), { className: "fault", id: `fault-${name}` });
  made.append(Object.assign(document.createElement("span"), { textContent: label }), input, said);
  input.name = name;
  input.setAttribute("aria-describedby", said.id);
  if (choices) {
    const word = choices.find(([literal]) => same(literal, usual))?.[1] ?? usual;
    input.append(new Option(`${word} (usual)`, ""), ...choices.map(([literal, text]) => new Option(text, literal)));
    const chosen = [...input.options].find((option) => same(option.value, value));
    if (chosen) chosen.value = value; // keeps the literal as the rider wrote it
    else if (value) input.append(new Option(value, value));
    input.value = value;
  } else {
    input.placeholder = usual === "None" ? "none" : usual;
    input.autocomplete = "off";
    input.spellcheck = false;
    input.value = value;
  }
  return made;
}

/** Return true if two literals have the same value in Python, for the literals that occur as choices. Examples: 'left'
 * and "left", 0x68 and 104. Neither literal is empty. */
function same(one, other) {
  const plain = (text) => (Number.isNaN(Number(text)) ? text.replaceAll("'", '"') : Number(text));
  return one !== "" && other !== "" && plain(one) === plain(other);
}
