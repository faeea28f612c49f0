// The page of a sweep: one HTML text with its numbers and the code that draws them, nothing asked of any server.
import { readFileSync } from 'node:fs';
import { facts } from './report.mjs';
import { escape } from './text.mjs';

const beside = (name) => readFileSync(new URL(name, import.meta.url), 'utf8').trim();

/** JSON that cannot end its script element. */
const embedded = (value) => JSON.stringify(value).replace(/</g, '\\u003c');

export function sweepPage(sweep) {
  const { axes, cells, excluded, provenance, effective, ...rest } = sweep;
  const rows = cells.reduce((sum, cell) => sum + cell.n, 0);
  const ok = cells.reduce((sum, cell) => sum + cell.ok, 0);
  const values = (i) => new Set(cells.map((cell) => JSON.stringify(cell.at[i]))).size;
  const over = axes.filter((_, i) => values(i) > 1).join(', ') || axes.join(', ');
  const until = sweep.until
    ? ` Realisations were added until the claims were decided: ${escape(sweep.until.realisations)} of each cell,
${sweep.until.claims.filter(({ claim }) => claim).length} of ${sweep.until.claims.length} claims decided.` : '';
  return `<!DOCTYPE html>
<html lang="en-GB">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Sweep over ${escape(over)}</title>
<style>
${beside('page.css')}
${beside('sweep_page.css')}
</style>
</head>
<body>
<main>
<h1>Sweep over ${escape(over)}</h1>
<p class="lead">${cells.length} cells${excluded ? ` (${escape(excluded)} left out by rules)` : ''}, ${rows} rows, ${ok} of them ok.${until}</p>
<section aria-label="Map"><h2>Map of the cells</h2>
<div class="controls" id="map-controls"></div><div class="scroll" id="map"></div></section>
<section aria-label="Failures"><h2>Map of failures</h2><p>Share of the rows of a cell whose status is not ok; the same axes as above.</p>
<div class="scroll" id="failures"></div><div id="failure-list"></div></section>
<section aria-label="Comparison"><h2>Paired comparison</h2><div class="controls" id="pair-controls"></div>
<div id="pairs"></div></section>
<section aria-label="Cells"><h2>All cells</h2><div class="controls" id="table-controls"></div>
<div class="scroll" id="cells"></div></section>
${facts('Provenance', provenance)}
${facts('Grid', effective)}
<noscript><p>The maps need JavaScript; all numbers stand in table.json beside this page.</p></noscript>
</main>
<script type="application/json" id="sweep">${embedded({ axes, cells, ...rest })}</script>
<script>
${beside('sweep_page.js')}
</script>
</body>
</html>
`;
}
