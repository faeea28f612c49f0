// Draws the tables of a sweep from the JSON in the page. Every number shown is one of the JSON.
(() => {
  'use strict';
  const sweep = JSON.parse(document.getElementById('sweep').textContent);
  const { axes, zips, cells, columns, comparison } = sweep;
  const MOST_ROWS = 400;
  const COLOURS = ['#0072b2', '#d55e00', '#007a5a', '#cc79a7', '#5b6b82', '#b08900', '#56b4e9', '#8c564b'];

  const element = (name, attributes = {}, ...children) => {
    const svg = ['svg', 'g', 'line', 'rect', 'circle', 'path', 'text', 'title'].includes(name);
    const made = svg ? document.createElementNS('http://www.w3.org/2000/svg', name) : document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.append(...children.filter((child) => child !== null).map((child) => (child instanceof Node ? child : String(child))));
    return made;
  };
  const text = (value) => (value === null || value === undefined ? 'failed' : typeof value === 'number' ? short(value) : String(value));
  const short = (value) => {
    if (value > 99 && value < 100) return value.toFixed(Math.min(5, Math.max(1, Math.ceil(-Math.log10(100 - value)) + 1)));
    return String(Number(value.toPrecision(4))).replace('-', '\u2212');
  };
  const isBetterLarge = (column) => column.includes('_vaf_') || column.endsWith('_r2');
  const isBetterSmall = (column) => column.includes('_rmse_') || column.endsWith('_cost');

  /** A labelled choice; calls back with the index chosen. */
  const choice = (place, label, options, start, changed) => {
    const select = element('select');
    options.forEach((option, i) => select.append(element('option', { value: i, ...(i === start ? { selected: '' } : {}) }, option)));
    select.addEventListener('change', () => changed(Number(select.value)));
    place.append(element('label', {}, label, select));
    return select;
  };
  const valuesOf = (axis) => {
    const seen = new Map();
    for (const cell of cells) seen.set(JSON.stringify(cell.at[axis]), cell.at[axis]);
    return [...seen.values()];
  };
  const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);
  const varied = axes.map((_, i) => i).filter((i) => valuesOf(i).length > 1);
  const named = (cell) => varied.map((i) => `${axes[i]} ${cell.at[i]}`).join(', ');

  /** Whether two axes vary together. */
  const together = (i, k) => i === k || (zips[i] !== null && zips[i] === zips[k]);

  // --- the maps -------------------------------------------------------------------------------------------------
  const state = {
    column: 0,
    x: varied[0] ?? 0,
    y: varied.filter((i) => !together(i, varied[0])).pop() ?? -1,
    fixed: axes.map((_, i) => valuesOf(i)[0]),
  };

  /** From pale (worst) to blue (best); the pages' dark scheme keeps the same marks. */
  const shade = (share) => {
    const mix = (a, b) => Math.round(a + (b - a) * share);
    return [`rgb(${mix(246, 0)}, ${mix(238, 95)}, ${mix(220, 150)})`, share > 0.55 ? '#ffffff' : '#1c1f23'];
  };

  /** Whether an axis is across or down in the map, or varies together with one that is. */
  const isShown = (i) => together(i, state.x) || (state.y >= 0 && together(i, state.y));

  const map = (place, value, words, scale) => {
    const xs = valuesOf(state.x), ys = state.y < 0 ? [null] : valuesOf(state.y);
    const found = (x, y) => cells.find((cell) => axes.every((_, i) =>
      i === state.x ? same(cell.at[i], x) : i === state.y ? same(cell.at[i], y) : isShown(i) || same(cell.at[i], state.fixed[i])));
    const table = element('table', { class: 'map' });
    const head = element('tr', {}, element('th', { scope: 'col' }, state.y < 0 ? '' : `${axes[state.y]} \\ ${axes[state.x]}`));
    xs.forEach((x) => head.append(element('th', { scope: 'col', class: 'num' }, x)));
    table.append(element('thead', {}, head));
    const body = element('tbody');
    for (const y of ys) {
      const row = element('tr', {}, element('th', { scope: 'row' }, y ?? ''));
      for (const x of xs) {
        const cell = found(x, y);
        const number = cell ? value(cell) : undefined;
        if (number === undefined) {
          row.append(element('td', { class: 'none', title: cell ? 'no such number' : 'no such cell' }, '\u2013'));
          continue;
        }
        const share = scale(number);
        const [back, front] = share === null ? ['transparent', 'inherit'] : shade(share);
        row.append(element('td', { style: `background:${back};color:${front}`, title: `${named(cell)}: ${words(cell)}` }, text(number)));
      }
      body.append(row);
    }
    table.append(body);
    place.replaceChildren(table);
  };

  const drawMaps = () => {
    const column = columns[state.column];
    const down = isBetterSmall(column);
    // Marks by powers of ten of what is left to 100 % or to 1, or of the number itself.
    const perfect = column.includes('_vaf_') ? 100 : column.endsWith('_r2') ? 1 : 0;
    const logarithm = (value) => Math.log10(Math.max(1e-12, perfect ? perfect - value : Math.abs(value)));
    const numbers = cells.map((cell) => cell.columns[column]?.[0]).filter((value) => typeof value === 'number').map(logarithm);
    const low = Math.min(...numbers), high = Math.max(...numbers);
    const scale = (value) => {
      if (value === null) return null;
      const share = (logarithm(value) - low) / Math.max(high - low, 0.3);
      return perfect || down ? 1 - share : share;
    };
    const place = document.getElementById('map');
    map(place, (cell) => (cell.columns[column] ? cell.columns[column][0] : cell.ok === 0 ? null : undefined), (cell) => {
      const [median, low, high, worst, ok, n] = cell.columns[column] ?? [];
      return `median ${text(median)}, 5 to 95 % ${text(low)} to ${text(high)}${worst === undefined || !(isBetterLarge(column) || down) ? '' : `, worst ${text(worst)}`}, ${ok ?? 0} of ${n ?? cell.n} rows`;
    }, scale);
    const order = isBetterLarge(column) ? 'larger is better' : down ? 'smaller is better' : 'no better direction';
    place.append(element('p', { class: 'scale' }, `${column}: median of the realisations; ${order}; shades by powers of ten${perfect ? ` of what is left to ${perfect}` : ''}. Point at a cell for its range.`));
    map(document.getElementById('failures'), (cell) => (cell.n - cell.ok) / cell.n, (cell) => `${cell.n - cell.ok} of ${cell.n} failed`,
      (share) => (share === 0 ? null : share));
  };

  const mapControls = () => {
    const place = document.getElementById('map-controls');
    place.replaceChildren();
    choice(place, 'number', columns, state.column, (i) => { state.column = i; drawMaps(); });
    choice(place, 'across', axes, state.x, (i) => { state.x = i; if (state.y >= 0 && together(state.y, i)) state.y = -1; mapControls(); drawMaps(); });
    const down = [-1, ...axes.keys()].filter((i) => i < 0 || !together(i, state.x));
    choice(place, 'down', down.map((i) => (i < 0 ? 'nothing' : axes[i])), down.indexOf(state.y), (k) => { state.y = down[k]; mapControls(); drawMaps(); });
    for (const i of [...axes.keys()].filter((axis) => !isShown(axis) && valuesOf(axis).length > 1)) {
      const values = valuesOf(i);
      choice(place, axes[i], values, values.findIndex((value) => same(value, state.fixed[i])), (k) => {
        state.fixed[i] = values[k];
        // The axes of one zip go to the values that they have together.
        const cell = cells.find((one) => same(one.at[i], values[k]));
        for (const other of axes.keys()) if (other !== i && together(i, other)) state.fixed[other] = cell.at[other];
        mapControls();
        drawMaps();
      });
    }
  };

  const failureList = () => {
    // Messages that differ in their numbers alone are one kind, shown by its first.
    const counts = new Map();
    for (const cell of cells) for (const { message, count } of cell.failures) {
      const kind = message.replace(/\d[\d.e+-]*/g, '#');
      const known = counts.get(kind) ?? { message, count: 0 };
      counts.set(kind, { ...known, count: known.count + count });
    }
    const place = document.getElementById('failure-list');
    if (counts.size === 0) { place.replaceChildren(element('p', {}, 'No row failed.')); return; }
    const list = element('ul');
    [...counts.values()].sort((a, b) => b.count - a.count).slice(0, 30).forEach(({ message, count }) => list.append(element('li', {}, `${count} ${count === 1 ? 'row' : 'rows, for example'}: ${message}`)));
    place.replaceChildren(list);
  };

  // --- the comparison -------------------------------------------------------------------------------------------
  const line = (x1, y1, x2, y2, kind, more = {}) => element('line', { x1, y1, x2, y2, class: kind, ...more });
  const label = (x, y, words, anchor = 'start', kind = '') => element('text', { x, y, 'text-anchor': anchor, class: kind }, words);
  const chart = (width, height, words) =>
    element('svg', { class: 'chart', viewBox: `0 0 ${width} ${height}`, width, height, role: 'img', 'aria-label': words });

  /** Median differences with their intervals; the grey band holds what counts as a tie. */
  const intervals = (one) => {
    const ends = one.pairs.flatMap((pair) => [...pair.ci95, pair.median_difference]).filter((value) => typeof value === 'number');
    const low = Math.min(0, -one.equivalence, ...ends), high = Math.max(0, one.equivalence, ...ends);
    const left = 330, right = 170, width = 960, row = 24, height = 40 + row * one.pairs.length;
    const x = (value) => left + ((value - low) / (high - low || 1)) * (width - left - right);
    const picture = chart(width, height, 'Median paired differences with 95 % intervals');
    picture.append(element('rect', { class: 'tie', x: x(-one.equivalence), y: 6, width: Math.max(1, x(one.equivalence) - x(-one.equivalence)), height: height - 30 }));
    picture.append(line(x(0), 6, x(0), height - 24, 'zero'));
    one.pairs.forEach((pair, i) => {
      const y = 20 + row * i, colour = pair.verdict === 'better' ? COLOURS[0] : pair.verdict === 'equivalent' ? COLOURS[2] : COLOURS[4];
      picture.append(label(left - 12, y + 4, `${pair.a} over ${pair.b}`.slice(0, 52), 'end'));
      if (typeof pair.median_difference !== 'number') { picture.append(label(x(0) + 8, y + 4, 'the other one failed', 'start', 'soft')); return; }
      const end = pair.ci95[1] ?? high;
      picture.append(line(x(pair.ci95[0] ?? low), y, x(end), y, '', { stroke: colour, 'stroke-width': 2 }));
      picture.append(element('circle', { cx: x(pair.median_difference), cy: y, r: 4, fill: colour }));
      picture.append(label(width - right + 12, y + 4, `${text(pair.median_difference)} (${pair.wins}/${pair.ties}/${pair.losses})`, 'start', 'soft'));
    });
    picture.append(label(x(0), height - 6, 'no difference', 'middle', 'soft'));
    picture.append(label(width - right + 12, height - 6, 'wins/ties/losses', 'start', 'soft'));
    return picture;
  };

  /** Demsar's critical-difference diagram: mean ranks, and bars over what the ranks do not tell apart. */
  const ranks = (one) => {
    const methods = one.methods.filter(({ mean_rank: rank }) => typeof rank === 'number').sort((a, b) => a.mean_rank - b.mean_rank);
    if (methods.length < 2) return null;
    const k = methods.length, cd = one.friedman.critical_difference;
    const groups = [];
    methods.forEach((first, i) => {
      let last = i;
      while (last + 1 < k && methods[last + 1].mean_rank - first.mean_rank <= cd) ++last;
      if (last > i && !groups.some(([a, b]) => a <= i && b >= last)) groups.push([i, last]);
    });
    const width = 860, left = 260, right = 260, half = Math.ceil(k / 2);
    const top = 50 + 9 * groups.length, height = top + 22 * half + 10;
    const x = (rank) => left + ((rank - 1) / (k - 1)) * (width - left - right);
    const picture = chart(width, height, 'Mean ranks with the critical difference');
    picture.append(line(x(1), 40, x(k), 40, 'mark'));
    for (let rank = 1; rank <= k; ++rank) picture.append(line(x(rank), 34, x(rank), 40, 'mark'), label(x(rank), 28, rank, 'middle', 'soft'));
    picture.append(line(x(1), 10, x(Math.min(k, 1 + cd)), 10, 'mark', { 'stroke-width': 2 }), label(x(Math.min(k, 1 + cd)) + 6, 14, `critical difference ${text(cd)}`, 'start', 'soft'));
    groups.forEach(([a, b], i) => picture.append(line(x(methods[a].mean_rank) - 3, 48 + 9 * i, x(methods[b].mean_rank) + 3, 48 + 9 * i, 'mark', { 'stroke-width': 4 })));
    methods.forEach((method, i) => {
      const toLeft = i < half, y = top + 22 * (toLeft ? i : k - 1 - i);
      const end = toLeft ? left - 8 : width - right + 8;
      picture.append(element('path', { d: `M${x(method.mean_rank)} 40 V${y} H${end}`, fill: 'none', class: 'mark' }));
      picture.append(label(toLeft ? end - 6 : end + 6, y + 4, `${method.label.slice(0, 30)} ${text(method.mean_rank)}`, toLeft ? 'end' : 'start'));
    });
    return picture;
  };

  /** Dolan and More's profiles. */
  const profiles = (one) => {
    if (!one.profile) return null;
    const { tau, share } = one.profile, names = Object.keys(share);
    const width = 860, height = 260, left = 50, right = 250, bottom = 34;
    const x = (value) => left + (Math.log(value) / Math.log(tau[tau.length - 1])) * (width - left - right);
    const y = (value) => 10 + (1 - value) * (height - bottom - 10);
    const picture = chart(width, height, 'Performance profiles');
    for (const value of [0, 0.25, 0.5, 0.75, 1]) picture.append(line(left, y(value), width - right, y(value), 'axis'), label(left - 6, y(value) + 4, value, 'end', 'soft'));
    for (const value of [1, 2, 5, 10, 100, 1000].filter((mark) => mark <= tau[tau.length - 1])) picture.append(label(x(value), height - bottom + 18, value, 'middle', 'soft'));
    picture.append(label((left + width - right) / 2, height - 2, 'what is left, relative to the best method', 'middle', 'soft'));
    names.forEach((name, i) => {
      const colour = COLOURS[i % COLOURS.length];
      const points = tau.map((value, k) => `${k === 0 ? 'M' : 'L'}${x(value).toFixed(1)} ${y(share[name][k]).toFixed(1)}`).join(' ');
      picture.append(element('path', { d: points, fill: 'none', stroke: colour, 'stroke-width': 2, ...(i >= COLOURS.length ? { 'stroke-dasharray': '5 3' } : {}) }));
      picture.append(line(width - right + 14, 20 + 18 * i, width - right + 34, 20 + 18 * i, '', { stroke: colour, 'stroke-width': 3 }), label(width - right + 40, 24 + 18 * i, name.slice(0, 30)));
    });
    return picture;
  };

  const compared = comparison?.comparisons ?? [];
  const place = (one) => Object.entries(one.at).map(([axis, value]) => `${axis} ${value}`).join(', ') || 'all cells';
  const drawPairs = (i) => {
    const target = document.getElementById('pairs');
    const one = compared[i];
    const list = element('ul', { class: 'sentences' });
    one.pairs.slice(0, 60).forEach((pair) => list.append(element('li', { class: pair.verdict }, pair.sentence)));
    const words = one.pairs.length > 6 ? element('details', {}, element('summary', {}, `In words: ${one.pairs.length} pairs`), list) : list;
    const parts = [words, intervals({ ...one, pairs: one.pairs.slice(0, 60) })];
    if (one.friedman) {
      parts.push(element('h3', {}, 'Mean ranks'), ranks(one), element('p', { class: 'scale' },
        `Friedman\u2019s test over ${one.blocks} complete blocks: \u03c7\u00b2 ${text(one.friedman.chi2)}, p ${text(one.friedman.p)}. Bars join what Nemenyi\u2019s test does not tell apart.`));
    }
    const profile = profiles(one);
    if (profile) parts.push(element('h3', {}, 'Performance profiles'), profile, element('p', { class: 'scale' },
      'Share of the records on which a method leaves at most so many times what the best one leaves (100 \u2212 VAF, 1 \u2212 R\u00b2, RMSE or cost).'));
    target.replaceChildren(...parts.filter((part) => part));
  };
  if (compared.length > 0) {
    const controls = document.getElementById('pair-controls');
    const pick = { metric: compared[0].metric, at: place(compared[0]) };
    const metrics = [...new Set(compared.map((one) => one.metric))], places = [...new Set(compared.map(place))];
    const redraw = () => drawPairs(Math.max(0, compared.findIndex((one) => one.metric === pick.metric && place(one) === pick.at)));
    choice(controls, 'number', metrics, 0, (i) => { pick.metric = metrics[i]; redraw(); });
    choice(controls, 'at', places, 0, (i) => { pick.at = places[i]; redraw(); });
    redraw();
  } else {
    document.getElementById('pairs').append(element('p', {}, 'No comparison is in the table; `wheelhop compare DIR --over AXIS` writes one, and `wheelhop report DIR` then shows it.'));
  }

  // --- the cells ------------------------------------------------------------------------------------------------
  const filters = axes.map(() => null);
  const drawCells = () => {
    const shown = cells.filter((cell) => filters.every((wanted, i) => wanted === null || same(cell.at[i], wanted)));
    const heads = columns.slice(0, 3);
    const table = element('table');
    const head = element('tr');
    [...varied.map((i) => axes[i]), ...heads, 'ok'].forEach((name, i) => head.append(element('th', { scope: 'col', ...(i >= varied.length ? { class: 'num' } : {}) }, name)));
    const body = element('tbody');
    for (const cell of shown.slice(0, MOST_ROWS)) {
      const row = element('tr');
      varied.forEach((i) => row.append(element('td', {}, cell.at[i])));
      for (const column of heads) {
        const numbers = cell.columns[column];
        row.append(element('td', { class: 'num' }, numbers ? text(numbers[0]) : '\u2013',
          numbers ? element('small', {}, `${text(numbers[1])} to ${text(numbers[2])}`) : null));
      }
      row.append(element('td', { class: 'num' }, `${cell.ok}/${cell.n}`));
      body.append(row);
    }
    table.append(element('caption', {}, `${shown.length} cells${shown.length > MOST_ROWS ? `, the first ${MOST_ROWS} shown; narrow them down above` : ''}: median, 5 to 95 %`), element('thead', {}, head), body);
    document.getElementById('cells').replaceChildren(table);
  };
  for (const i of varied) {
    const values = valuesOf(i);
    choice(document.getElementById('table-controls'), axes[i], ['all', ...values], 0, (k) => { filters[i] = k === 0 ? null : values[k - 1]; drawCells(); });
  }

  mapControls();
  drawMaps();
  failureList();
  drawCells();
  document.documentElement.dataset.drawn = 'yes';
})();
