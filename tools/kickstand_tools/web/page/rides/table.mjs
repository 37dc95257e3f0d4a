// Asks the visitor for the meanings and units of a table's columns. The answers are the values of the options --columns
// and --units of `kickstand import`.

const form = document.getElementById("table");

/** Ask about a table. table: from asked_for() of web/browser_rides.py. use(columns, units) is called with the answers.
 * Each is {key: name}. */
export function askColumns(name, table, use) {
  form.querySelector("legend").textContent = `Which column of ${name} is what?`;
  const columns = table.keys.map(([key, words, needed, found]) => {
    const none = new Option(needed ? "choose" : "none", "");
    return choice(key, words, [none, ...table.columns.map((column) => new Option(column, column))], found, needed);
  });
  const units = table.units.map(([key, words, choices, likely, why]) => {
    const none = new Option("not known", "");
    return choice(key, words, [none, ...choices.map(([unit, said]) => new Option(said, unit))], likely, false, why);
  });
  form.querySelector("#first-seconds").replaceChildren(...drawn(table.picture));
  form.querySelector("#columns").replaceChildren(...columns);
  form.querySelector("#units").replaceChildren(...units);
  form.onsubmit = (event) => {
    event.preventDefault();
    const chosenColumns = answers("#columns");
    const chosenUnits = answers("#units");
    if (!chosenColumns.speed) delete chosenUnits.speed;
    use(chosenColumns, chosenUnits);
  };
  form.hidden = false;
}

export function askNothing() {
  form.hidden = true;
}

/** Draw the first seconds of each sensor in a small chart, so the visitor can check the choice of columns. */
function drawn({ t = [], ...sensors }) {
  const words = { a: "acceleration", g: "rates" };
  return Object.entries(sensors).map(([key, axes]) => {
    const figure = document.createElement("figure");
    const caption = document.createElement("figcaption");
    caption.textContent = `${words[key]}, first ${Math.round(t.at(-1) ?? 0)} s`;
    figure.append(caption, chart(t, axes));
    return figure;
  });
}

function chart(t, axes) {
  const NS = "http://www.w3.org/2000/svg";
  const svg = document.createElementNS(NS, "svg");
  svg.setAttribute("viewBox", "0 0 300 80");
  svg.setAttribute("role", "img");
  const all = axes.flat();
  const [low, high] = [Math.min(...all), Math.max(...all)];
  svg.setAttribute("aria-label", `x, y and z between ${low.toPrecision(3)} and ${high.toPrecision(3)}`);
  axes.forEach((values, axis) => {
    const line = document.createElementNS(NS, "polyline");
    const place = (value, k) => `${(300 * (t[k] - t[0])) / (t.at(-1) - t[0] || 1)},${76 - (72 * (value - low)) / (high - low || 1)}`;
    line.setAttribute("points", values.map(place).join(" "));
    line.setAttribute("class", `axis-${axis}`);
    svg.append(line);
  });
  return svg;
}

function choice(key, words, options, chosen, needed, why = "") {
  const label = document.createElement("label");
  const select = document.createElement("select");
  select.name = key;
  select.required = needed;
  select.replaceChildren(...options);
  if (chosen) select.value = chosen;
  label.append(words, select);
  if (why) {
    const reason = document.createElement("small");
    reason.textContent = why;
    label.append(reason);
  }
  return label;
}

function answers(where) {
  const chosen = [...form.querySelectorAll(`${where} select`)].filter((select) => select.value);
  return Object.fromEntries(chosen.map((select) => [select.name, select.value]));
}
