// The page of a diagnosis: one HTML text with everything inside, nothing asked of any server. Its texts and tables are
// those of the diagnosis file's view; the figures are drawn from its numbers.
import { readFileSync } from 'node:fs';
import { facts } from './report.mjs';
import { escape } from './text.mjs';

/** A number with a true minus, a dash for what is not known. */
const signed = (text) => (text === '-' ? '\u2013' : text.replace(/^-(?=[\d.])/, '\u2212'));
const isNumber = (text) => text === '-' || /^-?[\d.]+(e[-+]?\d+)?( %)?$/.test(text);

/** One value a line where a cell lists several. */
const cellText = (text) => (isNumber(text) ? escape(signed(text)) : escape(text).replace(/; /g, '<br>'));

function table({ caption, columns, rows }) {
  const numbers = columns.map((_, i) => i > 0 && rows.every((row) => isNumber(row[i])));
  const cell = (text, i) => (i === 0 ? `<th scope="row">${escape(text)}</th>` : `<td${numbers[i] ? ' class="num"' : ''}>${cellText(text)}</td>`);
  const heads = columns.some(Boolean) ? `<thead><tr>${columns.map((name, i) => `<th scope="col"${numbers[i] ? ' class="num"' : ''}>${escape(name)}</th>`).join('')}</tr></thead>\n` : '';
  return `<div class="scroll" role="region" aria-label="${escape(caption)}" tabindex="0"><table>
<caption>${escape(caption)}</caption>
${heads}<tbody>
${rows.map((row) => `<tr>${row.map(cell).join('')}</tr>`).join('\n')}
</tbody></table></div>`;
}

/** The page. @param drawn the figures with their SVG texts, in the order of reading */
export function diagnosisPage(diagnosis, drawn) {
  const css = readFileSync(new URL('page.css', import.meta.url), 'utf8');
  const { heading, notes, tables } = diagnosis.view;
  const figure = (...names) => drawn.filter(({ name }) => names.includes(name)).map(({ title, caption, svg }) => `<h2>${escape(title)}</h2>
<figure>
${svg.trim()}
<figcaption>${escape(caption)}</figcaption>
</figure>`).join('\n');
  const placed = new Set(['bridged', 'how_far', 'ceiling', 'effects', 'two_places', 'kind', 'checks', 'places', 'bands', 'retuning']);
  const text = (id, title = '') => tables.filter((one) => one.id === id).map((one) => (title ? `<h2>${title}</h2>\n` : '') + table(one)).join('\n');
  const folded = (id, title) => tables.filter((one) => one.id === id).map((one) => `<details><summary>${title}</summary>${table(one)}</details>`).join('\n');
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
${notes.map((note) => `<p>${escape(note)}</p>`).join('\n')}
${text('bridged')}
${figure('channels')}
${text('how_far')}
${text('ceiling')}
${figure('segment')}
${text('effects', 'Which effect')}
${figure('places')}
${text('two_places')}
${figure('signal')}
${text('kind', 'What kind of gap')}
${figure('regions', 'bands', 'time')}
${text('checks', 'Checks')}
<h2>Details</h2>
${folded('places', 'Places, in numbers')}
${folded('bands', 'Bands, in numbers')}
${folded('retuning', 'Parameters after re-tuning')}
${tables.filter(({ id }) => !placed.has(id)).map(table).join('\n')}
${facts('Provenance', diagnosis.provenance)}
</main>
</body>
</html>
`;
}
