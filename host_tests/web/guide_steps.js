async (ticks) => {
  const { Guide } = await import("./guide.mjs");
  const { shows } = await import("./shows.mjs");
  const guide = new Guide();
  let display = { text: ["", ""], shown_deg: null }, words = null, step = null, dark = false;
  return ticks.map((tick) => {
    display = tick.display ?? display;
    words = shows(display.text)?.words ?? words;
    if (!tick.powered && !dark) guide.dark(tick.cut);
    dark = !tick.powered;
    const standing = tick.phase === tick.pose;
    step = guide.next(display.text, display.shown_deg, tick.pose, standing, { ...tick, time: tick.t_s }) ?? step;
    return [tick.stage, words, step.number, step.text, step.action?.[1] ?? ""];
  });
}
