import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { chmodSync, existsSync, readFileSync, readdirSync, rmSync, statSync } from 'node:fs';
import { join } from 'node:path';
import test from 'node:test';
import { fileURLToPath } from 'node:url';
import { figuresData, folder, tableData } from './sample.mjs';

const RENDER = fileURLToPath(new URL('../render.mjs', import.meta.url));
const render = (...words) => spawnSync(process.execPath, [RENDER, ...words], { encoding: 'utf8' });
const read = (directory, ...path) => readFileSync(join(directory, ...path), 'utf8');
const OUTPUTS = [['report.html'], ['figures', 'figure4.svg'], ['figures', 'figure5.svg'], ['figures', 'figure6.svg']];

/** Runs `body` on a folder and removes the folder whatever happens. */
function on(directory, body) {
  try {
    body(directory);
  } finally {
    rmSync(directory, { recursive: true, force: true });
  }
}

/** The lines of the data: paths inside the group of line marks, as [colour, dash pattern, width]. */
function drawn(svg) {
  const paths = [...svg.matchAll(/<g class="mark-line role-mark[^"]*"[^>]*>(?:<path[^>]*>(?:<\/path>)?)+/g)].flatMap(
    ([group]) => [...group.matchAll(/<path[^>]*>/g)].map(([path]) => path),
  );
  const attribute = (path, name) => path.match(new RegExp(` ${name}="([^"]*)"`))?.[1] ?? '';
  return paths.map((path) => ['stroke', 'stroke-dasharray', 'stroke-width'].map((name) => attribute(path, name)));
}

test('each figure shows four lines: measured solid, linear dashed, nonlinear dash-dotted, refined thin', () =>
  on(folder(), (directory) => {
    const run = render(directory);
    assert.equal(run.status, 0, run.stderr);
    assert.equal(run.stderr, '');
    for (const figure of [4, 5, 6]) {
      const lines = drawn(read(directory, 'figures', `figure${figure}.svg`));
      assert.equal(lines.length, 4);
      assert.deepEqual(lines.map(([, dash]) => dash), ['', '6,4', '9,3,2,3', '']);
      assert.equal(new Set(lines.map(([stroke]) => stroke)).size, 4);
      assert.ok(Number(lines[3][2]) < Math.min(...lines.slice(0, 3).map(([, , width]) => Number(width))));
    }
  }));

test('each figure names its lines with their VAF, its axes with their units, and both stretches', () =>
  on(folder(), (directory) => {
    render(directory);
    const units = { 4: 'Suspension displacement (m)', 5: 'Chassis acceleration (m/s\u00b2)', 6: 'Axle acceleration (m/s\u00b2)' };
    for (const [figure, unit] of Object.entries(units)) {
      const svg = read(directory, 'figures', `figure${figure}.svg`);
      const texts = [...svg.matchAll(/<text[^>]*>([^<]*)<\/text>/g)].map(([, text]) => text);
      const wanted = ['measured', 'linear 75.0 %', 'nonlinear 99.1 %', 'refined 99.9997 %', 'Time (s)', unit];
      for (const text of [...wanted, 'linear model fails', 'linear model does well']) assert.ok(texts.includes(text), text);
      assert.match(svg, /role="img" aria-labelledby="figure\d-title figure\d-desc"/);
    }
  }));

test('the same input gives the same bytes', () =>
  on(folder(), (first) =>
    on(folder(), (second) => {
      assert.equal(render(first).status, 0);
      assert.equal(render(second).status, 0);
      for (const path of OUTPUTS) assert.equal(read(first, ...path), read(second, ...path));
    }),
  ));

