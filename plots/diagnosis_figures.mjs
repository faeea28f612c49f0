// The figures of a diagnosis as Vega-Lite specifications: how far, one bad second, bands, time, places, working range,
// and the unknown signal. Colours are those of figure.vl.json, which page.css turns for a dark page.
import { STAGES } from './diagnosis_input.mjs';
import { unitText } from './text.mjs';

const WIDTH = 640;
const COLOURS = { 'as delivered': '#d55e00', 're-tuned': '#0072b2', 'with the answer': '#007a5a', measured: '#aab1bb' };
const config = {
  aria: false,
  font: "system-ui, 'Helvetica Neue', Helvetica, Arial, sans-serif",
  view: { stroke: null },
  axis: {
    labelFontSize: 12, titleFontSize: 13, titleFontWeight: 'normal', titlePadding: 10, labelLimit: 260,
    labelColor: '#33383f', titleColor: '#1c1f23', domainColor: '#6b727b', tickColor: '#6b727b', gridColor: '#d5d9df',
  },
  legend: { orient: 'top', direction: 'horizontal', title: null, offset: 12, columnPadding: 16, labelFontSize: 12.5, labelColor: '#1c1f23', labelLimit: 0 },
};
const base = (spec) => ({ $schema: 'https://vega.github.io/schema/vega-lite/v5.json', padding: 12, background: '#ffffff', config, ...spec });
const stageColour = (names, legend = {}) => ({
  field: 'stage', type: 'nominal', sort: null, scale: { domain: names, range: names.map((name) => COLOURS[name]) }, legend,
});
const named = (byStage, make) =>
  Object.entries(STAGES).flatMap(([key, stage]) => (Number.isFinite(byStage[key]) ? [{ stage, ...make(byStage[key]) }] : []));
const present = (values) => Object.values(STAGES).filter((stage) => values.some((value) => value.stage === stage));

/** RMS error of each channel over its noise, one row a channel. */
function channels({ how_far }) {
  const values = how_far.per_channel.flatMap(({ channel, misfit }) =>
    named(misfit, (value) => ({ channel, size: Math.max(Math.sqrt(value), 0.1) })),
  );
  const height = 24 + 34 * how_far.per_channel.length;
  const largest = Math.max(2, ...values.map(({ size }) => size));
  const y = { field: 'channel', type: 'nominal', sort: null, axis: { title: null, ticks: false, domain: false } };
  const x = {
    field: 'size', type: 'quantitative', scale: { type: 'log', domain: [Math.min(0.8, ...values.map(({ size }) => size)), 1.15 * largest], nice: false },
    axis: { title: 'RMS error over the noise of the channel (1: nothing but noise)', values: [0.1, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 1e4], format: '~r' },
  };
  return base({
    width: WIDTH - 120, height,
    data: { values },
    layer: [
      { data: { values: [{ floor: 1 }] }, mark: { type: 'rule', color: '#5b6b82', strokeWidth: 2, strokeDash: [4, 3] }, encoding: { x: { field: 'floor', type: 'quantitative' } } },
      { mark: { type: 'rule', color: '#aab1bb', strokeWidth: 2 }, encoding: { y, x: { aggregate: 'min', field: 'size', type: 'quantitative' }, x2: { aggregate: 'max', field: 'size' } } },
      { mark: { type: 'point', filled: true, size: 130, opacity: 1 }, encoding: { y, x, color: stageColour(present(values), { symbolType: 'circle' }), shape: { field: 'stage', type: 'nominal', sort: null, scale: { domain: Object.values(STAGES), range: ['circle', 'square', 'diamond'] }, legend: null } } },
    ],
  });
}

