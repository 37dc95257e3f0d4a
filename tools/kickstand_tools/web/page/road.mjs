// Draws the road ahead as the rider sees it. The road moves with the speed and bends with the yaw rate.

const CAMERA_M = 2.2; // height above the road
const BIKE_M = 6; // distance from the camera to the bike
const FAR_M = 160;
const EDGES_M = [-5.4, 1.8]; // edges of the road, from the middle of the bike's lane
const CENTRE_M = -1.8;
const DASH_M = [4, 12]; // length of a dash, and distance between the beginnings of two
const POST_M = 25; // distance between two posts at the roadside
const HORIZON = 0.4; // distance of the horizon from the top, as a share of the picture's height

export class Road {
  #canvas;
  #colours;
  #metres = 0;
  #heading = 0; // in rad, positive to the right
  #still = matchMedia("(prefers-reduced-motion: reduce)");

  constructor(canvas) {
    this.#canvas = canvas;
    new ResizeObserver(() => this.#size()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => (this.#colours = null));
  }

  #size() {
    const ratio = Math.min(2, devicePixelRatio);
    this.#canvas.width = Math.round(this.#canvas.clientWidth * ratio);
    this.#canvas.height = Math.round(this.#canvas.clientHeight * ratio);
    this.draw(0, 0, 0);
  }

  /** Advance by `seconds` at this speed (m/s) and yaw rate (deg/s, positive in a left turn), and draw. */
  draw(speed, yawRate, seconds) {
    const right = (-yawRate * Math.PI) / 180;
    if (!this.#still.matches) {
      this.#metres += speed * seconds;
      this.#heading += right * seconds;
    }
    const bend = speed > 1 && !this.#still.matches ? right / speed : 0; // curvature in 1/m
    const { width, height } = this.#canvas;
    if (!width || !height) return;
    this.#colours ??= colours(this.#canvas);
    const context = this.#canvas.getContext("2d");
    const horizon = HORIZON * height;
    const focus = ((0.93 - HORIZON) * height * BIKE_M) / CAMERA_M;
    const place = (x, z) => {
      const aside = x + (bend * z * z) / 2 - (bend * BIKE_M * z) / 2;
      return [width / 2 + (focus * aside) / z, horizon + (focus * CAMERA_M) / z];
    };
    this.#ground(context, width, height, horizon, focus);
    this.#strip(context, place, EDGES_M[0], EDGES_M[1], 3, FAR_M, this.#colours.road);
    for (const edge of EDGES_M) this.#strip(context, place, edge - 0.09, edge + 0.09, 3, FAR_M, this.#colours.line);
    const [length, pitch] = DASH_M;
    for (let z = pitch - (this.#metres % pitch) - pitch; z < FAR_M; z += pitch) {
      if (z + length > 3) this.#strip(context, place, CENTRE_M - 0.08, CENTRE_M + 0.08, Math.max(3, z), z + length, this.#colours.line);
    }
    for (let z = POST_M - (this.#metres % POST_M); z < FAR_M; z += POST_M) {
      if (z < 4) continue;
      for (const edge of EDGES_M) this.#post(context, place, edge + Math.sign(edge) * 1.1, z, focus);
    }
  }

  #ground(context, width, height, horizon, focus) {
    const sky = context.createLinearGradient(0, 0, 0, horizon);
    sky.addColorStop(0, this.#colours.skyTop);
    sky.addColorStop(1, this.#colours.sky);
    context.fillStyle = sky;
    context.fillRect(0, 0, width, horizon + 1);
    context.fillStyle = this.#colours.ground;
    context.fillRect(0, horizon, width, height - horizon);
    context.fillStyle = this.#colours.hills;
    context.beginPath();
    context.moveTo(0, horizon + 1);
    for (let x = 0; x <= width + 8; x += 8) {
      const at = (x / focus) * 1.6 + this.#heading;
      const rise = 0.5 + 0.25 * Math.sin(2 * at + 1) + 0.17 * Math.sin(5 * at) + 0.08 * Math.sin(11 * at + 2);
      context.lineTo(x, horizon - rise * 0.13 * height);
    }
    context.lineTo(width, horizon + 1);
    context.fill();
  }

  /** Draw a strip of the ground between two lines along the road, from near to far. */
  #strip(context, place, left, right, near, far, colour) {
    const steps = far - near > 20 ? 28 : 4;
    const places = Array.from({ length: steps + 1 }, (_, i) => near * (far / near) ** (i / steps));
    context.fillStyle = colour;
    context.beginPath();
    for (const z of places) context.lineTo(...place(left, z));
    for (const z of places.reverse()) context.lineTo(...place(right, z));
    context.fill();
  }

  #post(context, place, x, z, focus) {
    const [left, foot] = place(x, z);
    const scale = focus / z;
    context.fillStyle = this.#colours.post;
    context.fillRect(left - 0.06 * scale, foot - 0.9 * scale, 0.12 * scale, 0.9 * scale);
    context.fillStyle = this.#colours.reflector;
    context.fillRect(left - 0.06 * scale, foot - 0.75 * scale, 0.12 * scale, 0.2 * scale);
  }
}

function colours(element) {
  const style = getComputedStyle(element);
  const named = (name) => style.getPropertyValue(name).trim();
  return {
    skyTop: named("--sky-top"),
    sky: named("--sky"),
    hills: named("--hills"),
    ground: named("--ground"),
    road: named("--road"),
    line: named("--line"),
    post: named("--post"),
    reflector: named("--reflector"),
  };
}
