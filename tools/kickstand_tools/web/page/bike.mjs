// Draws the motorcycle from behind, and the scale of its lean. Units: centimetres. The rear tyre touches the road at
// 0, 0, and y points down.

const RADIUS = 196; // radius of the scale
const LIMIT = 60; // lean at the scale's ends, in degrees

const BIKE = `
<g id="body">
  <path class="stand" d="M-7-30 L-36-9" />
  <rect class="tyre" x="-10" y="-64" width="20" height="64" rx="10"/>
  <path class="tread" d="M-4-60V-6M4-60V-6"/>
  <g class="both"><path class="arm" d="M12-36H16V-60H12Z"/><path class="frame" d="M-38-116l6 9M38-116l-6 9"/></g>
  <path class="frame" d="M-34-106C-22-110 22-110 34-106"/>
  <ellipse class="mirror" cx="-40" cy="-121" rx="8" ry="5.5"/><ellipse class="mirror" cx="40" cy="-121" rx="8" ry="5.5"/>
  <path class="screen" d="M-19-104C-18-126-9-134 0-134S18-126 19-104Z"/>
  <path class="tank" d="M-21-104C-24-92-20-80-14-76H14C20-80 24-92 21-104Z"/>
  <rect class="exhaust" x="13" y="-58" width="15" height="24" rx="7.5"/><circle class="pipe" cx="20.5" cy="-44" r="4.5"/>
  <rect class="grip" x="-40" y="-110" width="12" height="6" rx="3"/><rect class="grip" x="28" y="-110" width="12" height="6" rx="3"/>
  <g class="rider">
    <g class="down">
      <path class="leg" d="M-11-92C-26-84-30-58-31-8M11-92C26-84 30-58 31-8"/>
      <path class="boot" d="M-37-5H-25M25-5H37"/>
    </g>
    <g class="up">
      <path class="leg" d="M-11-92C-30-92-33-76-22-52M11-92C30-92 33-76 22-52"/>
      <path class="boot" d="M-25-46H-16M16-46H25"/>
    </g>
    <path class="sleeve" d="M-21-131C-33-126-37-116-33-107M21-131C33-126 37-116 33-107"/>
    <path class="jacket" d="M-15-88C-19-104-25-122-24-131C-22-140-12-143 0-143S22-140 24-131C25-122 19-104 15-88Z"/>
    <path class="stripe" d="M-21-124C-8-118 8-118 21-124"/>
    <circle class="helmet" cx="0" cy="-155" r="15"/>
    <path class="stripe" d="M0-170V-141"/>
  </g>
  <path class="tail" d="M-17-92C-8-97 8-97 17-92L11-74H-11Z"/>
  <rect class="light" id="light" x="-10" y="-88" width="20" height="6" rx="3"/>
  <path class="indicator" d="M-24-81h7M17-81h7"/>
  <rect class="plate" x="-10" y="-73" width="20" height="12" rx="1.5"/><text class="number" x="0" y="-64.4">KS 1</text>
</g>`;

export class Bike {
  #svg;
  #body;
  #light;
  #truth;
  #shown;

  constructor(svg) {
    this.#svg = svg;
    svg.innerHTML = `<g class="scale">${scale()}</g><ellipse class="shadow" cx="0" cy="1" rx="46" ry="5"/>
      <path class="truth" d="M0 0V${-RADIUS + 4}"/>${BIKE}
      <path class="shown" d="M0 ${-RADIUS + 5}l-9-19h18z" visibility="hidden"/>`;
    this.#body = svg.querySelector("#body");
    this.#light = svg.querySelector("#light");
    this.#truth = svg.querySelector(".truth");
    this.#shown = svg.querySelector(".shown");
  }

  /** lean: the true lean in degrees, positive to the right. shown: the display's lean, or null if it shows none. pose:
   * "kickstand", "upright" or "ride". */
  draw(lean, shown, pose, speed, braking) {
    this.#body.setAttribute("transform", `rotate(${lean.toFixed(2)})`);
    this.#truth.setAttribute("transform", `rotate(${lean.toFixed(2)})`);
    this.#shown.setAttribute("visibility", shown === null ? "hidden" : "visible");
    if (shown !== null) this.#shown.setAttribute("transform", `rotate(${shown})`);
    this.#svg.dataset.rider = pose === "kickstand" && speed < 1 ? "off" : speed < 2 ? "standing" : "riding";
    this.#light.classList.toggle("braking", braking);
  }
}

function scale() {
  const at = (deg, radius) => {
    const angle = (deg * Math.PI) / 180;
    return `${(radius * Math.sin(angle)).toFixed(1)} ${(-radius * Math.cos(angle)).toFixed(1)}`;
  };
  let text = `<path class="arc" d="M${at(-LIMIT, RADIUS)}A${RADIUS} ${RADIUS} 0 0 1 ${at(LIMIT, RADIUS)}"/>`;
  for (let deg = -LIMIT; deg <= LIMIT; deg += 10) {
    const long = deg % 20 === 0;
    text += `<path class="mark" d="M${at(deg, RADIUS)}L${at(deg, RADIUS - (long ? 14 : 8))}"/>`;
    if (long) text += `<text x="${at(deg, RADIUS - 26).replace(" ", '" y="')}" dy="4">${Math.abs(deg)}</text>`;
  }
  return text;
}
