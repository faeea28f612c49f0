// Reads the result files and checks them; every mistake is one InputError that names file, place, expected and found.
import { readFileSync } from 'node:fs';
import { join } from 'node:path';

export class InputError extends Error {}

/** Modules of this folder that need the figure packages. */
export async function loadDrawing(...files) {
  try {
    return await Promise.all(files.map((file) => import(file)));
  } catch (error) {
    if (error.code !== 'ERR_MODULE_NOT_FOUND') throw error;
    throw new InputError('the figure packages are not installed: run "npm ci" in the folder plots');
  }
}

/** The lines of a figure, in the order in which they are drawn and stand in the legend. */
export const LINES = ['measured', 'linear', 'nonlinear', 'refined'];

function describe(value) {
  if (value === undefined) return 'nothing';
  if (Array.isArray(value)) return `an array of ${value.length}`;
  const text = JSON.stringify(value);
  return text.length > 60 ? `${text.slice(0, 57)}...` : text;
}

/** A view of one JSON file that knows its own path, so that a wrong value is reported where it stands. */
export class Place {
  constructor(file, value, path = '$') {
    Object.assign(this, { file, value, path });
  }
  fail(expected) {
    throw new InputError(`${this.file}: ${this.path}: expected ${expected}, found ${describe(this.value)}`);
  }
  get(key) {
    if (this.value === null || typeof this.value !== 'object' || Array.isArray(this.value)) this.fail('an object');
    return new Place(this.file, this.value[key], `${this.path}.${key}`);
  }
  items() {
    if (!Array.isArray(this.value) || this.value.length === 0) this.fail('a non-empty array');
    return this.value.map((value, i) => new Place(this.file, value, `${this.path}[${i}]`));
  }
  text() {
    if (typeof this.value !== 'string' || this.value === '') this.fail('a text');
    return this.value;
  }
  /** So many texts, of which some may be empty. */
  texts(length) {
    if (!Array.isArray(this.value) || this.value.length !== length || this.value.some((one) => typeof one !== 'string')) this.fail(`${length} texts`);
    return this.value;
  }
  number() {
    if (!Number.isFinite(this.value)) this.fail('a number');
    return this.value;
  }
  /** A diverged model leaves null behind: a number, or null. */
  numberOrNull() {
    return this.value === null ? null : this.number();
  }
  numbers(length, allowNull = false) {
    const items = this.items();
    if (length !== undefined && items.length !== length) this.fail(`${length} numbers, one for each of $.time_s`);
    return items.map((item) => (allowNull ? item.numberOrNull() : item.number()));
  }
  equals(wanted) {
    if (this.value !== wanted) this.fail(describe(wanted));
  }
}

export function readJson(file) {
  let text;
  try {
    text = readFileSync(file, 'utf8');
  } catch (error) {
    throw new InputError(`${file}: expected a JSON file, could not read it (${error.code ?? error.message})`);
  }
  try {
    return new Place(file, JSON.parse(text));
  } catch (error) {
    throw new InputError(`${file}: expected JSON, found a mistake (${error.message})`);
  }
}

function stretch(place, from, to) {
  const [a, b] = place.numbers();
  if (place.value.length !== 2 || !(a < b) || a < from || b > to) {
    place.fail(`[from, to] in seconds, rising and inside ${from} to ${to}`);
  }
  return { from_s: a, to_s: b };
}

/** The data of the figures from DIR/figures/figures.json. */
export function readFigures(directory) {
  const root = readJson(join(directory, 'figures', 'figures.json'));
  root.get('schema').equals('wheelhop.figures/1');
  const from = root.get('from_s').number();
  const to = root.get('to_s').number();
  const time = root.get('time_s').numbers();
  const signals = root.get('signals').items().map((signal) => {
    const figure = signal.get('figure').number();
    if (!Number.isInteger(figure)) signal.get('figure').fail('the number of a figure');
    const lines = {};
    const vaf = {};
    for (const line of LINES) {
      lines[line] = signal.get(line).numbers(time.length, line !== 'measured');
      if (line !== 'measured') vaf[line] = signal.get('vaf_percent').get(line).numberOrNull();
    }
    return { figure, name: signal.get('signal').text(), title: signal.get('title').text(), unit: signal.get('unit').text(), lines, vaf };
  });
  const numbers = signals.map((signal) => signal.figure);
  if (new Set(numbers).size !== numbers.length) root.get('signals').fail('a different figure for every signal');
  return {
    realisation: root.get('realisation').number(),
    from,
    to,
    time,
    fails: stretch(root.get('fails_s'), from, to),
    doesWell: stretch(root.get('does_well_s'), from, to),
    signals,
  };
}

/** Table 1 from DIR/table1.json: checked as far as the page relies on it, everything else passed on as it is. */
export function readTable(directory) {
  const root = readJson(join(directory, 'table1.json'));
  root.get('schema').equals('wheelhop.table1/1');
  root.get('realisations').number();
  for (const row of root.get('rows').items()) {
    row.get('signal').text();
    for (const model of ['linear', 'nonlinear']) row.get('paper').get(model).number();
    for (const model of Object.keys(row.get('vaf_percent').value ?? {})) {
      for (const key of ['median', 'q05', 'q95', 'min']) row.get('vaf_percent').get(model).get(key).numberOrNull();
    }
    row.get('vaf_percent').get('linear').get('median');
  }
  if (root.value.notes !== undefined) {
    for (const note of root.get('notes').items()) for (const key of ['what', 'chosen', 'why']) note.get(key).text();
  }
  return root.value;
}
