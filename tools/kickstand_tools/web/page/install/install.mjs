// Installs the firmware and its config.py on a board at the browser's serial port, as `kickstand flash` does. Also
// shows the output of `kickstand status` and `check`. The commands run on CPython for WebAssembly
// (web/browser_board.py).

import { ASKING, choosePort, loadOnce, overCable, python, showShare } from "../cable/cable.mjs";
import { keepOffline } from "../offline.mjs";
import { offerBoards } from "./boards.mjs";
import { connectImage } from "./image.mjs";
import { Fields } from "./fields.mjs";

const byId = (id) => document.getElementById(id);
const fields = new Fields(byId("fields"), check);
const modules = loadOnce(async () => (await python()).pyimport("kickstand_tools.web.browser_board"));
let board = null; // {port, module}: an Installation of browser_board.py
let byHand = null;

function tell(text, share = null) {
  byId("install-said").textContent = text;
  showShare(byId("install-bar"), share);
}

/** Identify the board, and read its config.py. */
async function look() {
  const port = await choosePort(tell);
  if (!port) return;
  atWork(true);
  byId("config").hidden = true;
  tell("Loading the tools, 6 MB the first time …", 0);
  const tools = await modules(tell);
  if (!tools) return atWork(false);
  const module = tools.Installation();
  const said = await overCable(port, tell, (line, name) => {
    tell(ASKING, NaN);
    return module.look.callPromising(line, name);
  });
  atWork(false);
  if (!said) return;
  const { refused, board: name, settings, usual, by_hand, others } = JSON.parse(said);
  if (refused) return tell(`Not installed: ${refused}.`);
  board = { port, module };
  byHand = by_hand;
  byId("by-hand").textContent = byHand ? `The board’s own ${byHand}. It stays as it is.` : "";
  byId("settings").hidden = Boolean(byHand);
  if (!byHand) {
    fields.fill(settings, usual);
    await offerBoards(byId("shop-board"), name, (pins) => fields.set(pins)).catch((error) => tell(error.message));
  }
  byId("config").hidden = false;
  const kept = others.map((line) => `${line}. `).join("");
  tell(`${name} is there. ${kept}${byHand ? "Press" : "Look through its settings, then press"} Install.`);
  check();
}

/** Check the form by the firmware's own rules. */
function check() {
  if (byHand) return true;
  const { text, fault } = JSON.parse(board.module.check(JSON.stringify(fields.values())));
  byId("text").textContent = text;
  fields.mark(...(fault ?? [null, ""]));
  byId("fault").textContent = fault && !fault[0] ? fault[1] : "";
  byId("install").disabled = Boolean(fault);
  return !fault;
}

async function install() {
  if (!check()) return;
  const { port, module } = board;
  const wanted = JSON.stringify(byHand ? {} : fields.values());
  atWork(true);
  tell(ASKING, NaN);
  const said = await overCable(
    port,
    tell,
    (line, name) => module.install.callPromising(line, name, wanted, (what, done, total) => tell(what, done / total)),
    true, // after the board was identified
  );
  atWork(false);
  if (said) showResult(JSON.parse(said));
}

function showResult({ refused, board: name, copied, kept, config_kept }) {
  if (refused) {
    tell(`Not installed: ${refused}.`);
    return;
  }
  byId("config").hidden = true;
  const there = kept ? `, ${kept} were there already` : "";
  const files = copied ? `${copied} files copied and verified${there}` : "it was up to date";
  const config = config_kept ? " Its own config.py stays." : "";
  const next =
    "With the sensor fixed to the bike’s frame, press the push button once on the kickstand, and once upright.";
  tell(`Done: ${name}. ${files}.${config} The board starts now. ${next}`);
}

/** Show a text about the board that the rider can copy into an issue. asks(tools, line, name, say) returns a promise of
 * the text as JSON. */
async function report(asks) {
  const say = (text) => (byId("status-said").textContent = text);
  const port = await choosePort(say);
  if (!port) return;
  atWork(true);
  byId("status-shown").hidden = true;
  byId("status-text").textContent = "";
  say("Loading the tools, 6 MB the first time …");
  const tools = await modules(say);
  const said =
    tools &&
    (await overCable(port, say, (line, name) => {
      say(ASKING);
      return asks(tools, line, name, say);
    }));
  atWork(false);
  if (!said) return;
  const { text, refused } = JSON.parse(said);
  say(refused ? `${refused}.` : "The board has restarted.");
  byId("status-text").textContent = text ?? "";
  byId("status-shown").hidden = !text;
}

/** Show the output of `kickstand status`. */
const status = () => report((tools, line, name) => tools.status.callPromising(line, name));

/** Run `kickstand check`, and show its lines as they arrive, with instructions for the rider. */
const checkBoard = () =>
  report((tools, line, name, say) => {
    byId("status-shown").hidden = false;
    return tools.check.callPromising(line, name, (text) => {
      if (text.startsWith("Press")) say(text);
      else byId("status-text").textContent += `${text}\n`;
    });
  });

async function copyStatus() {
  await navigator.clipboard.writeText(byId("status-text").textContent);
  byId("status-said").textContent = "Copied.";
}

function atWork(on) {
  for (const id of ["look", "install", "fields", "shop-board", "image", "image-file", "status", "check"]) byId(id).disabled = on;
}

byId("look").addEventListener("click", look);
byId("install").addEventListener("click", install);
byId("status").addEventListener("click", status);
byId("check").addEventListener("click", checkBoard);
byId("status-copy").addEventListener("click", copyStatus);
byId("here").textContent = location.href;
connectImage(atWork);
keepOffline();
