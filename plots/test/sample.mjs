// A small result folder: sines of which the linear model follows only the second half.
import { mkdirSync, mkdtempSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

const COUNT = 50;
const NAMES = [
  ['suspension_displacement', 'Suspension displacement', 'm', 0.03],
  ['chassis_acceleration', 'Chassis acceleration', 'm/s^2', 6],
  ['axle_acceleration', 'Axle acceleration', 'm/s^2', 50],
];

export function figuresData() {
  const time_s = Array.from({ length: COUNT }, (_, k) => 12.8 + k / COUNT);
  const signals = NAMES.map(([signal, title, unit, size], i) => {
    const measured = time_s.map((_, k) => size * Math.round(1000 * Math.sin(k / 3)) / 1000);
    const scaled = (factor) => measured.map((value) => factor * value);
    return {
      signal, figure: 4 + i, title, unit, measured,
      linear: measured.map((value, k) => (k < COUNT / 2 ? 0.4 * value : value)),
      nonlinear: scaled(0.95), refined: scaled(0.9999),
      vaf_percent: { linear: 75.04, nonlinear: 99.1, refined: 99.9997 },
    };
  });
  return {
    schema: 'wheelhop.figures/1', realisation: 3, from_s: 12.8, to_s: 13.8, fails_s: [12.8, 13.2], does_well_s: [13.5, 13.8],
    time_s, signals,
  };
}

export function tableData() {
  const statistics = (median) => ({ median, q05: median - 2, q95: median - 1, min: median - 3, n_ok: 4, n: 5 });
  return {
    schema: 'wheelhop.table1/1',
    realisations: 5,
    rows: NAMES.map(([signal]) => ({
      signal,
      paper: { linear: 75.0, nonlinear: 95.4 },
      vaf_percent: {
        linear: statistics(74.3), nonlinear: statistics(99.2), refined: statistics(99.9997),
        as_printed: { median: null, q05: null, q95: null, min: null },
      },
    })),
    notes: [{ what: 'Length of the records', chosen: '60 s', why: 'shorter <records> lose the body mode' }],
    config: { plant: 'quarter_car', estimation: { length_s: 60 } },
    provenance: { version: '0.1.0', master_seed: 1 },
  };
}

/** A result folder with these two files; a string is written as it stands. */
export function folder(figures = figuresData(), table = tableData()) {
  const directory = mkdtempSync(join(tmpdir(), 'wheelhop plots '));
  mkdirSync(join(directory, 'figures'));
  const text = (value) => (typeof value === 'string' ? value : JSON.stringify(value));
  if (figures !== null) writeFileSync(join(directory, 'figures', 'figures.json'), text(figures));
  if (table !== null) writeFileSync(join(directory, 'table1.json'), text(table));
  return directory;
}