/** Measured and simulated over the stretch in which the plant as delivered is worst, and below each channel its error. */
function segment({ segment: data }) {
  const keys = { measured: 'measured', ...Object.fromEntries(Object.entries(STAGES).map(([key, stage]) => [stage, key])) };
  const lines = Object.keys(keys);
  const scales = { color: lines.map((line) => COLOURS[line]), strokeWidth: [4.5, 1.7, 1.7, 1.4], strokeDash: [[1, 0], [6, 4], [9, 3, 2, 3], [1, 0]] };
  const style = (legend) =>
    Object.fromEntries(Object.entries(scales).map(([channel, range]) => [channel, {
      field: 'line', type: 'nominal', sort: null, scale: { domain: lines, range },
      legend: channel === 'color' && legend ? { symbolType: 'stroke', symbolSize: 700 } : null,
    }]));
  const x = (title) => ({ field: 'time_s', type: 'quantitative', scale: { nice: false, zero: false }, axis: { title, labels: title !== null, ticks: title !== null, grid: false, tickCount: 10 } });
  const y = (title, ticks) => ({ field: 'value', type: 'quantitative', scale: { zero: false }, axis: { title, tickCount: ticks, titlePadding: 6, minExtent: 55 } });
  const values = (channel, of) =>
    lines.filter((line) => of(line) && channel[keys[line]] !== undefined).flatMap((line) =>
      data.time_s.map((time_s, k) => ({ time_s, line, value: channel[keys[line]][k], error: channel[keys[line]][k] - channel.measured[k] })),
    );
  const mark = { type: 'line', clip: true, strokeJoin: 'round' };
  const panels = data.channels.flatMap((channel, i) => {
    const last = i === data.channels.length - 1;
    const unit = unitText(channel.unit);
    const noise = { time_s: data.time_s[0], end_s: data.time_s.at(-1), low: -2 * channel.noise_std, high: 2 * channel.noise_std };
    return [
      {
        width: WIDTH, height: 130, title: { text: `${channel.channel} (${unit})`, anchor: 'start', frame: 'group', fontSize: 13, fontWeight: 600, color: '#1c1f23', offset: 4 },
        data: { values: values(channel, () => true) }, mark, encoding: { x: x(null), y: y(null, 5), ...style(i === 0) },
      },
      {
        width: WIDTH, height: 80,
        layer: [
          { data: { values: [noise] }, mark: { type: 'rect', color: '#5b6b82', opacity: 0.15 }, encoding: { x: { field: 'time_s', type: 'quantitative' }, x2: { field: 'end_s' }, y: { field: 'low', type: 'quantitative' }, y2: { field: 'high' } } },
          { data: { values: values(channel, (line) => line !== 'measured') }, mark, encoding: { x: x(last ? 'Time (s)' : null), y: { ...y('error', 3), field: 'error' }, ...style(false) } },
        ],
      },
    ];
  });
  return base({ spacing: 8, vconcat: panels });
}

/** What stands on the axis of a bar chart whose bars add up to the gap as delivered. */
const SHARE = 'Share of the gap as delivered (%)';
const whole = ({ how_far }) => how_far.per_band.reduce((sum, { excess }) => sum + Math.max(excess.as_delivered ?? 0, 0), 0);

function grouped(values, x, width) {
  const stages = present(values);
  return base({
    width, height: 220,
    data: { values },
    mark: { type: 'bar' },
    encoding: {
      x,
      xOffset: { field: 'stage', type: 'nominal', sort: null, scale: { domain: stages } },
      y: { field: 'share', type: 'quantitative', axis: { title: SHARE, tickCount: 6 } },
      color: stageColour(stages, { symbolType: 'square' }),
    },
  });
}

const short = (value) => String(Number(value.toPrecision(3)));

function bands(diagnosis) {
  const scale = 100 / whole(diagnosis);
  const values = diagnosis.how_far.per_band.flatMap(({ from_hz, to_hz, excess }) =>
    named(excess, (value) => ({ band: `${short(from_hz)} to ${short(to_hz)}`, share: Math.max(value, 0) * scale })),
  );
  return grouped(values, { field: 'band', type: 'ordinal', sort: null, axis: { title: 'Frequency band (Hz)', labelAngle: 0 }, scale: { paddingInner: 0.25 } }, WIDTH);
}

