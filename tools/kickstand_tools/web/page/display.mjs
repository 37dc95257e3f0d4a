// The 16x2 display, dot by dot from what its controller holds in its memories.

// In units of 0.1 mm, as on the usual module
const DOT = [5, 6];
const PITCH = [6, 7];
const CELL = [36, 62];
const MARGIN = 24; // of glass around the characters
const COLUMNS = 16;
const LINES = 2;

const WIDTH = COLUMNS * CELL[0] + 2 * MARGIN;
const HEIGHT = LINES * CELL[1] + 2 * MARGIN;

export class Display {
  #canvas;
  #said;
  #font;
  #waiting;
  #last = { codes: [[], []], cgram: [], lit: false };

  /** canvas: what to draw on. said: an element whose text a screen reader speaks. font: {code: eight rows of dots}. */
  constructor(canvas, said, font) {
    this.#canvas = canvas;
    this.#said = said;
    this.#font = font;
    new ResizeObserver(() => this.#draw()).observe(canvas);
  }

  /** display: as display() in web/device.py gives it. */
  show(display) {
    this.#last = display;
    this.#draw();
    const words = display.text.map(spoken).filter(Boolean).join(", ");
    this.#canvas.setAttribute("aria-label", words ? `Display: ${words}` : "Display: blank");
    this.#speak(words);
  }

  /** What stays for a second is spoken; figures that change all the time are not. */
  #speak(words) {
    clearTimeout(this.#waiting);
    this.#waiting = setTimeout(() => (this.#said.textContent = words), 1000);
  }

  #draw() {
    const { codes, cgram, lit } = this.#last;
    const context = this.#canvas.getContext("2d");
    // As many pixels as the screen has there: a canvas that is scaled would show dots of different widths
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

/** A line of the display without the blocks of its bars. */
function spoken(line) {
  return line.replace(/[▁-▐▕]+/g, " ").replace(/\s+/g, " ").trim();
}
