// Shows the report of a ride in the page.

const byId = (id) => document.getElementById(id);

function element(name, ...inside) {
  const made = document.createElement(name);
  made.append(...inside);
  return made;
}

/** Show a report. words, warnings: from look() in web/browser_rides.py. name: the ride's name. */
export function showReport({ words, warnings, name, calibration }) {
  byId("report-title").textContent = name;
  byId("calibration").textContent = calibration;
  byId("too-little").textContent = words.too_little;
  byId("warnings").replaceChildren(...warnings.map((warning) => element("li", `Warning: ${warning}.`)));
  byId("figures").replaceChildren(
    ...words.ride.map(([name, ...cells]) => {
      const head = element("th", name);
      head.scope = "row";
      return element("tr", head, ...cells.map((cell) => element("td", cell)));
    }),
  );
  byId("alignment").textContent = words.alignment;
  byId("stops-frame").hidden = !words.stops.length;
  byId("stops-title").textContent = words.title;
  const heads = Object.entries(words.units).map(([name, unit]) => {
    const head = element("th", name, element("small", unit || "\u00a0"));
    head.scope = "col";
    return head;
  });
  byId("stops-head").replaceChildren(element("tr", ...heads));
  byId("stops").replaceChildren(
    ...words.stops.map((cells) => element("tr", ...cells.map((cell) => element("td", cell)))),
  );
  byId("terms").textContent = words.stops.length ? words.terms : "";
  byId("remark").textContent = words.remark;
  for (const id of ["report", "more"]) byId(id).hidden = false;
}

/** Show the charts. page: their HTML. The height of the page depends on its width. The frame is new and visible before it
 * loads. A frame that was hidden earlier may draw nothing. */
export function showCharts(page) {
  byId("charts").hidden = byId("drawing").hidden = false;
  byId("drawing").textContent = "Drawing the charts …";
  const frame = byId("plot").cloneNode();
  frame.removeAttribute("style");
  frame.srcdoc = page;
  byId("plot").replaceWith(frame);
}

// The frame may run scripts, but has no access to this page. The frame sends its height, and whether it could draw the
// charts.
addEventListener("message", ({ source, data }) => {
  if (source !== byId("plot").contentWindow) return;
  if (Number.isFinite(data?.height)) byId("plot").style.height = `${data.height}px`;
  if (data?.drawn) byId("drawing").hidden = true;
  if (data?.failed) {
    byId("drawing").textContent =
      "This browser could not draw the charts. Save them with “Charts (HTML)” and open that file in another browser.";
  }
});

export function hideRide() {
  for (const id of ["report", "charts", "more"]) byId(id).hidden = true;
  byId("plot").removeAttribute("srcdoc");
}

/** Offer the data to the browser as a file. */
export function save(name, type, content) {
  const link = element("a");
  link.href = URL.createObjectURL(new Blob([content], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
