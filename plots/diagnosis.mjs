// The page of a diagnosis: one HTML text with everything inside, nothing asked of any server.
import { readFileSync } from 'node:fs';
import { STAGES } from './diagnosis_input.mjs';
import { facts } from './report.mjs';
import { escape, nameText, unitText } from './text.mjs';

const percent = (share) => (Number.isFinite(share) ? `${(100 * share).toFixed(share > 0.995 && share < 1 ? 1 : 0).replace(/^-0$/, '0').replace('-', '\u2212')} %` : '\u2013');
const short = (value) => (Number.isFinite(value) ? String(Number(value.toPrecision(3))).replace('-', '\u2212') : '\u2013');

function table(caption, head, rows) {
  const isNumber = (value) => /^[\u2212\d\u2013]/.test(value);
  const cell = (value, i) => (i === 0 ? `<th scope="row">${value}</th>` : `<td${isNumber(value) ? ' class="num"' : ''}>${value}</td>`);
  const over = (i) => (i > 0 && rows.every((row) => isNumber(row[i])) ? ' class="num"' : '');
  return `<div class="scroll" role="region" aria-label="${escape(caption)}" tabindex="0"><table>
<caption>${escape(caption)}</caption>
<thead><tr>${head.map((name, i) => `<th scope="col"${over(i)}>${escape(name)}</th>`).join('')}</tr></thead>
<tbody>
${rows.map((row) => `<tr>${row.map(cell).join('')}</tr>`).join('\n')}
</tbody></table></div>`;
}

/** coulomb_friction@suspension -> coulomb friction at suspension */
const namedText = (name) => name.replace('@', ' at ').replace(/^[^ ]+/, (effect) => effect.replace(/_/g, ' '));

/** a, b and c */
const listText = (items) => items.reduce((text, item, i) => text + (i === 0 ? '' : i + 1 === items.length ? ' and ' : ', ') + item, '');

const parameterText = ({ name, value, ci90 }) =>
  `${escape(name.slice(name.lastIndexOf('.') + 1))} = ${short(value)}${ci90 ? ` <small>[${short(ci90[0])}, ${short(ci90[1])}]</small>` : ''}`;

function effects({ which }) {
  if (!which.effects?.length) return '';
  const shared = which.effects.some(({ share }) => Number.isFinite(share));
  const rows = which.effects.map(({ effect, location, probability, misfit, closure, share, parameters }) => [
    `${escape(nameText(effect))} at ${escape(location)}`, probability.toFixed(2), short(misfit), percent(closure),
    ...(shared ? [percent(share)] : []), (parameters ?? []).map(parameterText).join('<br>'),
  ]);
  return `<h2>Which effect</h2>\n${table(
    `Every suspect that was fitted in full, best first. Misfit: mean squared error over the noise\u2019s on held-out records, 1 is the floor. 90 % intervals in brackets.${shared ? ' Share: what each effect named contributes to what all remove together (Shapley\u2019s value).' : ''}`,
    ['Effect', 'Probability', 'Misfit', 'Removes', ...(shared ? ['Share'] : []), 'Parameters'], rows)}`;
}

/** Pairs of places, where no single one explains all channels. */
function twoPlaces({ where }) {
  const pairs = where.two_places ?? [];
  if (pairs.length === 0) return '';
  const rows = pairs.slice(0, 5).map(({ locations, leftover_chi2 }) => [locations.map(escape).join(' and '), short(leftover_chi2)]);
  const says = { 1: ', unless a force there jumps. Two at once do:', 2: '. Two at once do:' }[where.places_needed] ?? ', nor do two:';
  return table(`No single place explains all channels${says} what an unknown signal at each of them would leave; 1 is the noise.`, ['Places', 'Leaves'], rows);
}

