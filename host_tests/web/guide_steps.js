async (ticks) => {
  const { Guide } = await import(PAGE + "/guide.mjs");
  const { shows } = await import(PAGE + "/shows.mjs");
  const guide = new Guide();
  let shown = null, view = { view: "starting" }, words = null, step = null, dark = false;
  return ticks.map((tick) => {
    shown = tick.display ? tick.display.shown_deg : shown;
    view = tick.state ?? view;
    words = shows(view)?.words ?? words;
    if (!tick.powered && !dark) guide.dark(tick.cut);
    dark = !tick.powered;
    const standing = tick.phase === tick.pose;
    step = guide.next(view, shown, tick.pose, standing, { ...tick, time: tick.t_s }) ?? step;
    return [tick.stage, words, step.number, step.text, step.action?.[1] ?? ""];
  });
}
