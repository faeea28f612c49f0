// One figure: the specification of figure.vl.json filled with one signal, turned into SVG without a browser.
import { readFileSync } from 'node:fs';
import * as vega from 'vega';
import { compile } from 'vega-lite';
import { LINES } from './input.mjs';
import { escape, percent, seconds, unitText } from './text.mjs';

const template = readFileSync(new URL('figure.vl.json', import.meta.url), 'utf8');

// Without a browser Vega takes every letter for 0.8 em wide, which tears the legend apart; 0.56 em is a sans serif's mean.
vega.textMetrics.width = (item, text) => 0.56 * vega.textMetrics.height(item) * String(text ?? '').length;

/** Measured range widened by 60 % on both sides: a model that runs away leaves the frame instead of flattening the data. */
function valueDomain(signal) {
  const low = Math.min(...signal.lines.measured);
  const high = Math.max(...signal.lines.measured);
  const margin = 0.6 * (high - low || Math.abs(high) || 1);
  const all = LINES.flatMap((line) => signal.lines[line]).filter((value) => value !== null);
  return [Math.max(Math.min(...all), low - margin), Math.min(Math.max(...all), high + margin)];
}

/** The Vega-Lite specification of one signal's figure. */
export function specification(figures, signal) {
  const spec = JSON.parse(template);
  const [bands, , lines] = spec.layer;
  spec.title.text = `Figure ${signal.figure}: ${signal.title}`;
  spec.title.subtitle =
    `Free run on the validation record of realisation ${figures.realisation}; percentages: VAF over the whole record`;
  spec.params[0].value = Object.fromEntries(
    LINES.map((line) => [line, line === 'measured' ? line : `${line} ${percent(signal.vaf[line])}`]),
  );
  spec.data.values = LINES.flatMap((line) =>
    figures.time.map((time_s, k) => ({ time_s, line, value: signal.lines[line][k] })),
  );
  bands.data.values = [
    { ...figures.fails, label: 'linear model fails' },
    { ...figures.doesWell, label: 'linear model does well' },
  ].map((band) => ({ ...band, middle_s: (band.from_s + band.to_s) / 2 }));
  lines.encoding.x.scale.domain = [figures.from, figures.to];
  lines.encoding.y.scale.domain = valueDomain(signal);
  lines.encoding.y.axis.title = `${signal.title} (${unitText(signal.unit)})`;
  return spec;
}

/** Which line is which, for the caption. */
export function caption(figures, signal) {
  return (
    `${signal.title}, ${seconds(figures.from)} to ${seconds(figures.to)} s: measured (thick, solid), linear model (dashed), ` +
    `nonlinear model (dash-dotted) and refined model (thin, solid).`
  );
}

/** What the figure shows, in words: for readers who do not see it. */
function description(figures, signal) {
  const span = ({ from_s, to_s }) => `${seconds(from_s)} to ${seconds(to_s)} s`;
  const vaf = ['linear', 'nonlinear', 'refined'].map((line) => `${line} ${percent(signal.vaf[line])}`).join(', ');
  return (
    `${caption(figures, signal)} The linear model fails from ${span(figures.fails)} and does well from ` +
    `${span(figures.doesWell)}. Variance accounted for over the whole record: ${vaf}.`
  );
}

/** A specification as an SVG text with a name and words of its own; the same input gives the same bytes. */
export async function drawSvg(spec, name, title, words) {
  const view = new vega.View(vega.parse(compile(spec, { logger: vega.logger(vega.Error) }).spec), { renderer: 'none' });
  vega.resetSVGDefIds();
  const svg = await view.toSVG();
  view.finalize();
  const described = `<title id="${name}-title">${escape(title)}</title><desc id="${name}-desc">${escape(words)}</desc>`;
  // Names unique over the figures, since the report page holds all of them. Only tags are touched, not the texts of a
  // result between them, and its texts come in through functions: in a text, `$&` would stand for what is replaced.
  const inTags = svg.replace(/<[^<>]*>/g, (tag) => tag
    .replace(/(\bid="|url\(#)(clip|gradient)(_?\d+)/g, (_, before, kind, number) => `${before}${name}-${kind}${number}`)
    .replaceAll(' stroke-dasharray="1,0"', ''));
  return `${inTags.replace(/<svg([^>]*)>/, (_, attributes) => `<svg${attributes} role="img" aria-labelledby="${name}-title ${name}-desc">${described}`)}\n`;
}

/** The figure of one signal. */
export function toSvg(figures, signal) {
  return drawSvg(specification(figures, signal), `figure${signal.figure}`, `Figure ${signal.figure}: ${signal.title}`, description(figures, signal));
}