function howFar({ how_far }) {
  const stages = Object.keys(STAGES);
  const rows = [['Misfit, all channels', ...stages.map((key) => short(how_far[key]?.misfit)), '1']];
  for (const { channel } of how_far.per_channel)
    rows.push([escape(channel), ...[...stages, 'floor'].map((key) => `${short(100 * how_far[key]?.nrmse?.[channel])} %`)]);
  const from = how_far.judged_from_s > 0 ? ` from ${how_far.judged_from_s} s on` : '';
  return table(`${how_far.held_out ? 'On held-out records' : 'On the records fitted, too kind'}${from}. Misfit: mean squared error over the noise\u2019s (${how_far.floor.source}). A channel: RMS error over its RMS.`,
    ['', ...Object.values(STAGES).map((stage) => stage.charAt(0).toUpperCase() + stage.slice(1)), 'Noise'], rows);
}

/** Re-tuning, answer, static map, any signal: how far each kind of answer goes. */
function ceiling({ how_far, which }) {
  const { ceiling: own, as_delivered, retuned, with_effect } = how_far;
  if (!own) return '';
  const whole = as_delivered.misfit - 1, left = retuned.misfit - 1, known = own.absent === undefined, more = left > 0.1;
  const row = (what, remains) => [what, percent(1 - remains / whole), ...(more ? [percent(1 - remains / left)] : [])];
  const rows = [row('Re-tuning inside the tolerances alone', left)];
  const outside = which.named.some((name) => /^(unknown|exogenous_force)@/.test(name));
  if (with_effect?.misfit > 0) rows.push(row(outside ? 'With the best suspect' : 'With the answer', with_effect.misfit - 1));
  if (known)
    rows.push(row(`With a static map of travel and rate at ${escape(own.location)}, at best`, left * (1 - own.static_map)), row(`With any signal at ${escape(own.location)}`, left * (1 - own.signal)));
  return table(`How far the gap shrinks. ${known
    ? 'A static map is what a neural network of the place\u2019s motion can be; what any signal removes beyond it has memory or comes from outside.'
    : `There is no ceiling of a static map: ${own.absent}.`}`, ['', 'Of the gap as delivered', ...(more ? ['Of what re-tuning leaves'] : [])], rows);
}

function driftText(drift) {
  if (!drift.significant) return `No: the first third of the record and the last do not differ beyond chance (p ${short(drift.p)}).`;
  const what = drift.kind === 'size' ? 'its size' : `the ${drift.kind} of ${drift.channel}`;
  return `Yes: ${what} goes from ${short(drift.first)} to ${short(drift.last)} between the first third and the last (p ${short(drift.p)}).`;
}

function linesText(lines) {
  if (lines.absent) return `Cannot be told: ${lines.absent}.`;
  return `${percent(lines.linear)} linear${lines.odd === null ? ' or odd' : `, ${percent(lines.odd)} odd`}, ${percent(lines.even)} even (period ${short(lines.period_s)} s).`;
}

function beyondText({ closure, closure_inside: inside, flagged }) {
  if (!Number.isFinite(closure)) return 'nothing is above the noise there.';
  return `there the answer removes ${percent(closure)}, inside ${percent(inside)}${flagged ? '. Do not trust it there' : ''}.`;
}

function kind({ where, how_far }, stage) {
  const retuned = stage === 'retuned' && where.after_retuning;
  const own = retuned ? where.after_retuning : where;
  const terms = [];
  if (own?.kind?.repeatable) terms.push(['Comes again with the drive', `${percent(own.kind.repeatable.share)} of a record\u2019s squared error; the rest differs between repeats.`]);
  if (own?.kind?.drift) terms.push(['Drifts', driftText(own.kind.drift)]);
  if (own?.kind?.lines) terms.push(['Linear, odd, even', linesText(own.kind.lines)]);
  for (const { variable, from, to, share, time_share } of own?.regions ?? [])
    terms.push(['Stands out', `${percent(share)} of it in ${percent(time_share)} of the time, at ${variable.replace('.', ' ')} ${short(from)} to ${short(to)} ${variable.endsWith('velocity') ? 'm/s' : 'm'}.`]);
  const beyond = how_far.beyond_envelope;
  if (beyond && beyond.time_share > 0)
    terms.push(['Beyond the fitted range', `${percent(beyond.time_share)} of the time; ${beyondText(beyond)}`]);
  if (terms.length === 0) return '';
  return `<h2>What kind of gap</h2>
<p>${retuned ? 'Of the gap that re-tuning leaves.' : 'Of the gap as delivered.'}</p>
<dl>${terms.map(([term, text]) => `<dt>${escape(term)}</dt><dd>${escape(text)}</dd>`).join('\n')}</dl>`;
}

