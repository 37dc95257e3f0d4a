
const CHART = JSON.parse(document.getElementById("charts").textContent);
const finger = matchMedia("(pointer: coarse)").matches, narrow = matchMedia("(max-width: 600px)").matches;
const layout = narrow ? CHART.narrow : CHART.layout;
if (finger) layout.dragmode = false; // a finger moves the page
const FEW = { responsive: true, displaylogo: false, modeBarButtons: [["resetScale2d", "toImage"]] };
const drawn = (async () => Plotly.newPlot("chart", CHART.data, layout, FEW))(); // async: an error rejects the promise
if (parent !== window) {
  const post = (message) => parent.postMessage(message, "*"); // to the page whose frame it is in
  const postHeight = () => post({ height: document.body.scrollHeight });
  postHeight(); // the observer does not report while the frame is out of sight
  new ResizeObserver(postHeight).observe(document.body);
  drawn.then(() => post({ drawn: true }), () => post({ failed: true }));
}

// The values under the mouse, in one line beside it: "0:55, 41° left"
const two = (n) => String(n).padStart(2, "0");
const clock = (t, s = Math.round(t)) => (s >= 3600 ? `${Math.floor(s / 3600)}:${two(Math.floor(s / 60) % 60)}` : Math.floor(s / 60)) + ":" + two(s % 60);
const sided = (value, digits, unit, less, more) => {
  const size = Math.abs(value).toFixed(digits);
  return `${size}${unit}${Number(size) ? ` ${value < 0 ? less : more}` : ""}`;
};
const both = (x, y) => `${sided(x, 2, " g", "left", "right")}, ${sided(y, 2, " g", "braking", "acceleration")}`;
const lean = ({ x, y }) => [clock(x), sided(y, 0, "°", "left", "right")];
const SAID = {
  left: lean,
  right: lean,
  speed: ({ x, y }) => [clock(x), `${y.toFixed(0)} km/h`],
  "to the left": ({ x, y }) => [clock(x), sided(y, 2, " g", "to the right", "to the left")],
  forward: ({ x, y }) => [clock(x), sided(y, 2, " g", "braking", "acceleration")],
  share: ({ x, y }) => [sided(x, 0, "°", "left", "right"), `${y.toFixed(1)} %`],
  "seconds, log10": ({ x, y, z }) => [both(x, y), `${(10 ** z).toFixed(2)} s`],
  straights: ({ x, y }) => [both(x, y)],
};
// In charts over time, show the moment under the mouse: a straight line has points only at its ends
const OVER_TIME = ["left", "right", "speed", "to the left", "forward"];
(function () {
  const chart = document.getElementById("chart"), tip = document.getElementById("tip");
  chart.on("plotly_hover", function ({ points, event, xvals }) {
    if (!event) return; // the mouse is over the map, and map.js shows the values
    const empty = ({ y, data }) => y === null || !SAID[data.name] || (y === 0 && points.length > 1 && ["left", "right"].includes(data.name));
    const at = (point) => (xvals && OVER_TIME.includes(point.data.name) ? { ...point, x: xvals[0] } : point);
    const said = points.flatMap((point) => (empty(point) ? [] : SAID[point.data.name](at(point))));
    tip.textContent = [...new Set(said)].join(", ");
    tip.hidden = !said.length;
    const room = document.documentElement.clientWidth - tip.offsetWidth - 8;
    tip.style.left = `${Math.max(0, Math.min(event.pageX + 14, room))}px`;
    tip.style.top = `${event.pageY - 34}px`;
  });
  chart.on("plotly_unhover", function () {
    tip.hidden = true;
  });
})();