function time(diagnosis) {
  const { where } = diagnosis;
  const scale = 100 / whole(diagnosis);
  const lists = { as_delivered: where.time, retuned: where.after_retuning?.time, with_effect: where.after_effect?.time };
  const several = new Set(where.time.map(({ record }) => record)).size > 1;
  const values = Object.entries(lists).flatMap(([key, slices]) =>
    (slices ?? []).map(({ record, from_s, to_s, excess }) => ({
      stage: STAGES[key], record, from_s, to_s, share: Math.max(excess, 0) * scale,
    })),
  );
  const stages = present(values);
  const panel = (record, first) => ({
    width: WIDTH, height: several ? 110 : 180,
    title: several ? { text: record, anchor: 'start', fontSize: 12, fontWeight: 'normal', color: '#4a5058' } : undefined,
    data: { values: values.filter((value) => value.record === record) },
    layer: [
      {
        mark: { type: 'rule', strokeWidth: 3 },
        encoding: {
          x: { field: 'from_s', type: 'quantitative', scale: { nice: false, zero: false }, axis: { title: 'Time (s)', grid: false, tickCount: 10, labelFlush: false } },
          x2: { field: 'to_s' },
          y: { field: 'share', type: 'quantitative', scale: { zero: true, nice: 4 }, axis: { title: several ? 'Share (%)' : SHARE, tickCount: 4 } },
          color: stageColour(stages, first ? { symbolType: 'stroke', symbolSize: 700 } : null),
        },
      },
    ],
  });
  const records = [...new Set(where.time.map(({ record }) => record))].slice(0, 6);
  return base({ vconcat: records.map((record, i) => panel(record, i === 0)) });
}

/** What one unknown signal would leave at each place. */
function places({ where }) {
  const values = where.without_catalogue.slice(0, 12).map(({ location, same_entry, leftover_chi2 }) => ({
    place: [location, ...(same_entry ?? [])].join(', '), left: Math.max(leftover_chi2, 0.1), floor: 1,
  }));
  const largest = Math.max(3, ...values.map(({ left }) => left));
  const least = Math.min(0.7, ...values.map(({ left }) => left));
  return base({
    width: WIDTH - 180, height: 24 + 26 * values.length,
    data: { values },
    layer: [
      { data: { values: [{ floor: 1 }] }, mark: { type: 'rule', color: '#5b6b82', strokeWidth: 2, strokeDash: [4, 3] }, encoding: { x: { field: 'floor', type: 'quantitative' } } },
      {
        mark: { type: 'rule', color: '#aab1bb', strokeWidth: 2 },
        encoding: { y: { field: 'place', type: 'nominal', sort: null }, x: { field: 'floor', type: 'quantitative' }, x2: { field: 'left' } },
      },
      {
        mark: { type: 'point', filled: true, size: 130, opacity: 1, color: '#0072b2' },
        encoding: {
          y: { field: 'place', type: 'nominal', sort: null, axis: { title: null, ticks: false, domain: false } },
          x: { field: 'left', type: 'quantitative', scale: { type: 'log', domain: [least, 1.2 * largest], nice: false }, axis: { title: 'Left over the noise (1: an unknown signal there explains all)', values: [0.1, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 1e4, 1e5], format: '~r' } },
        },
      },
    ],
  });
}

/** How much two distributions differ: which variable the gap follows most. */
const divergence = (bins) => bins.reduce((sum, { share, time_share }) => sum + (share > 0 && time_share > 0 ? share * Math.log(share / time_share) : 0), 0);

/** The gap over the working range of the two variables that it follows most: its share over that of the time. */
function regions({ regions: variables }) {
  const chosen = [...variables].sort((a, b) => divergence(b.bins) - divergence(a.bins)).slice(0, 2);
  const panel = ({ variable, unit, bins }) => ({
    width: (WIDTH - 80) / 2, height: 190,
    data: { values: bins.map(({ from, to, share, time_share }) => ({ from, to, zero: 0, ratio: time_share > 0 ? share / time_share : 0 })) },
    layer: [
      {
        mark: { type: 'rect', color: '#0072b2', opacity: 0.55, stroke: '#ffffff', strokeWidth: 0.5 },
        encoding: {
          x: { field: 'from', type: 'quantitative', scale: { nice: false, zero: false }, axis: { title: `${variable.replace('.', ' ')} (${unit})`, grid: false, tickCount: 4 } },
          x2: { field: 'to' },
          y: { field: 'ratio', type: 'quantitative', scale: { zero: true }, axis: { title: 'Gap over time spent there', tickCount: 5, grid: false } },
          y2: { field: 'zero' },
        },
      },
      { data: { values: [{ one: 1 }] }, mark: { type: 'rule', color: '#5b6b82', strokeWidth: 2, strokeDash: [4, 3] }, encoding: { y: { field: 'one', type: 'quantitative' } } },
    ],
  });
  return base({ spacing: 36, hconcat: chosen.map(panel) });
}

