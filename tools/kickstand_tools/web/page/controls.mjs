// The rider's controls: button, pose, lean, speed, the phone's tilt. Each change calls act(name, value).

const STEP_DEG = 5;
const SLOWEST_KMH = 20; // lowest speed of a ride
const CRUISE_KMH = 54; // speed at the start of a ride
const DRAG_DEG = 75; // change of lean in degrees for a drag across half of the scene
const TAP_MS = 150;
const MOTION_MS = 1500; // time within which a device with an orientation sensor reports

const byId = (id) => document.getElementById(id);
// If the chosen pose has the focus, the space bar presses the push button
const inControl = (target) => target.closest?.("button:not(#pose [aria-pressed=true]), a, summary, select");

/** The push button, for mouse, touch, space bar, and the click of a screen reader. Calls press(down). */
export function connectButton(press) {
  const button = byId("press");
  button.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    button.setPointerCapture(event.pointerId);
    press(true);
  });
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) {
    button.addEventListener(name, () => press(false));
  }
  button.addEventListener("contextmenu", (event) => event.preventDefault());
  button.addEventListener("keydown", (event) => {
    if (event.repeat && event.key === "Enter") event.preventDefault(); // a held key would press repeatedly
  });
  button.addEventListener("click", (event) => {
    if (event.detail) return; // the click of a mouse or finger, which is already handled
    press(true);
    setTimeout(() => press(false), TAP_MS);
  });
  addEventListener("keydown", (event) => {
    if (event.code !== "Space" || (inControl(event.target) && event.target !== button)) return;
    event.preventDefault();
    if (!event.repeat) press(true);
  });
  addEventListener("keyup", (event) => {
    if (event.code !== "Space") return;
    if (event.target === button) event.preventDefault();
    press(false);
  });
  addEventListener("blur", () => press(false));
}

/**
 * The controls of pose, lean and speed. They call act(name, value) with the arguments of Board.order(). The poses are
 * not radio buttons, because then the arrow keys would change the pose. On this page arrow keys always lean the bike.
 */
export class Steering {
  #act;
  #poses = document.querySelectorAll("#pose button");
  #lean = byId("lean");
  #speed = byId("speed");
  #wanted = CRUISE_KMH; // the speed to ride at, km/h
  pose = "kickstand";

  constructor(act) {
    this.#act = act;
    for (const button of this.#poses) {
      button.addEventListener("click", () => button.value === this.pose || this.stand(button.value));
    }
    this.#lean.addEventListener("input", () => this.lean(Number(this.#lean.value)));
    this.#speed.addEventListener("input", () => this.#ride(this.#speed.value));
    addEventListener("keydown", (event) => this.#key(event));
    this.#drag(byId("scene"));
    this.#tilt(byId("tilt"));
  }

  /** pose: "kickstand", "upright" or "ride". */
  stand(pose) {
    this.pose = pose;
    for (const button of this.#poses) button.setAttribute("aria-pressed", String(button.value === pose));
    const riding = pose === "ride";
    this.#lean.disabled = this.#speed.disabled = !riding;
    this.#speed.min = riding ? SLOWEST_KMH : 0;
    if (riding) {
      this.#show(0);
      this.#ride(this.#wanted);
    } else this.#act("pose", pose);
    this.#act("lean", 0);
  }

  /** Show the motorcycle's state on the sliders while it stands or stops. lean: in degrees. speed: in m/s. */
  follow(lean, speed) {
    if (this.pose === "ride") return;
    this.#show(Math.round(lean));
    this.#showSpeed(speed);
  }

  lean(degrees) {
    if (this.pose !== "ride") return;
    this.#show(Math.max(-50, Math.min(50, Math.round(degrees))));
    this.#act("lean", Number(this.#lean.value));
  }

  #show(degrees) {
    const text = leanText(degrees, 0);
    if (byId("lean-out").value === text) return;
    this.#lean.value = degrees;
    byId("lean-out").value = text;
    this.#lean.setAttribute("aria-valuetext", text);
  }

  #showSpeed(speed) {
    const text = speedText(speed);
    if (byId("speed-out").value === text) return;
    this.#speed.value = speed * 3.6;
    byId("speed-out").value = text;
    this.#speed.setAttribute("aria-valuetext", text);
  }

  /** Set the speed, in km/h. A speed beyond the slider's ends is limited to them. */
  #ride(kmh) {
    this.#speed.value = kmh;
    this.#wanted = this.#speed.valueAsNumber;
    this.#showSpeed(this.#wanted / 3.6);
    this.#act("pose", this.#wanted / 3.6);
  }

  #key(event) {
    if (event.altKey || event.ctrlKey || event.metaKey || event.target.matches?.("input, select")) return;
    const steps = { ArrowLeft: [-STEP_DEG, 0], ArrowRight: [STEP_DEG, 0], ArrowUp: [0, 10], ArrowDown: [0, -10] }[event.key];
    if (!steps || this.pose !== "ride") return;
    event.preventDefault();
    if (steps[0]) this.lean(Number(this.#lean.value) + steps[0]);
    else this.#ride(this.#wanted + steps[1]);
  }

  #drag(scene) {
    let from = null;
    scene.addEventListener("pointerdown", (event) => {
      if (this.pose !== "ride" || event.button !== 0) return;
      scene.setPointerCapture(event.pointerId);
      from = { x: event.clientX, lean: Number(this.#lean.value) };
    });
    scene.addEventListener("pointermove", (event) => {
      if (from) this.lean(from.lean + ((event.clientX - from.x) / (scene.clientWidth / 2)) * DRAG_DEG);
    });
    for (const name of ["pointerup", "pointercancel"]) scene.addEventListener(name, () => (from = null));
  }

  /** Lean the bike by tilting the phone. The phone's position when the button is pressed is upright. */
  #tilt(button) {
    if (!("DeviceOrientationEvent" in window) || !isSecureContext || !matchMedia("(pointer: coarse)").matches) return;
    button.hidden = false;
    let zero = null;
    let late;
    const follow = (event) => {
      const turned = screen.orientation?.angle ?? 0;
      const tilt = { 0: event.gamma, 90: event.beta, 180: -event.gamma, 270: -event.beta }[turned];
      if (tilt === null || tilt === undefined) return;
      zero ??= tilt;
      this.lean(tilt - zero);
    };
    const end = (text) => {
      removeEventListener("deviceorientation", follow);
      button.setAttribute("aria-pressed", "false");
      byId("tilt-said").textContent = text;
    };
    button.addEventListener("click", async () => {
      const on = button.getAttribute("aria-pressed") !== "true";
      // iOS must ask the user for permission, and allows this only after a click
      const may = on && DeviceOrientationEvent.requestPermission ? await DeviceOrientationEvent.requestPermission() : "granted";
      clearTimeout(late);
      if (may !== "granted") return end("The browser does not tell this page how the device is held.");
      end("");
      if (!on) return;
      zero = null;
      button.setAttribute("aria-pressed", "true");
      if (this.pose !== "ride") this.stand("ride");
      addEventListener("deviceorientation", follow);
      late = setTimeout(() => zero === null && end("This device does not say how it is held: take the slider."), MOTION_MS);
    });
  }
}

/** Return a speed in m/s as text, such as "54 km/h". */
export function speedText(speed) {
  return `${Math.round(speed * 3.6)} km/h`;
}

/** Return a lean as text, such as "12.3° left". */
export function leanText(degrees, digits = 1) {
  const size = Math.abs(degrees).toFixed(digits);
  return Number(size) === 0 ? `${size}°` : `${size}° ${degrees < 0 ? "left" : "right"}`;
}