test('the report holds table, figures, choices and configuration, escaped, and asks nothing of any server', () =>
  on(folder(), (directory) => {
    render(directory);
    const html = read(directory, 'report.html');
    assert.equal(html.match(/<svg /g).length, 3);
    for (const text of ['74.3', '99.9997', 'failed', '4 of 5 ok', 'Length of the records', 'quarter_car', 'Master seed']) {
      assert.ok(html.includes(text), text);
    }
    assert.ok(html.includes('shorter &#60;records&#62; lose'));
    assert.doesNotMatch(html, /<(script|link|img|iframe)\b|@import|url\((?!#)|(?:src|href)="(?!#)/);
    const ids = [...html.matchAll(/ id="([^"]*)"/g)].map(([, id]) => id);
    assert.equal(new Set(ids).size, ids.length);
  }));

test('the report goes where --out says', () =>
  on(folder(), (directory) => {
    const page = join(directory, 'page.html');
    assert.equal(render(directory, '--out', page).status, 0);
    assert.ok(existsSync(page));
    assert.ok(!existsSync(join(directory, 'report.html')));
  }));

test('a page keeps its mode when it is drawn again, and takes no place of a figure', () =>
  on(folder(), (directory) => {
    assert.equal(render(directory).status, 0);
    chmodSync(join(directory, 'report.html'), 0o640);
    assert.equal(render(directory).status, 0);
    assert.equal(statSync(join(directory, 'report.html')).mode & 0o777, 0o640);
    const run = render(directory, '--out', join(directory, 'figures', '..', 'figures', 'figure5.svg'));
    assert.equal(run.status, 2);
    assert.match(run.stderr, /--out: expected a page of its own/);
  }));

test('a model that diverged is drawn as far as it goes', () => {
  const figures = figuresData();
  figures.signals[0].linear.fill(null, 10);
  figures.signals[0].linear[9] = 1e9;
  figures.signals[0].vaf_percent.linear = null;
  on(folder(figures), (directory) => {
    const run = render(directory);
    assert.equal(run.status, 0, run.stderr);
    const svg = read(directory, 'figures', 'figure4.svg');
    assert.ok(svg.includes('linear failed'));
    assert.doesNotMatch(svg, /NaN|undefined/);
    assert.match(svg, />0\.0[1-9]</);
  });
});

function broken(change) {
  const figures = figuresData();
  change(figures);
  return figures;
}

const MISTAKES = [
  ['no figures.json', null, tableData(), /figures\.json: expected a JSON file, could not read it \(ENOENT\)/],
  ['no table1.json', figuresData(), null, /table1\.json: expected a JSON file, could not read it \(ENOENT\)/],
  ['cut off JSON', '{"schema": "wheel', tableData(), /figures\.json: expected JSON, found a mistake/],
  ['another schema', broken((f) => (f.schema = 'wheelhop.figures/2')), tableData(), /\$\.schema: expected "wheelhop\.figures\/1", found "wheelhop\.figures\/2"/],
  ['a sample missing', broken((f) => f.signals[1].linear.pop()), tableData(), /\$\.signals\[1\]\.linear: expected 50 numbers, .*found an array of 49/],
  ['a text for a number', broken((f) => (f.signals[2].measured[7] = '3')), tableData(), /\$\.signals\[2\]\.measured\[7\]: expected a number, found "3"/],
  ['a hole in the measurement', broken((f) => (f.signals[0].measured[0] = null)), tableData(), /\$\.signals\[0\]\.measured\[0\]: expected a number, found null/],
  ['a stretch outside', broken((f) => (f.fails_s = [12, 13])), tableData(), /\$\.fails_s: expected \[from, to\] in seconds, rising and inside 12\.8 to 13\.8/],
  ['two figures of one number', broken((f) => (f.signals[1].figure = 4)), tableData(), /\$\.signals: expected a different figure for every signal/],
  ['no median', figuresData(), { ...tableData(), rows: [{ signal: 's', paper: { linear: 1, nonlinear: 2 }, vaf_percent: { linear: {} } }] }, /\$\.rows\[0\]\.vaf_percent\.linear\.median: expected a number, found nothing/],
];

for (const [name, figures, table, message] of MISTAKES) {
  test(`wrong input (${name}) gives one message, exit status 2 and no file`, () =>
    on(folder(figures, table), (directory) => {
      const run = render(directory);
      assert.equal(run.status, 2, run.stderr);
      assert.match(run.stderr, message);
      assert.equal(run.stderr.trim().split('\n').length, 1);
      assert.deepEqual(readdirSync(directory).filter((file) => !/^(figures|table1\.json)$/.test(file)), []);
      assert.deepEqual(readdirSync(join(directory, 'figures')).filter((file) => file !== 'figures.json'), []);
    }));
}

test('wrong use gives the usage and exit status 2', () => {
  for (const words of [[], ['--out'], ['a', 'b'], ['a', '--out'], ['a', '--out', 'b', 'c']]) {
    const run = render(...words);
    assert.equal(run.status, 2);
    assert.match(run.stderr, /usage: node render\.mjs DIR/);
  }
});

test('an unwritable page leaves no figure behind', () =>
  on(folder(), (directory) => {
    const run = render(directory, '--out', join(directory, 'absent', 'page.html'));
    assert.equal(run.status, 2);
    assert.match(run.stderr, /absent.*could not be written \(ENOENT\)/);
    assert.deepEqual(readdirSync(join(directory, 'figures')), ['figures.json']);
  }));
