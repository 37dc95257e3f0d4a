// Asks which column of a table is what, and in which unit: what the options --columns and --units of `kickstand import`
// take.

const form = document.getElementById("table");

/** table: asked_for() of web/rides_guest.py. use(columns, units): is called with the answers, {key: name}. */
export function askColumns(name, table, use) {
  form.querySelector("legend").textContent = `Which column of ${name} is what?`;
  const columns = table.keys.map(([key, words, needed, found]) => {
    const none = new Option(needed ? "choose" : "none", "");
    return choice(key, words, [none, ...table.columns.map((column) => new Option(column, column))], found, needed);
  });
  const units = table.units.map(([key, words, choices, likely]) =>
    choice(key, words, choices.map(([unit, said]) => new Option(said, unit)), likely, false),
  );
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

function choice(key, words, options, chosen, needed) {
  const label = document.createElement("label");
  const select = document.createElement("select");
  select.name = key;
  select.required = needed;
  select.replaceChildren(...options);
  if (chosen) select.value = chosen;
  label.append(words, select);
  return label;
}

function answers(where) {
  const chosen = [...form.querySelectorAll(`${where} select`)].filter((select) => select.value);
  return Object.fromEntries(chosen.map((select) => [select.name, select.value]));
}
