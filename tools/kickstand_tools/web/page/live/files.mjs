// Logs that came over the cable: to be saved, and to be looked at in the page Rides.

import { leavePulled } from "../rides/pulled.mjs";

const RUNNING = Symbol("running");
const unsaved = new Set();

addEventListener("beforeunload", (event) => {
  if (unsaved.size) event.preventDefault(); // the browser asks: what is not saved is lost
});

/** on: something is under way that leaving the page would end. */
export function busy(on) {
  if (on) unsaved.add(RUNNING);
  else unsaved.delete(RUNNING);
}

/** Add a ride to the list. title: text; files: [{name, data: Uint8Array}], the log and its calibration. */
export function offer(list, title, files) {
  const item = document.createElement("li");
  item.append(Object.assign(document.createElement("strong"), { textContent: title }));
  for (const { name, data } of files) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([data]));
    link.download = link.textContent = name;
    unsaved.add(name);
    link.addEventListener("click", () => unsaved.delete(name));
    item.append(link);
  }
  const look = Object.assign(document.createElement("button"), { type: "button", textContent: "Look at it" });
  look.addEventListener("click", async () => {
    try {
      await leavePulled(files);
    } catch {
      item.setAttribute("role", "status"); // a screen reader says what takes the button's place
      const why = "This browser hands nothing from page to page, as in a private window";
      look.replaceWith(`${why}: save both, and choose them on the page Rides.`);
      return;
    }
    open("./rides.html#pulled"); // in a tab of its own: this page keeps what is not saved yet
  });
  item.append(look);
  list.prepend(item);
  list.closest("section").hidden = false;
}
