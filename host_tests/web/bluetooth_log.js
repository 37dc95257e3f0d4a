async (packets) => {
  const { BluetoothLog } = await import(PAGE + "/live/bluetooth/log.mjs");
  const { BoardTime } = await import(PAGE + "/live/bluetooth/board_time.mjs");
  const { Stops } = await import(PAGE + "/live/bluetooth/stops.mjs");
  const { AT_REST, decodeNow, decodeRide } = await import(PAGE + "/live/bluetooth/packets.mjs");
  const [log, time, stops] = [new BluetoothLog(), new BoardTime(), new Stops()];
  for (const [atS, kind, bytes] of packets) {
    const view = new DataView(Uint8Array.from(bytes).buffer);
    if (kind === "ride") {
      log.takeRide(decodeRide(view));
      continue;
    }
    const now = decodeNow(view);
    const { s } = time.take(now.ms, 1000 * atS);
    log.take(now, s);
    stops.take(s, now.force[2], (now.state & AT_REST) !== 0);
  }
  const text = ({ name, data }) => [name, new TextDecoder().decode(data)];
  return { files: log.files(new Date(0)).map(text), stop: stops.last };
}
