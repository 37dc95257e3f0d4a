// Describes what the display shows, from the firmware's state (kickstand_sim/simulated_board/app_state.py).

// {name of a view: [its kind for the guide, a few words to show beside the true lean]}
const VIEWS = {
  off: ["dark", "nothing"],
  starting: ["starting", "starting"],
  safe: ["safe", "safe mode"],
  fault: ["fault", "a fault"],
  menu: ["menu", "the menu"],
  six: ["six", "positions"],
  info: ["info", "sensor info"],
  not_aligned: ["unaligned", "not aligned"],
  lean: ["lean", "not sure"],
  maxima: ["maxima", "maxima"],
  acceleration: ["force", "g"],
  formula: ["formula", "formula"],
  raw: ["readings", "readings"],
  recording: ["recording", "recording"],
};
// Pages that show no value while the firmware does not trust the lean
const DOUBTED = ["lean", "maxima", "acceleration", "formula", "raw"];
const ALIGNING = {
  ask: { kickstand: "ask-stand", upright: "ask-upright" },
  take: { kickstand: "take-stand", upright: "take-upright" },
};

/**
 * Return {kind, words}, or null for an unknown view. state: the result of PageDevice.state() in web/device.py. The kind
 * is "lean" if the display shows the lean.
 */
export function shows(state) {
  if (state.view === "notice" && state.code === "stopped") return { kind: "stopped", words: "a fault" };
  const found = state.view === "align" ? aligning(state) : VIEWS[viewOf(state)];
  return found ? { kind: found[0], words: found[1] } : null;
}

function viewOf({ view, code, fault, trusted }) {
  if (view === "fault" && code === "starting") return "starting";
  if (view === "notice" && code && code === fault) return "fault";
  if (DOUBTED.includes(view) && !trusted) return "lean";
  return view;
}

function aligning({ step, code, pose }) {
  if (step === "result") return ["aligned", "aligned"];
  if (step === "refused") return ["unlike", "refused"];
  return code ? ["spoilt", "refused"] : [ALIGNING[step][pose], "aligning"];
}
