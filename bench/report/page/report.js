"use strict";
// Draws the report from the JSON that the page holds. d3 draws; everything drawn has its numbers in a table behind it.
const data = JSON.parse(document.getElementById("data").textContent);
const main = document.querySelector("main");

function add(parent, tag, attributes = {}, text) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  parent.append(element);
  return element;
}
const sections = [];
function section(id, title) {
  const element = add(main, "section", { id, "aria-labelledby": id + "-title" });
  add(element, "h2", { id: id + "-title" }, title);
  sections.push([id, title]);
  return element;
}
let last_id = 0;
const new_id = () => "id" + ++last_id;

// --- Numbers and tables ---------------------------------------------------------------------------------------------

const number = (value) => {
  if (typeof value !== "number") return value ?? "–";
  if (value !== 0 && (Math.abs(value) >= 1e5 || Math.abs(value) < 1e-3)) return d3.format(".3~g")(value);
  return d3.format(",.4~g")(value);
};
const is_number = (text) => typeof text === "number" || /^[-+]?[\d,.]+(e[-+]?\d+)?( ?%|°)?$/.test(text);

function table(parent, { title, columns, rows }) {
  const scroll = add(parent, "div", { class: "scroll", tabindex: 0, role: "region", "aria-label": title });
  const element = add(scroll, "table");
  add(element, "caption", {}, title);
  const head = add(add(element, "thead"), "tr");
  for (const column of columns) add(head, "th", { scope: "col" }, column);
  const body = add(element, "tbody");
  for (const row of rows) {
    const line = add(body, "tr");
    row.forEach((cell) => {
      const text = String(number(cell));
      const attributes = is_number(cell) ? { class: "number" } : text.length > 40 ? { class: "long" } : {};
      add(line, "td", attributes, text);
    });
  }
  return element;
}
function data_behind(parent, content) {
  const details = add(parent, "details");
  add(details, "summary", {}, "Numbers: " + content.title);
  table(details, content);
}

// --- Plots ----------------------------------------------------------------------------------------------------------

const color = (k) => `var(--s${k % 6})`;
const dashes = ["", "7 3", "2 3", "9 3 2 3", "4 4", "1 4"];
const symbols = [d3.symbolCircle, d3.symbolSquare, d3.symbolTriangle, d3.symbolDiamond, d3.symbolCross, d3.symbolStar];

// Draws once now, and again whenever the width changes.
function drawn(figure, alt, draw) {
  const holder = add(figure, "div", { class: "plot" });
  let width = 0;
  const redraw = () => {
    const now = Math.max(280, Math.min(900, holder.clientWidth || 640));
    if (now === width) return;
    width = now;
    holder.replaceChildren();
    const svg = d3.select(holder).append("svg").attr("role", "img").attr("aria-label", alt);
    draw(svg, width);
  };
  redraw();
  new ResizeObserver(redraw).observe(holder);
}
function key(figure, names, mark) {
  const list = add(figure, "ul", { class: "key" });
  names.forEach((name, k) => {
    const item = add(list, "li");
    const svg = d3.select(item).append("svg").attr("width", 26).attr("height", 12).attr("aria-hidden", "true");
    mark(svg, k);
    item.append(name);
  });
}
// Labels of an axis; a logarithmic one only at 1, 2 and 5, or at powers of ten where it is long.
function tick_format(scale) {
  if (scale.base === undefined) return (value) => number(value);
  const [low, high] = scale.domain();
  const shown = high / low > 300 ? [1] : [1, 2, 5];
  return (value) => (shown.some((d) => Math.abs(value / 10 ** Math.floor(Math.log10(value) + 1e-9) - d) < 1e-6) ? number(value) : "");
}
function axes(svg, x, y, { width, height, margin, x_label, y_label, x_ticks, y_ticks }) {
  const bottom = height - margin.bottom;
  svg.append("g").attr("class", "grid").attr("transform", `translate(${margin.left},0)`)
    .call(d3.axisLeft(y).ticks(y_ticks).tickSize(-(width - margin.left - margin.right)).tickFormat(""));
  svg.append("g").attr("class", "axis").attr("transform", `translate(0,${bottom})`).call(d3.axisBottom(x).ticks(x_ticks).tickFormat(tick_format(x)));
  svg.append("g").attr("class", "axis").attr("transform", `translate(${margin.left},0)`).call(d3.axisLeft(y).ticks(y_ticks).tickFormat(tick_format(y)));
  svg.append("text").attr("x", (margin.left + width - margin.right) / 2).attr("y", height - 4).attr("text-anchor", "middle").text(x_label);
  svg.append("text").attr("x", 4).attr("y", 12).text(y_label);
}

