// The value that the page shows: a motorcycle's lean; for a car, which does not lean, the specific force sideways.
//
// value: of a moment of LiveReading (rides/stream.py), > 0 to the right, null if unknown. limit: at the ends of gauge
// and chart; mark: between two marks of the gauge, every second one with a number.

export const LEAN = {
  title: "Lean now",
  none: "no lean",
  value: ([, lean]) => lean,
  limit: 60,
  mark: 10,
  chart: { title: "lean: right is up, left is down", step: 30, unit: "°" },
  digits: 0,
  unit: "°",
  spoken: "degrees",
  // The label beside the current acceleration
  furthest: ["Most left", "Most right"],
  most: ({ max_left_deg, max_right_deg }) => [max_left_deg, max_right_deg],
};

export const SIDEWAYS = {
  title: "Sideways now",
  none: "nothing to show",
  value: ([, , , left]) => (left === null ? null : -left),
  limit: 1,
  mark: 0.25,
  chart: { title: "sideways: right is up, left is down", step: 0.5, unit: " g" },
  digits: 2,
  unit: " g",
  spoken: "g",
  furthest: ["Peak braking", "Peak acceleration"],
  most: ({ max_brake_g, max_accel_g }) => [max_brake_g, max_accel_g],
};

/** A size with its unit. */
export function written({ digits, unit }, value) {
  return `${Math.abs(value).toFixed(digits)}${unit}`;
}

/** The value with its sign; 0 has no sign. */
export function signed(value) {
  const size = Math.abs(value).toFixed(2);
  return Number(size) === 0 ? size : `${value < 0 ? "−" : "+"}${size}`;
}

/** "left" or "right", "" if the size is shown as 0. */
export function sideOf({ digits }, value) {
  if (Number(value.toFixed(digits)) === 0) return "";
  return value < 0 ? "left" : "right";
}
