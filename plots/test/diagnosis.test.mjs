import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { existsSync, readFileSync, readdirSync, rmSync } from 'node:fs';
import { join } from 'node:path';
import test from 'node:test';
import { fileURLToPath } from 'node:url';
import { diagnosisData, diagnosisFiguresData, diagnosisFolder } from './diagnosis_sample.mjs';

const RENDER = fileURLToPath(new URL('../render.mjs', import.meta.url));
const render = (directory, ...words) => spawnSync(process.execPath, [RENDER, join(directory, 'd.json'), ...words], { encoding: 'utf8' });
const page = (directory) => readFileSync(join(directory, 'd.html'), 'utf8');

/** Runs `body` on a folder and removes the folder whatever happens. */
function on(directory, body) {
  try {
    body(directory);
  } finally {
    rmSync(directory, { recursive: true, force: true });
  }
}

function changed(data, change) {
  change(data);
  return data;
}

test('the page begins with the answer and shows every part of the diagnosis, escaped, asking nothing of any server', () =>
  on(diagnosisFolder(), (directory) => {
    const run = render(directory);
    assert.equal(run.status, 0, run.stderr);
    assert.equal(run.stderr, '');
    const html = page(directory);
    assert.equal(html.match(/<svg /g).length, 7);
    assert.ok(html.indexOf('The gap is 10 x the &#60;noise&#62;') < html.indexOf('<svg '));
    for (const text of ['Why simulation and rig disagree: coulomb friction at strut', '>coulomb friction at strut</th>', 'force_n = 41.2 [38, 44]<br>other = 1', '>0.93<', '<td class="num">\u221298 %</td>', '>\u2013</td>',
      'the gain of acc goes from 0 to 0.1', 'do not trust it there', '>tyre</th><td class="num">27</td><td>actuator<', 'Force at strut (N)', '>Share</th>', 'static map of travel and rate at strut', '17 of 20 diagnoses', 'acc (m/s\u00b2)',
      'Two at once do:', '>strut and sensor:acc</th><td class="num">1.04<', '>parameter homing</th><td>not passed</td><td>misfit 1.5<', '<summary>Bands, in numbers</summary>', '3 to 50'])
      assert.ok(html.includes(text), text);
    assert.doesNotMatch(html, /NaN|undefined|Infinity/);
    assert.doesNotMatch(html, /<(script|link|img|iframe)\b|@import|url\((?!#)|(?:src|href)="(?!#)/);
    const ids = [...html.matchAll(/ id="([^"]*)"/g)].map(([, id]) => id);
    assert.equal(new Set(ids).size, ids.length);
  }));

test('the same diagnosis gives the same bytes, at the place that --out says', () =>
  on(diagnosisFolder(), (directory) => {
    assert.equal(render(directory).status, 0);
    assert.equal(render(directory, '--out', join(directory, 'other.html')).status, 0);
    assert.equal(page(directory), readFileSync(join(directory, 'other.html'), 'utf8'));
  }));

test('what the records do not tell is left out: no repeats, no place, no effect, a stage that failed', () => {
  const diagnosis = changed(diagnosisData(), (d) => {
    d.which.effects = [];
    d.which.named = [];
    d.verdict = 'no_gap';
    d.view = { heading: 'Simulation and rig agree', notes: [], tables: d.view.tables.filter(({ id }) => id === 'how_far') };
    d.where.without_catalogue = [];
    delete d.where.after_retuning;
    delete d.how_far.ceiling;
    delete d.where.after_effect;
    d.how_far.per_channel[0].misfit.with_effect = null;
    d.how_far.with_effect = { misfit: null, nrmse: {} };
    d.how_far.beyond_envelope = null;
    for (const band of d.how_far.per_band) band.excess.with_effect = null;
  });
  const figures = changed(diagnosisFiguresData(), (f) => {
    f.unknown_signal = null;
    f.segment = null;
    f.regions = [];
  });
  on(diagnosisFolder(diagnosis, figures), (directory) => {
    const run = render(directory);
    assert.equal(run.status, 0, run.stderr);
    const html = page(directory);
    assert.equal(html.match(/<svg /g).length, 3);
    assert.ok(html.includes('<h1>Simulation and rig agree</h1>'));
    assert.doesNotMatch(html, /NaN|undefined|Infinity/);
  });
});

test('every table of the view stands on the page once, and none that it does not hold', () => {
  const all = diagnosisData().view.tables.map(({ id }) => id);
  for (const left of [all, ...all.map((id) => all.filter((other) => other !== id)), []]) {
    const diagnosis = changed(diagnosisData(), (d) => (d.view.tables = left.length > 0 ? d.view.tables.filter(({ id }) => left.includes(id)) : [{ id: 'kind', caption: 'One.', columns: ['', ''], rows: [['a', 'b']] }]));
    on(diagnosisFolder(diagnosis), (directory) => {
      const run = render(directory);
      assert.equal(run.status, 0, run.stderr);
      const html = page(directory);
      assert.equal(html.match(/<caption>/g).length, diagnosis.view.tables.length);
      for (const { caption } of diagnosis.view.tables) assert.ok(html.includes(`<caption>${caption}</caption>`), caption);
    });
  }
});

/** Calls change(parent, key) for every member of a value, at any depth. */
function walk(value, change) {
  for (const key of Object.keys(value)) {
    if (value[key] !== null && typeof value[key] === 'object') walk(value[key], change);
    change(value, key);
  }
}

test('whatever stands in a text of the result stands in the page as it is, and never as markup or a pattern', () => {
  const kept = new Set(['wheelhop.diagnosis/1', 'wheelhop.diagnosis_figures/1', 'gap', 'ok', 'retuned', 'gain', 'effect']);
  const escaped = (text) => text.replace(/[&<>"']/g, (c) => `&#${c.charCodeAt(0)};`);
  for (const hostile of ['<img src=x onerror=alert(1)>', "$& $' $` $1 $$", '"><script>x</script>', 'clip0 gradient_1 stroke-dasharray="1,0"', '&lt;b&gt; -->']) {
    const spoil = (data) => {
      walk(data, (parent, key) => {
        if (typeof parent[key] === 'string' && !kept.has(parent[key])) parent[key] = `${parent[key]} ${hostile}`;
      });
      return data;
    };
    const diagnosis = spoil(diagnosisData());
    diagnosis.how_far.excluded = hostile;
    for (const { misfit, channel } of diagnosis.how_far.per_channel) assert.ok(misfit && channel.includes(hostile));
    on(diagnosisFolder(diagnosis, spoil(diagnosisFiguresData())), (directory) => {
      const run = render(directory);
      assert.equal(run.status, 0, run.stderr);
      const html = page(directory);
      assert.doesNotMatch(html, /<(script|img|b)\b/);
      assert.ok(html.includes(`It sits in strut. ${escaped(hostile)}`), 'the answer');
      assert.ok(html.includes(`none 3. ${escaped(hostile)}`), 'a note');
      assert.ok(html.includes(`>Parameters ${escaped(hostile)}<`), 'the head of a column');
      // In a figure: the title of a panel, as text, and its words for who does not see it.
      assert.ok(html.includes(`Record val.csv ${escaped(hostile)}: the stretch`), 'the words of a figure');
      const svgText = hostile.replace(/&/g, '&amp;').replace(/</g, '&lt;').replace(/>/g, '&gt;');
      assert.ok(html.includes(`acc ${svgText} (`), 'the title of a panel');
      assert.equal(html.match(/<svg /g).length, 7);
    });
  }
});

test('a result with any part missing or of another kind gives a page, or one message and no stack trace', () => {
  const paths = [];
  const list = (value, path) => {
    for (const key of Object.keys(value)) {
      paths.push([...path, key]);
      if (value[key] !== null && typeof value[key] === 'object') list(value[key], [...path, key]);
    }
  };
  list({ diagnosis: diagnosisData() }, []);
  // One of every eleven, with another kind of damage each time.
  const damages = [(parent, key) => (Array.isArray(parent) ? parent.splice(key, 1) : delete parent[key]), (parent, key) => (parent[key] = null), (parent, key) => (parent[key] = 'text'), (parent, key) => (parent[key] = 7)];
  let refused = 0;
  paths.filter((_, i) => i % 11 === 1).forEach((path, i) => {
    const data = { diagnosis: diagnosisData() };
    const parent = path.slice(0, -1).reduce((value, key) => value[key], data);
    damages[i % damages.length](parent, path.at(-1));
    on(diagnosisFolder(data.diagnosis), (directory) => {
      const run = render(directory);
      assert.ok([0, 2].includes(run.status), `${path}: ${run.stderr}`);
      assert.doesNotMatch(run.stderr, /^\s+at /m);
      assert.equal(run.stderr.trim().split('\n').length, 1);
      assert.equal(run.stderr === '', run.status === 0, `${path}: ${run.stderr}`);
      assert.equal(existsSync(join(directory, 'd.html')), run.status === 0);
      refused += run.status === 2;
    });
  });
  assert.ok(refused > 3);
});

const MISTAKES = [
  ['no figures', diagnosisData(), null, /d\.figures\.json: the data of the page are not here; "wheelhop diagnose/],
  ['another schema', changed(diagnosisData(), (d) => (d.schema = 'x/1')), diagnosisFiguresData(), /\$\.schema: expected "wheelhop\.diagnosis\/1", found "x\/1"/],
  ['a diagnosis that failed', changed(diagnosisData(), (d) => (d.status = 'outside_domain')), diagnosisFiguresData(), /\$\.status: expected .*found "outside_domain"/],
  ['no view', changed(diagnosisData(), (d) => delete d.view), diagnosisFiguresData(), /\$\.view: expected an object, found nothing/],
  ['a cell missing', changed(diagnosisData(), (d) => d.view.tables[0].rows[1].pop()), diagnosisFiguresData(), /\$\.view\.tables\[0\]\.rows\[1\]: expected 5 texts/],
  ['no answer', changed(diagnosisData(), (d) => delete d.answer), diagnosisFiguresData(), /\$\.answer: expected a text, found nothing/],
  ['a sample missing', diagnosisData(), changed(diagnosisFiguresData(), (f) => f.segment.channels[0].retuned.pop()), /\$\.segment\.channels\[0\]\.retuned: expected 60 numbers/],
  ['a point missing', diagnosisData(), changed(diagnosisFiguresData(), (f) => f.unknown_signal.axes[1].values.pop()), /\$\.unknown_signal\.axes\[1\]\.values: expected 60 numbers/],
];

for (const [name, diagnosis, figures, message] of MISTAKES) {
  test(`a diagnosis that is wrong (${name}) gives one message, exit status 2 and no page`, () =>
    on(diagnosisFolder(diagnosis, figures), (directory) => {
      const run = render(directory);
      assert.equal(run.status, 2, run.stderr);
      assert.match(run.stderr, message);
      assert.equal(run.stderr.trim().split('\n').length, 1);
      assert.deepEqual(readdirSync(directory).filter((file) => file.endsWith('.html')), []);
      assert.ok(!existsSync(join(directory, 'd.html.part')));
    }));
}