function retuning({ retuning: list }) {
  if (!list?.length) return '';
  const rows = list.map(({ name, tolerances_off, std }) => [escape(name), short(Number(tolerances_off.toFixed(2))), `${short(Number(std.toFixed(2)))}`]);
  return `<details><summary>Parameters after re-tuning</summary>${table('In tolerances off the plant as delivered.', ['Parameter', 'Off', 'Standard deviation'], rows)}</details>`;
}

function checks(diagnosis) {
  const list = diagnosis.checks;
  if (!Array.isArray(list) || list.length === 0) return '';
  const items = list.map((check) => {
    if (check === null || typeof check !== 'object') return `<dt>Check</dt><dd>${escape(check)}</dd>`;
    const { check: id, name = id, passed, detail, ...rest } = check;
    const outcome = passed === undefined ? '' : passed ? 'Passed' : 'Not passed';
    const more = Object.entries(rest).map(([key, value]) => `${nameText(key)}: ${typeof value === 'number' ? short(value) : typeof value === 'object' ? JSON.stringify(value) : value}`);
    const text = [...(detail === undefined ? [] : [detail]), ...more].join('; ');
    return `<dt>${escape(nameText(String(name ?? 'check')))}</dt><dd>${escape([outcome, text].filter(Boolean).join(': '))}</dd>`;
  });
  return `<h2>Checks</h2>\n<dl>${items.join('\n')}</dl>`;
}

/** The answer's confusion row: does a simulation of it bring it back? */
function placebo({ placebo: own }) {
  if (!own) return '';
  if (own.absent !== undefined) return `<p>Placebo: none, ${escape(own.absent)}.</p>`;
  const names = Object.entries(own.names).map(([name, count]) => `${namedText(name)} ${count}`).join(', ');
  return `<p>Placebo: ${escape(own.same)} of ${escape(own.runs)} diagnoses of simulated records, in which this answer is true, give it again. Named: ${escape(names)}.</p>`;
}

/** The page. @param drawn the figures with their SVG texts, in the order of reading */
export function diagnosisPage(diagnosis, figures, drawn) {
  const css = readFileSync(new URL('page.css', import.meta.url), 'utf8');
  const show = (...names) => drawn.filter(({ name }) => names.includes(name)).map(({ title, caption, svg }) => `<h2>${escape(title)}</h2>
<figure>
${svg.trim()}
<figcaption>${escape(caption)}</figcaption>
</figure>`).join('\n');
  const named = diagnosis.which.named.length > 0 ? listText(diagnosis.which.named.map(namedText)) : 'no cause named';
  const heading = diagnosis.verdict === 'no_gap' ? 'Simulation and rig agree' : `Why simulation and rig disagree: ${named}`;
  return `<!DOCTYPE html>
<html lang="en-GB">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>${escape(heading)}</title>
<style>
${css.trim()}
</style>
</head>
<body>
<main>
<h1>${escape(heading)}</h1>
<p class="answer">${escape(diagnosis.answer)}</p>
${placebo(diagnosis)}
${show('channels')}
${howFar(diagnosis)}
${ceiling(diagnosis)}
${show('segment')}
${effects(diagnosis)}
${show('places')}
${twoPlaces(diagnosis)}
${show('signal')}
${kind(diagnosis, figures.regions_of)}
${show('regions', 'bands', 'time')}
${checks(diagnosis)}
<h2>Details</h2>
${retuning(diagnosis)}
${facts('Provenance', diagnosis.provenance)}
</main>
</body>
</html>
`;
}
