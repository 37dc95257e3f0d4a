// The rider's hands: button, pose, lean, speed, the phone's tilt. Calls act(name, value) with what is wanted.

const STEP_DEG = 5;
const DRAG_DEG = 75; // of lean for half the scene's width
const TAP_MS = 150;

const byId = (id) => document.getElementById(id);
const inControl = (target) => target.closest?.("button, a, summary");

/** The push button: mouse, touch, space bar, and the click of a screen reader. press(down) is called. */
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
  button.addEventListener("click", (event) => {
    if (event.detail) return; // a pointer's, which has been seen to
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

/** Pose, lean and speed. act(name, value) as for Board.order(). */
export class Steering {
  #act;
  #lean = byId("lean");
  #speed = byId("speed");
  pose = "kickstand";

  constructor(act) {
    this.#act = act;
    for (const radio of document.querySelectorAll("input[name=pose]")) {
      radio.addEventListener("change", () => this.stand(radio.value));
    }
    this.#lean.addEventListener("input", () => this.lean(Number(this.#lean.value)));
    this.#speed.addEventListener("input", () => this.#ride());
    addEventListener("keydown", (event) => this.#key(event));
    this.#drag(byId("scene"));
    this.#tilt(byId("tilt"));
  }

  /** pose: "kickstand", "upright" or "ride". */
  stand(pose) {
    this.pose = pose;
    document.querySelector(`input[name=pose][value=${pose}]`).checked = true;
    const riding = pose === "ride";
    this.#lean.disabled = this.#speed.disabled = !riding;
    this.#show(0);
    if (riding) this.#ride();
    else this.#act("pose", pose);
    this.#act("lean", 0);
  }

  lean(degrees) {
    if (this.pose !== "ride") return;
    this.#show(Math.max(-50, Math.min(50, Math.round(degrees))));
    this.#act("lean", Number(this.#lean.value));
  }

  #show(degrees) {
    this.#lean.value = degrees;
    const text = leanText(degrees, 0);
    byId("lean-out").value = text;
    this.#lean.setAttribute("aria-valuetext", text);
  }

  #ride() {
    byId("speed-out").value = `${this.#speed.value} km/h`;
    this.#speed.setAttribute("aria-valuetext", `${this.#speed.value} km/h`);
    if (this.pose === "ride") this.#act("pose", Number(this.#speed.value) / 3.6);
  }

  #key(event) {
    if (event.altKey || event.ctrlKey || event.metaKey || event.target.matches?.("input")) return;
    const steps = { ArrowLeft: [-STEP_DEG, 0], ArrowRight: [STEP_DEG, 0], ArrowUp: [0, 10], ArrowDown: [0, -10] }[event.key];
    if (!steps || this.pose !== "ride") return;
    event.preventDefault();
    if (steps[0]) this.lean(Number(this.#lean.value) + steps[0]);
    else {
      this.#speed.value = Number(this.#speed.value) + steps[1];
      this.#ride();
    }
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

  /** The tilt of the phone, from how it is held when the button is pressed. */
  #tilt(button) {
    if (!("DeviceOrientationEvent" in window) || !isSecureContext || !matchMedia("(pointer: coarse)").matches) return;
    button.hidden = false;
    let zero = null;
    const follow = (event) => {
      const turned = screen.orientation?.angle ?? 0;
      const tilt = { 0: event.gamma, 90: event.beta, 180: -event.gamma, 270: -event.beta }[turned];
      if (tilt === null || tilt === undefined) return;
      zero ??= tilt;
      this.lean(tilt - zero);
    };
    button.addEventListener("click", async () => {
      const on = button.getAttribute("aria-pressed") !== "true";
      // iOS asks its user, and only after a click
      const may = on && DeviceOrientationEvent.requestPermission ? await DeviceOrientationEvent.requestPermission() : "granted";
      if (may !== "granted") return;
      button.setAttribute("aria-pressed", String(on));
      zero = null;
      if (on) {
        if (this.pose !== "ride") this.stand("ride");
        addEventListener("deviceorientation", follow);
      } else removeEventListener("deviceorientation", follow);
    });
  }
}

/** A lean in words: "12.3° left". */
export function leanText(degrees, digits = 1) {
  const size = Math.abs(degrees).toFixed(digits);
  return Number(size) === 0 ? `${size}°` : `${size}° ${degrees < 0 ? "left" : "right"}`;
}
