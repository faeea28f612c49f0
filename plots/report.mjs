// The report page of a reproduction: one HTML text with everything inside, nothing asked of any server.
import { readFileSync } from 'node:fs';
import { caption } from './figure.mjs';
import { escape, nameText, vafText } from './text.mjs';

const MODELS = {
  linear: ['Linear', 'the initial linear state-space model'],
  nonlinear: ['Nonlinear', 'the algorithm of Section 2.7, with the direct term that step 5\u2019s extended input brings'],
  refined: ['Refined', 'the nonlinear model after the joint refinement of all its parameters on the simulation error'],
  as_printed: ['As printed', 'equation (5) and the stable dynamic inversion to the letter: no direct term, one-step-ahead f'],
};
const KNOWN = ['schema', 'realisations', 'rows', 'config', 'provenance', 'notes'];

function cell(statistics) {
  if (!statistics) return '<td class="num">\u2013</td>';
  const { median, q05, q95, n_ok, n } = statistics;
  const spread = q05 === null || q95 === null ? '' : `<small>${vafText(q05)} to ${vafText(q95)}</small>`;
  const counted = Number.isInteger(n_ok) && Number.isInteger(n) ? `<small>${n_ok} of ${n} ok</small>` : '';
  return `<td class="num">${vafText(median)}${spread}${counted}</td>`;
}

function table1({ rows, realisations }) {
  const models = Object.keys(MODELS).filter((model) => rows.some((row) => row.vaf_percent[model]));
  const inPaper = (model) => rows.some((row) => row.paper[model] !== undefined);
  const groups = models.map(
    (model) => `<th scope="colgroup" class="num"${inPaper(model) ? ' colspan="2"' : ''}>${MODELS[model][0]}</th>`,
  );
  const columns = models.map((model) => {
    const paper = inPaper(model) ? '<th scope="col" class="num paper">paper</th>' : '';
    return `${paper}<th scope="col" class="num">here</th>`;
  });
  const body = rows.map((row) => {
    const cells = models.map((model) => {
      const paper = inPaper(model) ? `<td class="num paper">${vafText(row.paper[model])}</td>` : '';
      return paper + cell(row.vaf_percent[model]);
    });
    return `<tr><th scope="row">${escape(nameText(row.signal))}</th>${cells.join('')}</tr>`;
  });
  const meaning = models.map((model) => `<dt>${MODELS[model][0]}</dt><dd>${escape(MODELS[model][1])}</dd>`);
  return `<div class="scroll" role="region" aria-label="Table 1" tabindex="0"><table>
<caption>Table 1. Variance accounted for in free run on validation data, in percent: median over ${escape(realisations)}
realisations, below it the 5 % and 95 % quantiles.</caption>
<thead><tr><th scope="col" rowspan="2">Signal</th>${groups.join('')}</tr>
<tr>${columns.join('')}</tr></thead>
<tbody>
${body.join('\n')}
</tbody></table></div>
<dl>${meaning.join('')}</dl>`;
}

function notes(list) {
  if (!list) return '';
  const rows = list.map(
    ({ what, chosen, why }) => `<tr><th scope="row">${escape(what)}</th><td>${escape(chosen)}</td><td>${escape(why)}</td></tr>`,
  );
  return `<h2>What the paper does not state</h2>
<div class="scroll" role="region" aria-label="What the paper does not state" tabindex="0"><table>
<thead><tr><th scope="col">What</th><th scope="col">Chosen</th><th scope="col">Why</th></tr></thead>
<tbody>
${rows.join('\n')}
</tbody></table></div>`;
}

function figure(figures, signal, svg) {
  return `<figure>
${svg.trim()}
<figcaption>${escape(caption(figures, signal))}</figcaption>
</figure>`;
}

/** A flat object as a list of terms; whatever is nested as JSON. */
export function facts(title, object) {
  if (object === undefined) return '';
  const plain = object !== null && typeof object === 'object' && !Array.isArray(object);
  const entries = plain ? Object.entries(object) : [];
  const isFlat = ([, value]) => value === null || typeof value !== 'object';
  const terms = entries.filter(isFlat).map(([key, value]) => `<dt>${escape(nameText(key))}</dt><dd>${escape(value)}</dd>`);
  const rest = plain ? Object.fromEntries(entries.filter((entry) => !isFlat(entry))) : object;
  const nested = plain && Object.keys(rest).length === 0
    ? ''
    : `<details><summary>As JSON</summary><pre tabindex="0">${escape(JSON.stringify(rest, null, 2))}</pre></details>`;
  return `<h2>${escape(title)}</h2>\n${terms.length ? `<dl>${terms.join('')}</dl>` : ''}${nested}`;
}

/** The page; `svgs` are the figures' texts in the order of figures.signals. */
export function page(table, figures, svgs) {
  const css = readFileSync(new URL('page.css', import.meta.url), 'utf8');
  const more = Object.keys(table).filter((key) => !KNOWN.includes(key));
  return `<!DOCTYPE html>
<html lang="en-GB">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Table 1 and Figures 4 to 6, reproduced</title>
<style>
${css.trim()}
</style>
</head>
<body>
<main>
<h1>A quarter car, identified: Table 1 and Figures 4 to 6</h1>
<p class="lead">A nonlinear state-space model of a quarter car is identified from simulated records and judged on a
record it has not seen, in free run: the model gets the road alone, never a measured output.</p>
<h2>Accuracy</h2>
${table1(table)}
<p>VAF = 100 (1 \u2212 \u03a3(y \u2212 \u0177)\u00b2 / \u03a3y\u00b2), as in the paper: no mean is removed. Below zero, a model is worse than none.</p>
<h2>One second of the validation record</h2>
<p>A second in which the linear model first fails and then does well. Grey: the two stretches.</p>
${figures.signals.map((signal, i) => figure(figures, signal, svgs[i])).join('\n')}
${notes(table.notes)}
${more.map((key) => facts(nameText(key), table[key])).join('\n')}
${facts('Provenance', table.provenance)}
${facts('Configuration', table.config)}
</main>
</body>
</html>
`;
}