function plot(parent, figure) {
  const element = add(parent, "figure");
  add(element, "h3", {}, figure.title);
  const all = figure.series.flatMap((series) => series.points);
  const names = [...new Set(figure.series.map((series) => series.name))];  // curves of one name look alike
  const usable = (value, log) => !log || value > 0;
  const extent = (k, log) => {
    const [low, high] = d3.extent(all.map((point) => point[k]).filter((value) => usable(value, log)));
    if (low === undefined) return [0, 1];
    if (log) return low === high ? [low / 2, high * 2] : [low, high];
    const from = Math.min(low, low >= 0 && low < 0.5 * high ? 0 : low);
    return from === high ? [from - 1, high + 1] : [from, high];
  };
  drawn(element, figure.alt || figure.title, (svg, width) => {
    const margin = { left: 52, right: 14, top: 22, bottom: 42 };
    const height = figure.equal_scales ? Math.min(width, 460) : Math.round(Math.min(360, 0.62 * width + 60));
    svg.attr("viewBox", `0 0 ${width} ${height}`).attr("width", width).attr("height", height);
    const x = (figure.log_x ? d3.scaleLog() : d3.scaleLinear()).range([margin.left, width - margin.right]);
    const y = (figure.log_y ? d3.scaleLog() : d3.scaleLinear()).range([height - margin.bottom, margin.top]);
    let [ex, ey] = [extent(0, figure.log_x), extent(1, figure.log_y)];
    if (figure.equal_scales) {
      const w = width - margin.left - margin.right, h = height - margin.top - margin.bottom;
      ex = d3.extent(all.map((point) => point[0])), ey = d3.extent(all.map((point) => point[1]));
      const scale = Math.max((ex[1] - ex[0]) / w, (ey[1] - ey[0]) / h) * 1.06;
      ex = [d3.mean(ex) - scale * w / 2, d3.mean(ex) + scale * w / 2];
      ey = [d3.mean(ey) - scale * h / 2, d3.mean(ey) + scale * h / 2];
      x.domain(ex), y.domain(ey);
    } else {
      x.domain(ex), y.domain(ey).nice();
    }
    axes(svg, x, y, { width, height, margin, x_label: figure.x, y_label: figure.y, x_ticks: width < 480 ? 5 : 9, y_ticks: 6 });
    figure.series.forEach((series) => {
      const k = names.indexOf(series.name);
      const points = series.points.filter((point) => usable(point[0], figure.log_x) && usable(point[1], figure.log_y));
      // A jump in a drawing is a gap.
      const far = (a, b) => figure.equal_scales && points.length > 20 && Math.hypot(a[0] - b[0], a[1] - b[1]) > 0.1;
      const pieces = [];
      points.forEach((point, n) => {
        if (n === 0 || far(points[n - 1], point)) pieces.push([]);
        pieces[pieces.length - 1].push(point);
      });
      const line = d3.line().x((point) => x(point[0])).y((point) => y(point[1]));
      for (const piece of pieces)
        svg.append("path").attr("class", "curve").attr("d", line(piece)).attr("fill", "none").attr("stroke", color(k))
          .attr("stroke-width", 2).attr("stroke-dasharray", dashes[k % 6]);
      if (points.length <= 40 && names.length === figure.series.length)
        svg.selectAll(null).data(points).enter().append("path").attr("d", d3.symbol().type(symbols[k % 6]).size(36))
          .attr("transform", (point) => `translate(${x(point[0])},${y(point[1])})`).attr("fill", color(k))
          .append("title").text((point) => `${series.name}: ${number(point[0])}, ${number(point[1])}`);
    });
  });
  key(element, names, (svg, k) => {
    svg.append("line").attr("x1", 0).attr("x2", 26).attr("y1", 6).attr("y2", 6).attr("stroke", color(k)).attr("stroke-width", 2)
      .attr("stroke-dasharray", dashes[k % 6]);
    svg.append("path").attr("d", d3.symbol().type(symbols[k % 6]).size(36)).attr("transform", "translate(13,6)").attr("fill", color(k));
  });
  if (figure.alt) add(element, "figcaption", {}, figure.alt);
  const xs = [...new Set(all.map((point) => point[0]))].sort(d3.ascending);
  if (figure.equal_scales || xs.length > 200) {
    data_behind(element, { title: figure.title, columns: ["curve", figure.x, figure.y],
      rows: figure.series.flatMap((series) => series.points.filter((_, k) => k % 20 === 0).map((point) => [series.name, ...point])) });
  } else {
    data_behind(element, { title: figure.title, columns: [figure.x, ...figure.series.map((series) => series.name)],
      rows: xs.map((at) => [at, ...figure.series.map((series) => (series.points.find((point) => point[0] === at) || [])[1])]) });
  }
}

