// Offers the pins that work on boards of shops. boards.json has them from the table in settings.md.

import { fetched } from "../fetched.mjs";

const chips = (text) => (text.match(/RP2\d{3}|ESP32(-?[SCHP]\d)?/g) ?? []).map((chip) => chip.replace("-", ""));

/** Return true if a board has the same chip as another board. Both are names that contain the chip's name. */
export const sameChip = (name, other) => chips(name).some((chip) => chips(other).includes(chip));

/**
 * Fill a list with the boards that have the same chip. Hide its label if there are none.
 *
 * select: the list. described: the board's name, with its chip. chosen: function that is called with {name: value as a
 * Python literal, or "" for the default} when the rider chooses a board.
 */
export async function offerBoards(select, described, chosen) {
  const boards = await (await fetched("./boards.json")).json();
  const names = Object.keys(boards).filter((name) => sameChip(name, described));
  const every = names.flatMap((name) => Object.keys(boards[name]));
  const none = Object.fromEntries(every.map((name) => [name, ""]));
  select.replaceChildren(new Option("another board", ""), ...names.map((name) => new Option(name)));
  select.parentElement.hidden = !names.length;
  select.onchange = () => chosen({ ...none, ...boards[select.value] });
}
