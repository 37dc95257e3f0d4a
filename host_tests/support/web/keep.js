// Let the page Try draw ten pictures per second. Sixty would take half of the processor while its board runs.
if (/\/(index.html)?$/.test(location.pathname)) {
  const drawn = requestAnimationFrame;
  window.requestAnimationFrame = (draw) => setTimeout(() => drawn(draw), 100);
}
const Real = Worker;
window.seen = { displays: [], orders: [], rates: [], shifts: [], last: null };
window.Worker = class extends Real {
  constructor(...given) {
    super(...given);
    this.addEventListener("message", ({ data }) => {
      for (const tick of data.ticks ?? []) {
        seen.last = tick;
        if (tick.display) seen.displays.push([tick.t_s, tick.display]);
      }
      seen.orders.push(...(data.orders ?? []));
      if (data.rate !== undefined) seen.rates.push(data.rate);
    });
  }
};
new PerformanceObserver((list) => {
  for (const entry of list.getEntries()) {
    const moved = entry.sources.map((one) => [
      one.node?.id || one.node?.className || one.node?.nodeName, one.previousRect.toJSON(), one.currentRect.toJSON(),
    ]);
    seen.shifts.push([entry.value, entry.startTime, ...moved]);
  }
}).observe({ type: "layout-shift", buffered: true });
