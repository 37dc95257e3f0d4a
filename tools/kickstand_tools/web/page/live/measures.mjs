// The measures that the page Live can show. A motorcycle's measure is its lean. A car's measure is the specific force
// sideways, because a car does not lean.
//
// value: function that returns the value of a moment of LiveReading (rides/stream.py). It is positive to the right, and
//     null if unknown.
// limit: value at the ends of gauge and chart.
// mark: distance between two marks of the gauge. Every second mark has a number.

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
  // The labels of the two maxima
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

/** Return the size of a value with its unit, without a sign. */
export function written({ digits, unit }, value) {
  return `${Math.abs(value).toFixed(digits)}${unit}`;
}

/** Return the value with its sign. 0 has no sign. */
export function signed(value) {
  const size = Math.abs(value).toFixed(2);
  return Number(size) === 0 ? size : `${value < 0 ? "−" : "+"}${size}`;
}

/** Return "left" or "right", or "" if the value is shown as 0. */
export function sideOf({ digits }, value) {
  if (Number(value.toFixed(digits)) === 0) return "";
  return value < 0 ? "left" : "right";
}
