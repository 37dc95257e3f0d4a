// Offers logs that came from a board. The rider saves them, or opens them in the page Rides.

import { leavePulled } from "../rides/pulled.mjs";

const RUNNING = Symbol("running");
const unsaved = new Set();

addEventListener("beforeunload", (event) => {
  if (unsaved.size) event.preventDefault(); // the browser asks, because unsaved data is lost
});

/** Record whether work is in progress that would end if the rider left the page. on: true or false. */
export function busy(on) {
  if (on) unsaved.add(RUNNING);
  else unsaved.delete(RUNNING);
}

/** Add a ride to the list. title: a text. files: [{name, data: Uint8Array}] of the log and its calibration. */
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
      item.setAttribute("role", "status"); // a screen reader reads the text that replaces the button
      const why = "This browser hands nothing from page to page, as in a private window";
      look.replaceWith(`${why}: save both, and choose them on the page Rides.`);
      return;
    }
    open("./rides.html#pulled"); // in a new tab, because this page still has unsaved data
  });
  item.append(look);
  list.prepend(item);
  list.closest("section").hidden = false;
}
