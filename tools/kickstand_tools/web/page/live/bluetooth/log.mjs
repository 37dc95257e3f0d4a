// Writes readings from Bluetooth as a log and its calibration. The log's axes are the vehicle's own, x left, y up, z
// forward, because the board has already aligned its readings.

import { CAR } from "./packets.mjs";

const IDENTITY = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

export class BluetoothLog {
  #lines = [];
  #last = -Infinity;
  #speed = null;
  #anySpeed = false;
  #car = false;
  #trim = 0;

  get seconds() {
    return this.#lines.length ? this.#last : 0;
  }

  /** Add a reading. now: from decodeNow(). s: its time in seconds. Repeated readings are left out, and also readings
   * before the alignment, because their axes are unknown. */
  take(now, s) {
    if (now.force.includes(null) || s <= this.#last) return;
    const fresh = now.speed !== this.#speed && now.speed !== null;
    this.#speed = now.speed;
    this.#anySpeed ||= fresh;
    this.#car = (now.state & CAR) !== 0;
    this.#last = s;
    const numbers = [...now.force.map((g) => g.toFixed(4)), ...now.rate.map((dps) => dps.toFixed(3))];
    this.#lines.push(`${s.toFixed(3)},${numbers.join(",")},${fresh ? now.speed.toFixed(2) : ""}`);
  }

  takeRide(ride) {
    this.#trim = ride.trim_deg;
  }

  /** Return the files as [{name, data}]. The list is empty without readings. began: a Date, the start of the log. */
  files(began) {
    if (this.#lines.length < 2) return [];
    const stem = `bluetooth-${began.toISOString().slice(0, 19).replaceAll(/[-:]/g, "").replace("T", "-")}`;
    const header = `t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps${this.#anySpeed ? ",speed_mps" : ""}`;
    const lines = this.#anySpeed ? this.#lines : this.#lines.map((line) => line.slice(0, -1));
    const calibration = {
      ...{ version: 1, accel_offset_g: [0, 0, 0], accel_slope: [1, 1, 1], gyro_bias_dps: [0, 0, 0] },
      ...{ vehicle_from_sensor: IDENTITY, six_positions: true, aligned: true, trim_deg: this.#trim },
      vehicle: this.#car ? "car" : "motorcycle",
    };
    const encode = (text) => new TextEncoder().encode(text);
    return [
      { name: `${stem}.csv`, data: encode([header, ...lines, ""].join("\n")) },
      { name: `${stem}.cal.json`, data: encode(`${JSON.stringify(calibration, null, 2)}\n`) },
    ];
  }
}
