// How numbers, units and names are written.

export function escape(text) {
  return String(text).replace(/[&<>"']/g, (c) => `&#${c.charCodeAt(0)};`);
}

/** One decimal as in the paper; more only where rounding would hide what is left to 100 %. */
export function vafText(value) {
  if (value === null || value === undefined) return 'failed';
  if (value === 100) return '100';
  const left = 100 - value;
  const decimals = left >= 0.5 ? (value <= -100 ? 0 : 1) : Math.min(4, Math.ceil(-Math.log10(left)) + 1);
  return value.toFixed(decimals).replace('-', '\u2212');
}

export function percent(value) {
  return value === null || value === undefined ? vafText(value) : `${vafText(value)} %`;
}

export function unitText(unit) {
  return unit.replace(/\^2\b/g, '\u00b2').replace(/\^3\b/g, '\u00b3');
}

/** suspension_displacement -> Suspension displacement */
export function nameText(name) {
  const words = name.replace(/_/g, ' ');
  return words.charAt(0).toUpperCase() + words.slice(1);
}

/** Seconds to the millisecond, without the dust of binary fractions. */
export function seconds(value) {
  return String(Math.round(value * 1000) / 1000);
}
