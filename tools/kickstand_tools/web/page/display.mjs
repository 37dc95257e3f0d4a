// Draws the display dot by dot from the memory of its controller: 16x2 characters, or an OLED's 128x64 pixels.

// Sizes of the usual LCD module, in units of 0.1 mm
const DOT = [5, 6];
const PITCH = [6, 7];
const CELL = [36, 62];
const MARGIN = 24; // glass around the characters
const COLUMNS = 16;
const LINES = 2;

const WIDTH = COLUMNS * CELL[0] + 2 * MARGIN;
const HEIGHT = LINES * CELL[1] + 2 * MARGIN;
const OLED = [128, 64];
const OLED_MARGIN = 5; // glass around the OLED's picture, in pixels of the OLED

export class Display {
  #canvas;
  #said;
  #font;
  #waiting;
  #last = { codes: [[], []], cgram: [], lit: false };

  /** canvas: the canvas to draw on. said: the element whose text a screen reader speaks. font: {character code: its
   * eight rows of dots}. */
  constructor(canvas, said, font) {
    this.#canvas = canvas;
    this.#said = said;
    this.#font = font;
    new ResizeObserver(() => this.#draw()).observe(canvas);
  }

  /** display: the result of display() in web/device.py. */
  show(display) {
    this.#last = display;
    this.#draw();
    const words = display.text.map(spoken).filter(Boolean).join(", ");
    this.#canvas.setAttribute("aria-label", words ? `Display: ${words}` : "Display: blank");
    this.#speak(words);
  }

  /** Speak a text that stays for a second. Figures that change all the time are not spoken. */
  #speak(words) {
    clearTimeout(this.#waiting);
    this.#waiting = setTimeout(() => (this.#said.textContent = words), 1000);
  }

  #draw() {
    const context = this.#canvas.getContext("2d");
    this.#canvas.classList.toggle("oled", Boolean(this.#last.pixels));
    if (this.#last.pixels) this.#drawOled(context, this.#last.pixels);
    else this.#drawLcd(context, this.#last);
  }

  #drawOled(context, pixels) {
    this.#canvas.width = Math.round(this.#canvas.clientWidth * devicePixelRatio);
    this.#canvas.height = Math.round(this.#canvas.clientHeight * devicePixelRatio);
    // A whole number of screen pixels for each pixel of the OLED
    const fitting = Math.min(this.#canvas.width / (OLED[0] + 2 * OLED_MARGIN), this.#canvas.height / (OLED[1] + 2 * OLED_MARGIN));
    const scale = Math.max(1, Math.floor(fitting));
    context.fillStyle = "#05070a";
    context.fillRect(0, 0, this.#canvas.width, this.#canvas.height);
    context.fillStyle = "#e8f4ff";
    const left = Math.floor((this.#canvas.width - scale * OLED[0]) / 2);
    const top = Math.floor((this.#canvas.height - scale * OLED[1]) / 2);
    const gap = scale > 3 ? 1 : 0;
    for (let y = 0; y < OLED[1]; y++) {
      for (let x = 0; x < OLED[0]; x++) {
        if (!(pixels[(y * OLED[0] + x) >> 3] & (0x80 >> (x & 7)))) continue;
        context.fillRect(left + x * scale, top + y * scale, scale - gap, scale - gap);
      }
    }
  }

  #drawLcd(context, { codes, cgram, lit }) {
    // The canvas has exactly the pixels of the screen. If it were scaled, the dots would have different widths.
    const scale = (this.#canvas.clientWidth * devicePixelRatio) / WIDTH;
    this.#canvas.width = Math.round(WIDTH * scale);
    this.#canvas.height = Math.round(HEIGHT * scale);
    context.setTransform(scale, 0, 0, scale, 0, 0);
    const glass = context.createLinearGradient(0, 0, 0, HEIGHT);
    glass.addColorStop(0, lit ? "#2a63df" : "#26324f");
    glass.addColorStop(1, lit ? "#1640ab" : "#1b243b");
    context.fillStyle = glass;
    context.fillRect(0, 0, WIDTH, HEIGHT);
    for (let line = 0; line < LINES; line++) {
      for (let column = 0; column < COLUMNS; column++) {
        const rows = this.#rows(codes[line][column] ?? 0x20, cgram);
        for (let y = 0; y < 8; y++) {
          for (let x = 0; x < 5; x++) {
            context.fillStyle = rows[y] & (0x10 >> x) ? (lit ? "#fbfdff" : "#5d6a8a") : "rgb(10 32 110 / 30%)";
            const left = MARGIN + column * CELL[0] + x * PITCH[0];
            const top = MARGIN + line * CELL[1] + y * PITCH[1];
            context.fillRect(left, top, DOT[0], DOT[1]);
          }
        }
      }
    }
  }

  #rows(code, cgram) {
    if (code < 0x10) return cgram.slice((code % 8) * 8, (code % 8) * 8 + 8);
    return this.#font[code] ?? this.#font[0x20];
  }
}

/** Return a line of the display without the blocks of its bars. */
function spoken(line) {
  return line.replace(/[▁-▐▕]+/g, " ").replace(/\s+/g, " ").trim();
}
