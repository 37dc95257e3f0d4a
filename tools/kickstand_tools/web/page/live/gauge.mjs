// The big gauge: an arc from left to right that fills up to the lean, with the furthest to both sides marked on it.

const RADIUS = 190;
const LIMIT = 60; // degrees at its ends

/** The point at this lean on a circle, x y. The scale is as wide as a half circle, though its ends are at LIMIT. */
function point(lean, radius = RADIUS) {
  const angle = (Math.max(-LIMIT, Math.min(LIMIT, lean)) / LIMIT) * (Math.PI / 2);
  return `${(radius * Math.sin(angle)).toFixed(1)} ${(-radius * Math.cos(angle)).toFixed(1)}`;
}

function arc(from, to) {
  return `M${point(from)}A${RADIUS} ${RADIUS} 0 0 ${to < from ? 0 : 1} ${point(to)}`;
}

function marks() {
  let drawn = "";
  for (let lean = -LIMIT; lean <= LIMIT; lean += 10) {
    const long = lean % 20 === 0;
    drawn += `<path d="M${point(lean, 162)}L${point(lean, long ? 146 : 153)}"/>`;
    if (long) {
      const [x, y] = point(lean, 128).split(" ").map(Number);
      drawn += `<text x="${x}" y="${y + 6}">${Math.abs(lean)}</text>`;
    }
  }
  return drawn;
}

export class Gauge {
  #svg;

  constructor(svg) {
    this.#svg = svg;
    svg.innerHTML = `
      <path class="track" d="${arc(-LIMIT, LIMIT)}"/><path class="fill"/>
      <g class="marks">${marks()}</g><path class="furthest left"/><path class="furthest right"/><path class="needle"/>`;
  }

  /** lean: degrees, > 0 to the right, or null for none that is known. left, right: the furthest until now, both > 0. */
  show(lean, left, right) {
    const set = (name, path) => this.#svg.querySelector(name).setAttribute("d", path);
    set(".fill", lean === null ? "" : arc(0, lean));
    set(".needle", lean === null ? "" : `M${point(lean, 208)}L${point(lean, 146)}`);
    set(".left", left ? `M${point(-left, 208)}L${point(-left, 172)}` : "");
    set(".right", right ? `M${point(right, 208)}L${point(right, 172)}` : "");
    this.#svg.setAttribute("aria-label", lean === null ? "Lean: not known" : `Lean: ${Math.round(lean)} degrees`);
  }
}
