#!/usr/bin/env node
// node render.mjs DIR [--out FILE.html]
//   reads   DIR/table1.json and DIR/figures/figures.json
//   writes  DIR/figures/figure<N>.svg, one a signal, and the report page (DIR/report.html)
// node render.mjs DIR [--out FILE.html], where DIR holds the table.json of a sweep
//   reads   DIR/table.json and, if it is there, DIR/compare.json
//   writes  the page of the sweep (DIR/report.html)
// node render.mjs D.json [--out FILE.html]
//   reads   a diagnosis and D.figures.json beside it
//   writes  its page (D.html)
// Exit status: 0 written; 2 wrong use or wrong input, with one message and nothing written.
import { chmodSync, existsSync, renameSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { readDiagnosis } from './diagnosis_input.mjs';
import { InputError, loadDrawing, readFigures, readTable } from './input.mjs';
import { readSweep } from './sweep_input.mjs';

const USAGE = 'usage: node render.mjs DIR [--out FILE.html], or node render.mjs DIAGNOSIS.json [--out FILE.html]';

function parse(words) {
  const [result, option, file, ...rest] = words;
  const known = words.length === 1 || (words.length === 3 && option === '--out' && file);
  if (!result || result.startsWith('-') || !known || rest.length) throw new InputError(USAGE);
  return { result, out: file };
}

/** All files or none: each is written beside its place first. One that is replaced keeps its mode. */
function writeAll(files) {
  const beside = (path) => `${path}.part`;
  const places = files.map(([path]) => resolve(path));
  if (new Set(places).size < places.length) throw new InputError('--out: expected a page of its own, found the name of one of the figures');
  try {
    for (const [path, text] of files) {
      writeFileSync(beside(path), text);
      const old = statSync(path, { throwIfNoEntry: false });
      if (old?.isFile()) chmodSync(beside(path), old.mode & 0o7777);
    }
    for (const [path] of files) renameSync(beside(path), path);
  } catch (error) {
    for (const [path] of files) rmSync(beside(path), { force: true });
    throw new InputError(`${error.path ?? 'output'}: could not be written (${error.code ?? error.message})`);
  }
}

async function drawReproduction(directory, out = join(directory, 'report.html')) {
  const table = readTable(directory);
  const figures = readFigures(directory);
  const [{ toSvg }, { page }] = await loadDrawing('./figure.mjs', './report.mjs');
  const svgs = [];
  for (const signal of figures.signals) svgs.push(await toSvg(figures, signal));
  const named = figures.signals.map((signal, i) => [join(directory, 'figures', `figure${signal.figure}.svg`), svgs[i]]);
  writeAll([...named, [out, page(table, figures, svgs)]]);
}

async function drawDiagnosis(file, out = file.replace(/\.[^./\\]*$/, '') + '.html') {
  const { diagnosis, figures } = readDiagnosis(file);
  const [{ drawSvg }, { diagnosisFigures }, { diagnosisPage }] = await loadDrawing('./figure.mjs', './diagnosis_figures.mjs', './diagnosis.mjs');
  const drawn = [];
  for (const { name, title, caption, spec } of diagnosisFigures(diagnosis, figures))
    drawn.push({ name, title, caption, svg: await drawSvg(spec, name, title, caption) });
  writeAll([[out, diagnosisPage(diagnosis, drawn)]]);
}

async function drawSweep(directory, out = join(directory, 'report.html')) {
  const sweep = readSweep(directory);
  const [{ sweepPage }] = await loadDrawing('./sweep.mjs');
  writeAll([[out, sweepPage(sweep)]]);
}

function main() {
  const { result, out } = parse(process.argv.slice(2));
  const isFile = statSync(result, { throwIfNoEntry: false })?.isFile();
  if (isFile) return drawDiagnosis(result, out);
  return existsSync(join(result, 'table.json')) ? drawSweep(result, out) : drawReproduction(result, out);
}

/** What is not checked one by one shows where it is used: a part that is missing or of another kind. */
function said(error) {
  if (error instanceof InputError) return error.message;
  const why = String(error?.message ?? error).split('\n')[0];
  return `${process.argv[2]}: expected a whole result of this version, found a part missing or of another kind (${why}); make the result again`;
}

Promise.resolve().then(main).catch((error) => {
  process.stderr.write(`wheelhop plots: ${said(error)}\n`);
  process.exitCode = 2;
});
