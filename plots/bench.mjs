#!/usr/bin/env node
// The figure of a bench result: how many times as long each peer takes.
// Usage: node plots/bench.mjs RESULT.json FIGURE.svg
import { readFileSync, writeFileSync } from 'node:fs';
import { pathToFileURL } from 'node:url';
import { InputError, loadDrawing } from './input.mjs';

/** Case and ratio of every peer, "n=005" as "n=5"; an error where the file is no bench result. */
export function ratios(result) {
  if (result?.schema !== 'wheelhop.bench/1' || !Array.isArray(result.results))
    throw new Error('expected a file that `wheelhop bench --out` wrote (schema wheelhop.bench/1)');
  return result.results
    .filter((item) => Number.isFinite(item.ratio))
    .map(({ what, variant, case: of, ratio }) => ({ what, variant, of: of.replace(/=0+(?=\d)/, '='), ratio }));
}

/** "N=20k s=20" as [20000, "s=20"], for an order by size. */
function sizeOf(of) {
  const found = /^[^ =]*=(\d+)([kM]?)(.*)$/.exec(of);
  if (!found) return [Infinity, of];
  return [Number(found[1]) * { '': 1, k: 1e3, M: 1e6 }[found[2]], found[3]];
}

/** Cases by what stands behind the size, then by the size. */
export function inOrder(cases) {
  return [...new Set(cases)].sort((a, b) => {
    const [x, restX] = sizeOf(a);
    const [y, restY] = sizeOf(b);
    return restX === restY ? x - y : restX < restY ? -1 : 1;
  });
}

/** One panel a kernel, one mark a peer and case, on a scale of powers: right of 1 wheelhop is ahead. */
export function specification(result) {
  const values = ratios(result);
  const order = [...new Set(values.map((item) => item.what))];
  const legend = { title: null, orient: 'right', labelLimit: 220 };
  const panels = order.map((what) => {
    const own = values.filter((item) => item.what === what);
    return {
      width: 460,
      height: { step: 16 },
      title: { text: what, anchor: 'start', frame: 'group', fontSize: 13, color: '#1c1f23' },
      data: { values: own },
      layer: [
        {
          mark: { type: 'rule', color: '#1c1f23', strokeDash: [3, 3] },
          encoding: { x: { datum: 1, type: 'quantitative' } },
        },
        {
          mark: { type: 'point', filled: true, size: 60 },
          encoding: {
            x: {
              field: 'ratio',
              type: 'quantitative',
              scale: { type: 'log', domain: [0.25, 1000] },
              axis: {
                title: what === order.at(-1) ? "peer's time over ours (right of 1 wheelhop is faster)" : null,
                values: [0.25, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500],
                gridColor: '#e3e6ea',
              },
            },
            y: { field: 'of', type: 'nominal', sort: inOrder(own.map((item) => item.of)), axis: { title: null, labelLimit: 220 } },
            color: { field: 'variant', type: 'nominal', sort: null, legend },
            shape: { field: 'variant', type: 'nominal', sort: null, legend },
          },
        },
      ],
    };
  });
  return {
    $schema: 'https://vega.github.io/schema/vega-lite/v5.json',
    background: '#ffffff',
    padding: 12,
    title: {
      text: 'Kernels beside their peers',
      subtitle: `One thread of ${result.processor}; medians of interleaved repetitions`,
      anchor: 'start',
      offset: 14,
      fontSize: 16,
      subtitleFontSize: 12,
      subtitleColor: '#4a5058',
    },
    vconcat: panels,
    resolve: { scale: { color: 'independent', shape: 'independent' }, legend: { color: 'independent', shape: 'independent' } },
    config: { range: { category: ['#0072b2', '#d55e00', '#007a5a', '#b08900'] } },
  };
}

export async function toSvg(result) {
  const values = ratios(result);
  const ahead = values.filter((item) => item.ratio >= 1).length;
  const words = `Time of each peer over that of wheelhop, by kernel and case, on a logarithmic scale. Wheelhop is faster in ${ahead} of ${values.length}.`;
  const [{ drawSvg }] = await loadDrawing('./figure.mjs');
  return drawSvg(specification(result), 'bench', 'Kernels beside their peers', words);
}

if (process.argv[1] && import.meta.url === pathToFileURL(process.argv[1]).href) {
  const [from, to] = process.argv.slice(2);
  if (!from || !to) {
    console.error('usage: node plots/bench.mjs RESULT.json FIGURE.svg');
    process.exit(2);
  }
  try {
    writeFileSync(to, await toSvg(JSON.parse(readFileSync(from, 'utf8'))));
  } catch (error) {
    console.error(`plots/bench.mjs: ${error instanceof InputError ? '' : `${from}: `}${error.message}`);
    process.exit(1);
  }
}
