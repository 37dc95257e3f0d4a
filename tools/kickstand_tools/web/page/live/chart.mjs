// Draws lean (for a car the sideways force) and acceleration over the last minute on one canvas.

const SPAN_S = 60;
const LEFT = 46; // width of the numbers beside the plots, in pixels
const GAP = 26;
const EVERY_S = 10; // time between two vertical lines of the grid
// value: function that returns the value of a moment. The plot reaches from -limit to limit. step: distance between two
// of its lines.
const ACCELERATION = {
  ...{ title: "acceleration: braking is down", value: ([, , forward]) => forward, limit: 1, step: 0.5, unit: " g" },
  ...{ share: 0.38, color: "--truth" },
};

export class Chart {
  #canvas;

  constructor(canvas) {
    this.#canvas = canvas;
  }

  /** Draw the chart. moments: as in LiveReading (rides/stream.py). until: time at the right edge, in s. The third
   * argument is a measure of measures.mjs. */
  draw(moments, until, { value, limit, chart }) {
    const { clientWidth: width, clientHeight: height } = this.#canvas;
    const scale = devicePixelRatio;
    if (this.#canvas.width !== Math.round(width * scale) || this.#canvas.height !== Math.round(height * scale)) {
      this.#canvas.width = Math.round(width * scale);
      this.#canvas.height = Math.round(height * scale);
    }
    const pen = this.#canvas.getContext("2d");
    const style = getComputedStyle(this.#canvas);
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.font = "600 13px system-ui, sans-serif";
    let top = GAP;
    for (const plot of [{ ...chart, value, limit, share: 0.62, color: "--accent" }, ACCELERATION]) {
      const tall = (height - 2 * GAP - 8) * plot.share;
      this.#plot(pen, style, plot, moments, until, { top, tall, width });
      top += tall + GAP;
    }
  }

  #plot(pen, style, { title, value, limit, step, unit, color }, moments, until, { top, tall, width }) {
    const x = (s) => width - ((until - s) / SPAN_S) * (width - LEFT);
    const y = (size) => top + (tall * (limit - Math.max(-limit, Math.min(limit, size)))) / (2 * limit);
    pen.fillStyle = style.getPropertyValue("--quiet");
    pen.textAlign = "left";
    pen.fillText(title, LEFT, top - 7);
    pen.textAlign = "right";
    pen.strokeStyle = style.getPropertyValue("--edge");
    pen.lineWidth = 1;
    for (let size = -limit; size <= limit; size += step) {
      line(pen, [[LEFT, y(size)], [width, y(size)]]);
      pen.fillText(`${Math.abs(size)}${unit}`, LEFT - 6, y(size) + 4);
    }
    for (let s = Math.ceil((until - SPAN_S) / EVERY_S) * EVERY_S; s < until; s += EVERY_S) {
      line(pen, [[x(s), top], [x(s), top + tall]]);
    }
    pen.strokeStyle = style.getPropertyValue(color);
    pen.lineWidth = 2.5;
    pen.lineJoin = "round";
    let segment = [];
    for (const moment of moments) {
      const [s] = moment;
      if (s < until - SPAN_S || s > until) continue;
      const broken = segment.length && s - segment.at(-1)[2] > 0.3;
      const size = value(moment);
      if (size === null || broken) {
        line(pen, segment);
        segment = [];
      }
      if (size !== null) segment.push([x(s), y(size), s]);
    }
    line(pen, segment);
  }
}

function line(pen, points) {
  pen.beginPath();
  points.forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
  pen.stroke();
}
