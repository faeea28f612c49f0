// Reads a diagnosis and the data of its figures, and checks them as far as the page relies on them.
import { existsSync } from 'node:fs';
import { InputError, readJson } from './input.mjs';

export const DIAGNOSIS = 'wheelhop.diagnosis/1';
export const STAGES = { as_delivered: 'as delivered', retuned: 're-tuned', with_effect: 'with the answer' };

/** "D.json" -> "D.figures.json" */
const figuresBeside = (file) => file.replace(/\.[^./\\]*$/, '') + '.figures.json';

/** A list that may be absent or empty. */
function list(place) {
  return place.value === undefined || place.value === null || place.value.length === 0 ? [] : place.items();
}

function checkSegment(segment) {
  if (segment.value === null) return;
  segment.get('record').text();
  const time = segment.get('time_s').numbers();
  for (const channel of segment.get('channels').items()) {
    for (const key of ['channel', 'unit']) channel.get(key).text();
    channel.get('noise_std').number();
    channel.get('measured').numbers(time.length);
    for (const stage of Object.keys(STAGES))
      if (channel.value[stage] !== undefined) channel.get(stage).numbers(time.length, true);
  }
}

function checkSignal(signal) {
  if (signal.value === null) return;
  signal.get('location').text();
  const count = signal.get('value').numbers().length;
  for (const axis of list(signal.get('axes'))) {
    axis.get('name').text();
    axis.get('values').numbers(count);
    for (const pair of axis.get('medians').items()) pair.numbers(2);
  }
}

/** The diagnosis and its figures' data. */
export function readDiagnosis(file) {
  const root = readJson(file);
  root.get('schema').equals(DIAGNOSIS);
  if (!existsSync(figuresBeside(file)))
    throw new InputError(
      `${figuresBeside(file)}: the data of the page are not here; "wheelhop diagnose ... --report PAGE.html" writes them beside the diagnosis`);
  root.get('verdict').text();
  if (root.value.status !== 'ok') throw new InputError(`${file}: $.status: expected a diagnosis that is ok to draw, found ${JSON.stringify(root.value.status)}`);
  root.get('answer').text();
  for (const channel of root.get('how_far').get('per_channel').items()) {
    channel.get('channel').text();
    for (const stage of Object.keys(STAGES)) channel.get('misfit').get(stage).numberOrNull();
  }
  for (const band of list(root.get('how_far').get('per_band'))) {
    band.get('from_hz').number();
    band.get('to_hz').number();
    for (const stage of Object.keys(STAGES)) band.get('excess').get(stage).numberOrNull();
  }
  for (const slice of list(root.get('where').get('time'))) {
    slice.get('record').text();
    for (const key of ['from_s', 'to_s', 'excess']) slice.get(key).number();
  }
  for (const place of list(root.get('where').get('without_catalogue'))) {
    place.get('location').text();
    place.get('leftover_chi2').number();
  }
  for (const pair of list(root.get('where').get('two_places'))) {
    for (const location of pair.get('locations').items()) location.text();
    pair.get('leftover_chi2').number();
  }
  for (const effect of list(root.get('which').get('effects'))) {
    for (const key of ['effect', 'location']) effect.get(key).text();
    effect.get('probability').number();
  }
  const view = root.get('view');
  view.get('heading').text();
  for (const note of list(view.get('notes'))) note.text();
  for (const table of view.get('tables').items()) {
    for (const key of ['id', 'caption']) table.get(key).text();
    const columns = table.get('columns').items().length;
    table.get('columns').texts(columns);
    for (const row of table.get('rows').items()) row.texts(columns);
  }
  const figures = readJson(figuresBeside(file));
  figures.get('schema').equals('wheelhop.diagnosis_figures/1');
  checkSegment(figures.get('segment'));
  checkSignal(figures.get('unknown_signal'));
  for (const variable of list(figures.get('regions'))) {
    variable.get('variable').text();
    for (const bin of variable.get('bins').items())
      for (const key of ['from', 'to', 'share', 'time_share']) bin.get(key).number();
  }
  return { diagnosis: root.value, figures: figures.value };
}