// Horizontal bars: groups of one value for each name.
function bars(parent, { title, alt, label, names, groups }) {
  const element = add(parent, "figure");
  add(element, "h3", {}, title);
  drawn(element, alt, (svg, width) => {
    const bar = 15, gap = 22, left = width < 520 ? 110 : 190;
    const lines = groups.map((group) => names.map((name, k) => [name, k, group.values[name]]).filter((line) => line[2] > 0));
    const height = 46 + d3.sum(lines, (line) => line.length * bar + gap);
    svg.attr("viewBox", `0 0 ${width} ${height}`).attr("width", width).attr("height", height);
    const largest = d3.max(groups, (group) => d3.max(Object.values(group.values))) || 1;
    const x = d3.scaleLinear().domain([0, largest]).nice().range([left, width - 58]);
    svg.append("g").attr("class", "axis").attr("transform", "translate(0,22)").call(d3.axisTop(x).ticks(width < 520 ? 4 : 8).tickFormat(number));
    let y = 32;
    groups.forEach((group, g) => {
      svg.append("text").attr("x", left - 8).attr("y", y + (lines[g].length * bar) / 2 + 4).attr("text-anchor", "end").text(group.name);
      for (const [name, k, value] of lines[g]) {
        svg.append("rect").attr("class", "bar").attr("x", left).attr("y", y).attr("height", bar - 3)
          .attr("width", Math.max(1, x(value) - left)).attr("fill", color(k))
          .append("title").text(`${group.name}, ${name}: ${number(value)}`);
        svg.append("text").attr("x", x(value) + 4).attr("y", y + bar - 5).text(number(value));
        y += bar;
      }
      y += gap;
    });
  });
  key(element, names, (svg, k) => svg.append("rect").attr("y", 1).attr("width", 22).attr("height", 10).attr("fill", color(k)));
  add(element, "figcaption", {}, alt);
  data_behind(element, { title, columns: [label, ...names], rows: groups.map((group) => [group.name, ...names.map((name) => group.values[name])]) });
}

// --- Pictures under a slider ----------------------------------------------------------------------------------------

