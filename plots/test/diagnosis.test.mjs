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
    for (const text of ['Why simulation and rig disagree: coulomb friction at strut', 'Coulomb friction at strut', 'force_n = 41.2', '0.93', '98 %', '90 % of a record', 'the gain of acc goes from 0 to 0.1',
      '20 % linear, 70 % odd, 10 % even', '40 % of it in 10 % of the time, at strut velocity', 'Do not trust it there', 'tyre, actuator', 'Force at strut (N)', '>Share</th>', '76 %',
      'static map of travel and rate at strut', '33 %', '94 %', '17 of 20 diagnoses', 'coulomb friction at strut 17, none 3', 'acc (m/s\u00b2)', '3 to 50'])
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
    d.where.without_catalogue = [];
    delete d.where.after_retuning;
    delete d.how_far.ceiling;
    delete d.placebo;
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
    assert.ok(html.includes('the drive is not periodic'));
    assert.doesNotMatch(html, /NaN|undefined|Infinity/);
  });
});

test('what has no ceiling, what cannot be simulated and what leaves nothing to remove says why', () => {
  const diagnosis = changed(diagnosisData(), (d) => {
    d.how_far.ceiling = { location: 'sensor:acc', absent: 'no <force>' };
    d.placebo = { absent: 'outside the catalogue' };
    d.which.effects[0].share = null;
    d.how_far.beyond_envelope.closure = null;
  });
  on(diagnosisFolder(diagnosis), (directory) => {
    assert.equal(render(directory).status, 0);
    const html = page(directory);
    for (const text of ['There is no ceiling of a static map: no &#60;force&#62;', 'Placebo: none, outside the catalogue', '4 % of the time; nothing is above the noise there.']) assert.ok(html.includes(text), text);
    assert.ok(!html.includes('any signal at') && !html.includes('>Share<'));
    assert.doesNotMatch(html, /NaN|undefined|Infinity/);
  });
});

test('checks are shown whatever they hold', () => {
  const diagnosis = changed(diagnosisData(), (d) => (d.checks = [{ name: 'parameter_homing', passed: true, chi2: 3.25 }, { name: 'nothing of note is left', passed: false, detail: 'misfit 1.5' }]));
  on(diagnosisFolder(diagnosis), (directory) => {
    assert.equal(render(directory).status, 0);
    assert.match(page(directory), /Parameter homing<\/dt><dd>Passed: Chi2: 3.25</);
    assert.match(page(directory), /Nothing of note is left<\/dt><dd>Not passed: misfit 1.5</);
  });
});

test('pairs of places are shown where no single one explains all, and only there', () => {
  for (const [needed, says] of [[2, 'channels. Two at once do:'], [1, 'unless a force there jumps. Two'], [0, 'channels, nor do two:']]) {
    const diagnosis = changed(diagnosisData(), (d) => {
      d.where.places_needed = needed;
      d.where.two_places = [{ locations: ['strut', 'sensor:acc'], leftover_chi2: 1.04 }, { locations: ['strut', 'tyre'], leftover_chi2: 9 }];
    });
    on(diagnosisFolder(diagnosis), (directory) => {
      assert.equal(render(directory).status, 0);
      const html = page(directory);
      assert.ok(html.includes(says));
      assert.match(html, /strut and sensor:acc<\/th><td class="num">1.04</);
    });
  }
  on(diagnosisFolder(diagnosisData()), (directory) => {
    assert.equal(render(directory).status, 0);
    assert.ok(!page(directory).includes('Two at once'));
  });
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
    diagnosis.placebo.same = diagnosis.placebo.runs = hostile;
    for (const { misfit, channel } of diagnosis.how_far.per_channel) assert.ok(misfit && channel.includes(hostile));
    on(diagnosisFolder(diagnosis, spoil(diagnosisFiguresData())), (directory) => {
      const run = render(directory);
      assert.equal(run.status, 0, run.stderr);
      const html = page(directory);
      assert.doesNotMatch(html, /<(script|img|b)\b/);
      assert.ok(html.includes(`It sits in strut. ${escaped(hostile)}`), 'the answer');
      assert.ok(html.includes(`${escaped(hostile)} of ${escaped(hostile)} diagnoses`), 'the placebo');
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