/** The unknown signal over travel and rate: points, and the medians of bins of equal time. */
function signal({ unknown_signal: data }) {
  const label = data.location.startsWith('sensor:') ? `Measured \u2212 simulated (${unitText(data.unit)})` : `Force at ${data.location} (${unitText(data.unit)})`;
  const panel = (axis, i) => {
    const x = { field: 'x', type: 'quantitative', scale: { nice: false, zero: false }, axis: { title: `${axis.name} (${unitText(axis.unit)})`, grid: false, tickCount: 4 } };
    const y = { field: 'y', type: 'quantitative', axis: { title: i === 0 ? label : null, tickCount: 6 } };
    return {
      width: data.axes.length > 1 ? (WIDTH - 80) / 2 : WIDTH, height: 260,
      layer: [
        { data: { values: data.value.map((value, k) => ({ x: axis.values[k], y: value })) }, mark: { type: 'point', filled: true, size: 9, opacity: 0.35, color: '#5b6b82' }, encoding: { x, y } },
        { data: { values: axis.medians.map(([x_, y_]) => ({ x: x_, y: y_ })) }, mark: { type: 'line', color: '#d55e00', strokeWidth: 2.5 }, encoding: { x, y } },
      ],
    };
  };
  return base({ spacing: 24, hconcat: data.axes.map(panel) });
}

/** Name, heading, caption and specification of every figure that the data allows. */
export function diagnosisFigures(diagnosis, figures) {
  const all = [];
  const add = (name, title, caption, spec) => all.push({ name, title, caption, spec });
  add('channels', 'How far off, channel by channel',
    'RMS error in free run over the RMS of the channel\u2019s noise, on a logarithmic scale. Dashed: the noise, which no plant can go below.', channels(diagnosis));
  if (figures.segment)
    add('segment', 'Where it is worst',
      `Record ${figures.segment.record}: the stretch in which the plant as delivered errs most, in the channels in which it does; below each the simulated less the measured, grey: two standard deviations of the noise.`, segment(figures));
  if (diagnosis.how_far.per_band.length > 0 && whole(diagnosis) > 0) {
    add('bands', 'In which frequencies', 'The squared error above the noise, by bands cut between the modes of the plant; all bars as delivered add up to 100 %.', bands(diagnosis));
    add('time', 'When', 'The same by stretches of the records.', time(diagnosis));
  }
  if (diagnosis.where.without_catalogue.length > 0)
    add('places', 'Where it enters, without any catalogue',
      'What one unknown signal at each place would leave of the error, over the noise. Places on one line cannot be told apart by these sensors.', places(diagnosis));
  if (figures.regions.length > 0)
    add('regions', 'In which working range',
      `The gap ${figures.regions_of === 'retuned' ? 'that re-tuning leaves' : 'as delivered'} over the two motions that it follows most: its share in each bin over the share of the time (dashed: 1, where it does not depend on the motion).`, regions(figures));
  const { unknown_signal: unknown } = figures;
  if (unknown?.axes.length > 0) {
    const size = `${short(unknown.rms)} ${unitText(unknown.unit)} RMS, about ${short(unknown.noise_rms)} ${unitText(unknown.unit)} of it noise`;
    const meaning = !unknown.location.startsWith('sensor:')
      ? `What would have to act there to make up for what the plant lacks: ${size}, up to ${short(unknown.band_hz)} Hz. It has the sign of a law: a missing damper rises with the velocity.`
      : `What the channel reads less what the plant simulates: ${size}.`;
    add('signal', `The unknown signal at ${unknown.location}`, `${meaning} Points: samples; line: medians.`, signal(figures));
  }
  return all;
}
