// The map of a ride, linked with its charts. Plotly draws both. The page gives CHART_AXES, the names of the time axes of
// the charts, and TILES: null, or where tiles of a map come from and what the map's origin is.
const { map: MAP, axes: CHART_AXES, tiles: TILES } = JSON.parse(document.getElementById("map-data").textContent);
if (finger) MAP.layout.dragmode = false;
Plotly.newPlot("map", MAP.data, MAP.layout, { ...FEW, scrollZoom: true });
(function () {
  const map = document.getElementById("map"), chart = document.getElementById("chart"), text = document.getElementById("here");
  const x = map.data[0].x, y = map.data[0].y, rows = map.data[0].customdata;
  let shown = -1, waiting = false, scaled = "";

  function nearest(t) {
    let low = 0, high = rows.length - 1;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (rows[middle][0] < t) low = middle + 1; else high = middle;
    }
    return low > 0 && t - rows[low - 1][0] < rows[low][0] - t ? low - 1 : low;
  }

  function words(row, t) {
    const lean = row[1] === null ? "" : "  ·  lean " + Math.abs(row[1]).toFixed(0) + "°" + (row[1] >= 0.5 ? " right" : row[1] <= -0.5 ? " left" : "");
    return clock(t) + lean + (row[2] === null ? "" : "  ·  " + row[2].toFixed(0) + " km/h");
  }

  function show(k, t) {
    text.textContent = words(rows[k], t);
    if (k === shown) return;
    shown = k;
    if (waiting) return;
    waiting = true; // one change of the map in each frame of the screen is enough
    requestAnimationFrame(function () {
      waiting = false;
      if (x[shown] === null) return; // in a gap of the positions
      Plotly.relayout(map, { "shapes[0].xanchor": x[shown], "shapes[0].yanchor": y[shown] });
    });
  }

  chart.on("plotly_hover", function (event) {
    const point = event.points.find((one) => CHART_AXES.includes(one.xaxis._id));
    const t = event.xvals ? event.xvals[0] : point?.x;
    if (point) show(nearest(t), t);
  });
  map.on("plotly_hover", function (event) {
    const k = nearest(event.points[0].customdata);
    show(k, rows[k][0]);
    Plotly.Fx.hover(chart, { xval: rows[k][0] }, CHART_AXES.map((name) => name + name.replace("x", "y")));
  });

  // The bar of the scale: 1, 2 or 5 times a power of ten, at most three tenths of the map's width.
  function scale() {
    const now = [...map.layout.xaxis.range, ...map.layout.yaxis.range, map.clientWidth].join();
    if (now === scaled) return; // the change below causes another draw
    scaled = now;
    const width = map.layout.xaxis.range[1] - map.layout.xaxis.range[0], most = 0.3 * width;
    const ten = Math.pow(10, Math.floor(Math.log10(most)));
    const metres = ten * [5, 2, 1].find((n) => n * ten <= most);
    const change = { "shapes[1].x1": 0.02 + metres / width };
    change["annotations[0].text"] = metres >= 1000 ? metres / 1000 + " km" : metres + " m";
    if (TILES) change.images = tiles();
    Plotly.relayout(map, change);
  }

  // Mercator's world is a square of 256 pixels at zoom 0, and twice as wide at each further zoom.
  function tiles() {
    const xs = map.layout.xaxis.range, ys = map.layout.yaxis.range;
    const zoom = Math.max(0, Math.min(TILES.most, Math.round(Math.log2(TILES.world_m / 256 / ((xs[1] - xs[0]) / map.clientWidth)))));
    const count = Math.pow(2, zoom), size = TILES.world_m / count, images = [];
    const column = (m) => Math.floor((m + TILES.west_m) / size), row = (m) => Math.floor((TILES.north_m - m) / size);
    for (let i = column(xs[0]); i <= column(xs[1]); i++) {
      for (let j = Math.max(0, row(ys[1])); j <= Math.min(count - 1, row(ys[0])); j++) {
        const url = TILES.url.replace("{z}", zoom).replace("{x}", ((i % count) + count) % count).replace("{y}", j);
        images.push({ source: url, xref: "x", yref: "y", x: i * size - TILES.west_m, y: TILES.north_m - j * size,
                      sizex: size, sizey: size, sizing: "stretch", layer: "below" });
      }
    }
    return images;
  }

  map.on("plotly_afterplot", scale);
  Plotly.Plots.resize(map); // the text below takes height from the map, which is already drawn
  text.textContent = words(rows[0], rows[0][0]);
})();
