
const CHART = JSON.parse(document.getElementById("charts").textContent);
const finger = matchMedia("(pointer: coarse)").matches, narrow = matchMedia("(max-width: 600px)").matches;
const layout = narrow ? CHART.narrow : CHART.layout;
if (finger) layout.dragmode = false; // a finger moves the page
Plotly.newPlot("chart", CHART.data, layout, { responsive: true });
if (parent !== window) {
  const postHeight = () => parent.postMessage({ height: document.body.scrollHeight }, "*"); // of the frame that it is in
  new ResizeObserver(postHeight).observe(document.body);
}