function pictures(parent, figure) {
  const element = add(parent, "figure", { class: "pictures" });
  const zoom = Math.max(1, Math.floor(400 / figure.width));  // small pictures are shown larger, pixel by pixel
  const size = { width: zoom * figure.width, height: zoom * figure.height };
  add(element, "h3", {}, figure.title);
  const source = (one) => "data:image/png;base64," + one.png;
  const box = add(element, "div", { class: "compare" });
  const below = add(box, "img", size);
  const above = add(box, "img", { class: "above", ...size });
  const rule = add(box, "div", { class: "rule" });
  const controls = add(element, "div", { class: "controls" });
  const choose = (label, chosen) => {
    const id = new_id();
    add(controls, "label", { for: id }, label);
    const select = add(controls, "select", { id });
    figure.pictures.forEach((one, k) => {
      const option = add(select, "option", { value: k }, one.name);
      option.selected = k === chosen;
    });
    return select;
  };
  const left = choose("Left", 0), right = choose("Right", Math.min(2, figure.pictures.length - 1));
  const id = new_id();
  add(controls, "label", { for: id }, "Divide at");
  const slider = add(controls, "input", { type: "range", id, min: 0, max: 100, value: 50 });
  const caption = add(element, "figcaption", { "aria-live": "polite" });
  const update = () => {
    const a = figure.pictures[left.value], b = figure.pictures[right.value];
    above.src = source(a), above.alt = `${a.name}. ${a.caption}. ${figure.alt}`;
    below.src = source(b), below.alt = `${b.name}. ${b.caption}. ${figure.alt}`;
    caption.textContent = `Left: ${a.name} (${a.caption}). Right: ${b.name} (${b.caption}).`;
  };
  const slide = () => {
    above.style.clipPath = `inset(0 ${100 - slider.value}% 0 0)`;
    rule.style.left = `calc(${slider.value}% - 1px)`;
    slider.setAttribute("aria-valuetext", `${slider.value} % ${figure.pictures[left.value].name}`);
  };
  for (const select of [left, right]) select.addEventListener("change", () => (update(), slide()));
  slider.addEventListener("input", slide);
  update(), slide();
  const details = add(element, "details");
  add(details, "summary", {}, "All pictures: " + figure.title);
  const grid = add(details, "div", { class: "all-pictures" });
  for (const one of figure.pictures) {
    const cell = add(grid, "figure");
    add(cell, "img", { src: source(one), alt: `${one.name}. ${figure.alt}`, ...size, loading: "lazy" });
    add(cell, "figcaption", {}, `${one.name}: ${one.caption}`);
  }
}

// --- The sections ---------------------------------------------------------------------------------------------------

const implementations = ["scalar", "auto", "one-lane", "simd", "simd-threads", "remote"];
const model_of = (result) => (result.distribution === "ggx" && result.masking === "smith" ? "" : `${result.distribution}-${result.masking}/`);
const alpha_of = (alpha) => (Array.isArray(alpha) ? alpha.join(", ") : alpha);

function machine(report) {
  const parent = section("machine", "Machine");
  table(parent, { title: "What was measured on", columns: ["what", "value"], rows: [
    ["facetwise", report.version], ["processor", report.machine.cpu], ["cores", report.machine.cores],
    ["instruction set", report.machine.target], ["threads", report.threads], ["page made", data.made]] });
}

function throughput(report) {
  const parent = section("throughput", "Throughput");
  add(parent, "p", {}, "Reflections sampled with their pdf, in millions a second. “scalar” is plain code as a renderer contains it, “auto” the same vectorised by the compiler, “one-lane” the kernel without vectors, “simd” one thread, “simd-threads” all, “remote” through a server.");
  const shown = report.results.filter((r) => r.operation === "sample_reflection" && r.batch === 65536 && r.inputs === "columns");
  for (const [ggx, title] of [[true, "GGX with Smith masking"], [false, "The other models"]]) {
    const groups = new Map();
    for (const r of shown.filter((r) => (model_of(r) === "") === ggx)) {
      const name = model_of(r) + r.sampler + (ggx ? `, α ${alpha_of(r.alpha)}` : "");
      if (!ggx && r.alpha !== "mixed" && shown.some((s) => s.alpha === "mixed" && !ggx && model_of(s) === model_of(r) && s.sampler === r.sampler)) continue;
      if (!groups.has(name)) groups.set(name, { name, values: {} });
      groups.get(name).values[r.implementation] = r.samples_per_second / 1e6;
    }
    if (groups.size === 0) continue;
    bars(parent, { title: `${title}: million samples a second, 65,536 lanes a call`, label: "sampler",
      alt: "Bars of samples a second for each sampler: simd is many times scalar, threads more.",
      names: implementations.filter((name) => [...groups.values()].some((group) => group.values[name] > 0)), groups: [...groups.values()] });
  }
  const limited = shown.filter((r) => r.share_of_copy > 0 && model_of(r) === "");
  if (limited.length > 0) {
    const groups = limited.filter((r) => r.implementation === "simd").map((r) => ({ name: `${r.sampler}, α ${alpha_of(r.alpha)}`,
      values: { "of copying the same columns": 100 * r.share_of_copy, "of peak multiply-adds": 100 * r.share_of_fma } }));
    bars(parent, { title: "Share of the machine's limits, one thread [%]", label: "sampler", names: ["of copying the same columns", "of peak multiply-adds"], groups,
      alt: "How close the kernels come to the speed at which the same columns are copied, and to the peak of fused multiply-adds." });
  }
}

