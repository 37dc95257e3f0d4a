// Decodes the packets of a board's radio by the tables in firmware/docs/live.md.

export const VERSION = 1;
export const SERVICE = "7b6f0000-3c1e-4d5a-9a55-6b69636b7374";
export const [BOARD, RATE, NOW, RIDE] = [1, 2, 3, 4].map((number) => SERVICE.replace("0000", `000${number}`));
export const PERIOD_MS = 40;
export const ALIGNED = 1;
export const AT_REST = 4;
export const FALLEN = 8;
export const CAR = 32;
export const NO_READINGS = 64;

const UNKNOWN = -0x8000;

/** Decode a packet of the kind `now`. view: its DataView. Unknown numbers are null. Units: g and degrees per second. */
export function decodeNow(view) {
  const signed = (at, scale) => (view.getInt16(at, true) === UNKNOWN ? null : view.getInt16(at, true) / scale);
  const three = (at, scale) => [0, 2, 4].map((more) => signed(at + more, scale));
  const speed = view.getUint16(17, true);
  return {
    ms: view.getUint16(0, true),
    lean: signed(2, 100),
    force: three(5, 2048), // left, up, forward
    rate: three(11, 16), // about the same axes
    speed: speed === 0xffff ? null : speed / 100,
    state: view.getUint8(19),
  };
}

/** Decode a packet of the kind `ride`. view: its DataView. The result has the names in LiveReading (rides/stream.py). */
export function decodeRide(view) {
  return {
    max_left_deg: view.getUint16(2, true) / 10,
    max_right_deg: view.getUint16(4, true) / 10,
    max_accel_g: view.getUint16(6, true) / 1000,
    max_brake_g: view.getUint16(8, true) / 1000,
    trim_deg: view.getInt16(10, true) / 100,
  };
}
