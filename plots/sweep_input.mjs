// Reads the tables of a sweep and keeps what its page shows.
import { existsSync } from 'node:fs';
import { join } from 'node:path';
import { readJson } from './input.mjs';

/** The columns that a sweep is read by, first to last, by its measure. */
const READ_BY = {
  linear: [/^linear_vaf_/],
  inversion: [/^inversion_r2$/, /^trusted_share$/],
  nonlinear: [/^nonlinear_vaf_/, /^linear_vaf_/],
  refined: [/^refined_vaf_/, /^nonlinear_vaf_/, /^linear_vaf_/],
  solver: [/^map_cost$/, /^joint_cost$/, /^map_evaluations$/, /^joint_evaluations$/],
};

/** @returns {{measure, axes, zips, columns, cells, excluded, comparison, until, provenance, effective}} */
export function readSweep(directory) {
  const root = readJson(join(directory, 'table.json'));
  root.get('schema').equals('wheelhop.table/2');
  const grid = root.get('grid');
  const measure = grid.get('measure').text();
  const axes = grid.get('axes').items().map((axis) => axis.get('name').text());
  const zips = grid.get('axes').items().map((axis) => axis.value.zip ?? null);
  const cells = root.get('cells').items().map((cell) => {
    const columns = {};
    for (const [name, value] of Object.entries(cell.get('columns').value ?? {}))
      columns[name] = [value.median, value.q05, value.q95, value.worst, value.n_ok, value.n];
    return {
      at: axes.map((axis) => cell.value[axis]),
      n: cell.get('n').number(),
      ok: cell.get('n_ok').number(),
      failures: cell.value.failures ?? [],
      columns,
    };
  });
  const seen = new Set(cells.flatMap((cell) => Object.keys(cell.columns)));
  const patterns = READ_BY[measure] ?? [];
  const rank = (column) => {
    const at = patterns.findIndex((pattern) => pattern.test(column));
    return at < 0 ? patterns.length : at;
  };
  const columns = [...seen].sort((a, b) => rank(a) - rank(b));
  const file = join(directory, 'compare.json');
  let comparison = root.value.comparison ?? null;
  if (existsSync(file)) {
    const compared = readJson(file);
    compared.get('schema').equals('wheelhop.compare/1');
    comparison = compared.value;
  }
  return {
    measure, axes, zips, columns, cells, comparison,
    excluded: root.value.excluded_cells ?? 0,
    until: root.value.until ?? null,
    provenance: root.value.provenance,
    effective: root.value.grid,
  };
}