function scaling(report) {
  const series = new Map();
  for (const r of report.results) {
    if (r.operation !== "sample_reflection" || r.inputs !== "columns" || model_of(r) !== "" || r.alpha !== "mixed") continue;
    if (!["scalar", "simd", "simd-threads", "remote"].includes(r.implementation)) continue;
    const name = `${r.sampler}, ${r.implementation}`;
    if (!series.has(name)) series.set(name, []);
    series.get(name).push([r.batch, r.samples_per_second / 1e6]);
  }
  const curves = [...series].filter(([, points]) => points.length > 2).map(([name, points]) => ({ name, points: points.sort((a, b) => a[0] - b[0]) }));
  if (curves.length === 0) return;
  plot(section("scaling", "Batch sizes"), { title: "Million samples a second against lanes a call", x: "lanes a call", y: "million samples a second", log_x: true, log_y: true,
    alt: "Speed rises with the batch until the caches are full; beyond, memory decides.", series: curves });
}

function rejections(report) {
  const all = report.rejections.filter((r) => r.experiment === "sweep");
  if (all.length === 0) return;
  const parent = section("rejections", "Rejected samples");
  add(parent, "p", {}, "Counted through the kernels. Each count is compared with a closed form or a quadrature.");
  const worst = d3.max(report.rejections, (r) => Math.abs(r.deviations ?? 0));
  add(parent, "p", {}, `The farthest of ${report.rejections.length} counts is ${number(worst)} standard deviations from its prediction.`);
  const row = add(parent, "div", { class: "plots" });
  for (const alpha of [[0.1, 0.1], [0.3, 0.3], [1, 1], [0.8, 0.1]]) {
    const here = all.filter((r) => r.alpha[0] === alpha[0] && r.alpha[1] === alpha[1]);
    const names = [...new Set(here.map((r) => r.sampler))];
    if (here.length > 0)
      plot(row, { title: `Rejected, α ${alpha_of(alpha)}`, x: "angle of incidence [degrees]", y: "share of samples", alt: "Share of samples rejected by each sampler against the angle; exact has none.",
        series: names.map((name) => ({ name, points: here.filter((r) => r.sampler === name).map((r) => [r.theta_degrees, r.share]) })) });
  }
}

function targets(report) {
  if (!report.targets || report.targets.length === 0) return;
  const parent = section("targets", "Performance to reach");
  table(parent, { title: "Ratios of interleaved pairs of measurements in one run", columns: ["what", "wanted", "measured", "met", "note"],
    rows: report.targets.map((t) => [t.what, `${t.at_least ? "≥" : "≤"} ${t.required} ${t.unit}`, t.measured === undefined || t.measured === null ? "not here" : `${number(t.measured)} ${t.unit}`,
      t.met === true ? "met" : t.met === false ? "missed" : "–", t.note]) });
}

function verification(json) {
  if (!json) return;
  const parent = section("verification", "Local and remote");
  add(parent, "p", {}, `${number(json.lanes)} lanes, traced at a mesh of ${number(json.triangles)} triangles, were answered here and by a server: ${json.equal ? "every byte of" : "NOT every byte of"} ${number(json.bytes_compared)} is equal.`);
}

