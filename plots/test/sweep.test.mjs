import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import test from 'node:test';
import { fileURLToPath } from 'node:url';
import vm from 'node:vm';

const RENDER = fileURLToPath(new URL('../render.mjs', import.meta.url));

function statistics(median, n) {
  return { median, q05: median - 1, q95: median + 1, min: median - 2, max: median + 2, worst: median - 2, n_ok: n, n };
}

/** A sweep over two axes; the second method fails once at 20 dB. */
function tableData(cells = 4) {
  const at = (i) => ({ snr_db: 40 - 20 * (i % 2), method: `</script> method ${Math.floor(i / 2)}` });
  return {
    schema: 'wheelhop.table/2',
    grid: { measure: 'refined', realisations: 3, axes: [{ name: 'snr_db', labels: ['40', '20'] }, { name: 'method', labels: [] }], base: {} },
    excluded_cells: 0,
    cells: Array.from({ length: cells }, (_, i) => ({
      cell: i, ...at(i), n_ok: i === 3 ? 2 : 3, n: 3,
      ...(i === 3 ? { failures: [{ message: 'it <b>diverged</b>', count: 1 }] } : {}),
      columns: { order: statistics(4, 3), refined_vaf_axle: statistics(90 + (i % 9), 3), linear_vaf_axle: statistics(70, 3) },
    })),
    comparison: null,
    provenance: { program: 'wheelhop', commit: 'abc' },
  };
}

function on(data, body, compare) {
  const directory = mkdtempSync(join(tmpdir(), 'wheelhop-sweep-'));
  try {
    writeFileSync(join(directory, 'table.json'), JSON.stringify(data));
    if (compare) writeFileSync(join(directory, 'compare.json'), JSON.stringify(compare));
    const run = spawnSync(process.execPath, [RENDER, directory], { encoding: 'utf8' });
    body(run, () => readFileSync(join(directory, 'report.html'), 'utf8'));
  } finally {
    rmSync(directory, { recursive: true, force: true });
  }
}

test('the page holds every cell and number of the table, and no text of it can end a script', () =>
  on(tableData(), (run, page) => {
    assert.equal(run.status, 0, run.stderr);
    const html = page();
    const json = html.match(/<script type="application\/json" id="sweep">([^<]*)<\/script>/);
    const sweep = JSON.parse(json[1]);
    assert.equal(sweep.cells.length, 4);
    assert.deepEqual(sweep.columns.slice(0, 2), ['refined_vaf_axle', 'linear_vaf_axle']);
    assert.deepEqual(sweep.cells[3].columns.refined_vaf_axle, [93, 92, 94, 91, 3, 3]);
    assert.equal(sweep.cells[1].at[1], '</script> method 0');
    assert.match(html, /4 cells, 12 rows, 11 of them ok/);
    assert.doesNotMatch(html, /https?:\/\/(?!www\.w3\.org)/);
  }));

test('numbers of the result that are texts are escaped, and a part that is missing gives one message', () => {
  const data = tableData();
  data.excluded_cells = '<img src=x>';
  data.until = { realisations: '<b>20</b>', claims: [] };
  on(data, (run, page) => {
    assert.equal(run.status, 0, run.stderr);
    assert.doesNotMatch(page(), /<(img|b)\b/);
    assert.ok(page().includes('&#60;img src=x&#62;'));
  });
  for (const damage of [(d) => (d.cells[0].columns.order = null), (d) => delete d.until.claims, (d) => (d.grid.axes[0] = null)]) {
    const broken = tableData();
    broken.until = { realisations: 20, claims: [] };
    damage(broken);
    on(broken, (run) => {
      assert.equal(run.status, 2, run.stderr);
      assert.equal(run.stderr.trim().split('\n').length, 1);
      assert.doesNotMatch(run.stderr, /^\s+at /m);
    });
  }
});

test('axes that vary together are told to the page', () => {
  const data = tableData();
  data.grid.axes[0].zip = data.grid.axes[1].zip = 1;
  on(data, (run, page) => {
    assert.equal(run.status, 0, run.stderr);
    const json = page().match(/<script type="application\/json" id="sweep">([^<]*)<\/script>/);
    assert.deepEqual(JSON.parse(json[1]).zips, [1, 1]);
  });
});

test('the code of the page is a valid script', () =>
  on(tableData(), (run, page) => {
    const code = page().match(/<script>\n([\s\S]*?)<\/script>/)[1];
    assert.doesNotThrow(() => new vm.Script(code));
  }));

test('ten thousand cells make a page of a few megabytes in a few seconds', () =>
  on(tableData(10000), (run, page) => {
    assert.equal(run.status, 0, run.stderr);
    assert.ok(page().length < 8e6);
  }));

test('another schema, a table without cells and a broken file are refused in one message', () => {
  for (const [edit, words] of [
    [(data) => (data.schema = 'wheelhop.table/1'), 'wheelhop.table/2'],
    [(data) => (data.cells = []), '$.cells'],
    [(data) => delete data.grid.measure, '$.grid.measure'],
  ]) {
    const data = tableData();
    edit(data);
    on(data, (run) => {
      assert.equal(run.status, 2);
      assert.ok(run.stderr.includes(words), run.stderr);
      assert.equal(run.stderr.trim().split('\n').length, 1);
    });
  }
});
