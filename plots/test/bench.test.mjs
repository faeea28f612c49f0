import assert from 'node:assert/strict';
import { test } from 'node:test';
import { inOrder, ratios, toSvg } from '../bench.mjs';

const result = {
  schema: 'wheelhop.bench/1',
  processor: 'a processor <with> "signs"',
  results: [
    { what: 'R factor', case: 'N=2k', variant: 'wheelhop', ms: { median: 1 } },
    { what: 'R factor', case: 'N=2k', variant: 'peer & co', ms: { median: 4 }, ratio: 4 },
    { what: 'R factor', case: 'N=20k', variant: 'peer & co', failed: 'it did' },
    { what: 'Riccati equation', case: 'n=005', variant: 'other', ms: { median: 1 }, ratio: 0.5 },
  ],
};

test('one mark a peer that ran, the same bytes each time, all text escaped', async () => {
  assert.deepEqual(ratios(result).map((item) => item.ratio), [4, 0.5]);
  assert.deepEqual(ratios(result).map((item) => item.of), ['N=2k', 'n=5']);
  const svg = await toSvg(result);
  assert.equal(svg, await toSvg(result));
  assert.match(svg, /Wheelhop is faster in 1 of 2/);
  assert.match(svg, /peer &amp; co/);
  assert.doesNotMatch(svg, /<with>/);
});

test('another file gives one clear error', async () => {
  await assert.rejects(async () => toSvg({ schema: 'wheelhop.sweep/1' }), /wheelhop bench --out/);
});

test('cases stand in the order of their sizes', () => {
  const cases = ['N=200k s=20', 'N=2M s=20', 'N=20k s=40', 'N=2k s=20', 'N=20k s=20'];
  assert.deepEqual(inOrder(cases), ['N=2k s=20', 'N=20k s=20', 'N=200k s=20', 'N=2M s=20', 'N=20k s=40']);
  assert.deepEqual(inOrder(['on the circle', 'n=010', 'n=005']), ['n=005', 'n=010', 'on the circle']);
});
