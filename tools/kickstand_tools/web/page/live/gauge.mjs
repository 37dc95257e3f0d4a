// Draws the big gauge, an arc from left to right that is filled up to a value. The gauge also marks the maximum of each
// side.

import { sideOf } from "./measures.mjs";

const RADIUS = 190;

export class Gauge {
  #svg;
  #measure;

  constructor(svg) {
    this.#svg = svg;
  }

  /** Draw the scale, a half circle. measure: a measure of measures.mjs. */
  scale(measure) {
    this.#measure = measure;
    const { limit } = measure;
    this.#svg.innerHTML = `
      <path class="track" d="${this.#arc(-limit, limit)}"/><path class="fill"/>
      <g class="marks">${this.#marks()}</g><path class="furthest left"/><path class="furthest right"/><path class="needle"/>`;
  }

  /** Show a value, positive to the right, or null if unknown. left, right: the maxima so far, both positive, or 0. */
  show(value, left, right) {
    const set = (name, path) => this.#svg.querySelector(name).setAttribute("d", path);
    set(".fill", value === null ? "" : this.#arc(0, value));
    set(".needle", value === null ? "" : `M${this.#point(value, 208)}L${this.#point(value, 146)}`);
    set(".left", left ? `M${this.#point(-left, 208)}L${this.#point(-left, 172)}` : "");
    set(".right", right ? `M${this.#point(right, 208)}L${this.#point(right, 172)}` : "");
    this.#svg.setAttribute("aria-label", `${this.#measure.title}: ${this.#said(value)}`);
  }

  #said(value) {
    if (value === null) return "not known";
    const { digits, spoken } = this.#measure;
    return `${Math.abs(value).toFixed(digits)} ${spoken} ${sideOf(this.#measure, value)}`.trim();
  }

  /** Return the point at this value on a circle, as "x y". */
  #point(value, radius = RADIUS) {
    const { limit } = this.#measure;
    const angle = (Math.max(-limit, Math.min(limit, value)) / limit) * (Math.PI / 2);
    return `${(radius * Math.sin(angle)).toFixed(1)} ${(-radius * Math.cos(angle)).toFixed(1)}`;
  }

  #arc(from, to) {
    return `M${this.#point(from)}A${RADIUS} ${RADIUS} 0 0 ${to < from ? 0 : 1} ${this.#point(to)}`;
  }

  #marks() {
    const { limit, mark } = this.#measure;
    const steps = Math.round(limit / mark);
    let drawn = "";
    for (let step = -steps; step <= steps; step += 1) {
      const long = step % 2 === 0;
      drawn += `<path d="M${this.#point(step * mark, 162)}L${this.#point(step * mark, long ? 146 : 153)}"/>`;
      if (long) {
        const [x, y] = this.#point(step * mark, 128).split(" ").map(Number);
        drawn += `<text x="${x}" y="${y + 6}">${Number(Math.abs(step * mark).toFixed(1))}</text>`;
      }
    }
    return drawn;
  }
}