function experiment(page) {
  const parent = section("experiment-" + page.id, page.title);
  add(parent, "p", { class: "dim" }, page.source);
  for (const claim of page.claims) {
    const box = add(parent, "div", { class: "claim " + (claim.verdict === "agrees" ? "agrees" : claim.verdict === "differs" ? "differs" : "part") });
    add(box, "p", {}, "The text: " + claim.says);
    const line = add(box, "p");
    add(line, "strong", {}, claim.verdict + ". ");
    line.append(claim.measured);
  }
  for (const note of page.notes) add(parent, "p", {}, note);
  let row = null;  // plots that follow each other share a row where there is room
  for (const figure of page.figures) {
    if (figure.type !== "plot") row = null;
    else if (!row) row = add(parent, "div", { class: "plots" });
    ({ plot, pictures, table })[figure.type](row || parent, figure);
  }
  const seconds = page.seconds >= 1 ? `${Math.round(page.seconds)} s` : "less than a second";
  const made = add(parent, "p", { class: "dim" }, `Made in ${seconds} by `);
  add(made, "code", {}, page.command);
}

// --- Two runs compared ----------------------------------------------------------------------------------------------

function comparison(a, b) {
  const parent = section("comparison", "What changed");
  table(parent, { title: "The two runs", columns: ["what", data.names[0], data.names[1]], rows: [
    ["facetwise", a.version, b.version], ["processor", a.machine.cpu, b.machine.cpu], ["cores", a.machine.cores, b.machine.cores],
    ["instruction set", a.machine.target, b.machine.target]] });
  const before = new Map(a.results.map((r) => [r.name, r]));
  const both = b.results.filter((r) => before.has(r.name)).map((r) => ({ name: r.name, a: before.get(r.name).samples_per_second / 1e6, b: r.samples_per_second / 1e6 }));
  for (const one of both) one.ratio = one.b / one.a;
  both.sort((x, y) => Math.abs(Math.log(y.ratio)) - Math.abs(Math.log(x.ratio)));
  add(parent, "p", {}, `${both.length} benchmarks are in both; ${both.filter((one) => one.ratio > 1.1).length} are more than 10 % faster in the second, ${both.filter((one) => one.ratio < 1 / 1.1).length} more than 10 % slower. The median ratio is ${number(d3.median(both, (one) => one.ratio))}.`);
  if (both.length > 0)
    plot(parent, { title: "Second over first, all benchmarks in order", x: "rank", y: "ratio of speeds", log_y: true, alt: "The ratio of the two runs' speeds, sorted; one means no change.",
      series: [{ name: "second / first", points: both.map((one) => one.ratio).sort(d3.ascending).map((ratio, k) => [k + 1, ratio]) }] });
  table(parent, { title: "Million samples a second, the largest change first", columns: ["benchmark", data.names[0], data.names[1], "second / first"], rows: both.map((one) => [one.name, one.a, one.b, one.ratio]) });
  const only = (from, to) => from.results.filter((r) => !to.results.some((s) => s.name === r.name)).map((r) => r.name);
  for (const [names, which] of [[only(a, b), data.names[0]], [only(b, a), data.names[1]]])
    if (names.length > 0) {
      const details = add(parent, "details");
      add(details, "summary", {}, `${names.length} only in ${which}`);
      const list = add(details, "ul");
      for (const name of names) add(list, "li", {}, name);
    }
}

// --- The page -------------------------------------------------------------------------------------------------------

if (data.compared) {
  comparison(...data.compared);
} else {
  if (data.bench) throughput(data.bench), scaling(data.bench), rejections(data.bench), targets(data.bench);
  verification(data.verification);
  for (const page of data.experiments) experiment(page);
  if (data.bench) machine(data.bench);
  const parent = section("commands", "Commands that made this page");
  add(parent, "pre", { tabindex: 0 }, data.commands.join("\n"));
}
const list = add(document.querySelector("nav"), "ul");
for (const [id, title] of sections) add(add(list, "li"), "a", { href: "#" + id }, title);
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((details) => (details.open = true)));
document.documentElement.dataset.drawn = "yes";
