// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <nlohmann/json.hpp>

#include "absl/strings/str_replace.h"
#include "facetwise/prove.h"

namespace facetwise::prove {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kPage = R"html(<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>facetwise: proof</title>
<link rel="icon" href="data:,">
<style>
:root { color-scheme: light dark; --paper: #fff; --ink: #1b1f24; --dim: #57606a; --line: #d0d7de; --good: #116329; --bad: #a40e26; }
@media (prefers-color-scheme: dark) {
  :root { --paper: #12161b; --ink: #e6e9ec; --dim: #a3adb8; --line: #3a434d; --good: #56d364; --bad: #ff8e8e; }
}
body { margin: 0 auto; max-width: 68rem; padding: 1rem; background: var(--paper); color: var(--ink); font: 1rem/1.5 system-ui, "DejaVu Sans", sans-serif; }
.dim, figcaption { color: var(--dim); }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .92rem; }
caption { text-align: left; font-weight: 600; padding: .6rem 0 .2rem; }
th, td { text-align: left; vertical-align: top; padding: .25rem .8rem .25rem 0; border-bottom: 1px solid var(--line); }
.holds { color: var(--good); } .fails { color: var(--bad); font-weight: 600; }
.where { font: .8rem ui-monospace, "DejaVu Sans Mono", monospace; overflow-wrap: anywhere; }
.maps { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 18rem), 1fr)); gap: .6rem; }
figure { margin: 0; } canvas { width: 100%; height: auto; image-rendering: pixelated; border: 1px solid var(--line); }
:focus-visible { outline: 3px solid currentColor; outline-offset: 2px; }
</style>
</head>
<body>
<main>
<h1></h1>
<p id="about"></p>
<section aria-label="Properties"><div class="scroll" tabindex="0" role="region" aria-label="Table of properties"><table id="properties"></table></div></section>
<section id="configurations" aria-label="Configurations">
<h2>Where the samples go</h2>
<p class="dim">Each picture is the sphere of directions: azimuth from left to right, and from straight up at its top edge, by way of
the horizon in its middle, to straight down. Left what the pdf lets expect, in the middle the samples, on a logarithmic scale; right
their difference in standard deviations, blue for too few, red for too many, full at 5.</p>
</section>
</main>
<script type="application/json" id="data">@DATA@</script>
<script>
const data = JSON.parse(document.getElementById('data').textContent);
const add = (to, kind, text, name) => {
  const made = document.createElement(kind);
  if (text !== undefined) made.textContent = text;
  if (name) made.className = name;
  return to.appendChild(made);
};
const verdict = holds => [holds ? 'holds' : 'fails', holds ? 'holds' : 'fails'];
document.title = `${data.bsdf}: proof`;
document.querySelector('h1').textContent = data.bsdf;
document.getElementById('about').textContent = `${data.holds ? 'Every property that was tried holds' : 'It fails'}: `
  + `${data.configurations.length} configurations, ${data.samples.toLocaleString('en')} samples each.`;
const table = document.getElementById('properties');
const head = add(add(table, 'thead'), 'tr');
['Property', 'Result', 'Its worst'].forEach(text => add(head, 'th', text).scope = 'col');
const body = add(table, 'tbody');
for (const p of data.properties) {
  const row = add(body, 'tr');
  const first = add(row, 'th', p.name);
  first.scope = 'row';
  add(add(first, 'div'), 'span', p.meaning, 'dim').style.fontWeight = 'normal';
  add(row, 'td', ...verdict(p.failed === 0));
  const cell = add(row, 'td', (p.failed ? `in ${p.failed} of ${p.tried}: ` : '') + p.worst + (p.at ? ` (${p.at})` : ''));
  if (p.where) add(cell, 'div', p.where, 'where');
}
const columns = data.columns, rows = data.rows;
const draw = (maps, label, shade) => {
  const figure = add(maps, 'figure'), canvas = add(figure, 'canvas');
  canvas.width = columns, canvas.height = rows;
  canvas.setAttribute('role', 'img');
  canvas.setAttribute('aria-label', label);
  add(figure, 'figcaption', label);
  const context = canvas.getContext('2d'), image = context.createImageData(columns, rows);
  for (let k = 0; k < columns * rows; ++k) image.data.set([...shade(k), 255], 4 * k);
  context.putImageData(image, 0, 0);
};
// Dark blue by way of green to yellow.
const heat = t => [255 * Math.pow(t, 1.6), 255 * (0.12 + 0.82 * t), 255 * (0.3 + 0.55 * t - 0.75 * t * t)];
for (const c of data.configurations) {
  const section = document.getElementById('configurations');
  add(section, 'h3', c.label);
  const failed = c.findings.filter(f => !f.holds);
  const said = add(section, 'p', failed.length ? '' : 'All hold.', failed.length ? '' : 'holds');
  failed.forEach(f => { add(said, 'span', `${f.property}: `, 'fails'); add(said, 'span', `${f.what}. `); });
  const maps = add(section, 'div', undefined, 'maps'), most = Math.max(1, ...c.expected, ...c.counts);
  const logarithm = n => heat(Math.log1p(n) / Math.log1p(most));
  draw(maps, 'expected', k => logarithm(c.expected[k]));
  draw(maps, 'sampled', k => logarithm(c.counts[k]));
  draw(maps, 'difference', k => {
    const z = Math.max(-1, Math.min(1, (c.counts[k] - c.expected[k]) / Math.sqrt(Math.max(c.expected[k], 1)) / 5));
    const fade = 245 * (1 - Math.abs(z));
    return z > 0 ? [245, fade, fade] : [fade, fade, 245];
  });
}
</script>
</body>
</html>
)html";

Json json_of(const Finding& f) {
  Json json = {{"property", name(f.property)}, {"holds", f.holds},     {"measured", f.measured},
               {"wanted", f.wanted},           {"allowed", f.allowed}, {"what", f.what}};
  if (!f.where.empty()) json["where"] = f.where;
  return json;
}

Json json_of(const Proof& proof, bool with_pictures) {
  Json json = {{"bsdf", proof.bsdf}, {"holds", proof.holds()}, {"samples", proof.samples}};
  for (const Property property : all_properties()) {
    const Proof::Summary summary = proof.summary(property);
    if (summary.worst == nullptr) continue;
    Json entry = {{"name", name(property)},
                  {"meaning", meaning(property)},
                  {"tried", summary.tried},
                  {"failed", summary.failed},
                  {"worst", summary.worst->what}};
    if (summary.at != nullptr) entry["at"] = label(*summary.at);
    if (!summary.worst->where.empty()) entry["where"] = summary.worst->where;
    json["properties"].push_back(entry);
  }
  json["everywhere"] = Json::array();
  for (const Finding& f : proof.everywhere) json["everywhere"].push_back(json_of(f));
  json["configurations"] = Json::array();
  if (with_pictures) json["rows"] = kThetas, json["columns"] = kPhis;
  for (const Examined& one : proof.examined) {
    const Configuration& c = one.configuration;
    Json entry = {
        {"label", label(c)}, {"theta", c.theta}, {"phi", c.phi}, {"alpha_x", c.alpha_x}, {"alpha_y", c.alpha_y}};
    for (const Finding& f : one.findings) entry["findings"].push_back(json_of(f));
    if (with_pictures) {
      entry["counts"] = one.counts;
      for (const double expected : one.expected) entry["expected"].push_back(std::round(10 * expected) / 10);
    }
    json["configurations"].push_back(entry);
  }
  return json;
}

}  // namespace

std::string to_json(const Proof& proof) { return json_of(proof, false).dump(1) + "\n"; }

std::string page(const Proof& proof) {
  // In a script element only "</" could end it.
  const std::string data = absl::StrReplaceAll(json_of(proof, true).dump(), {{"</", "<\\/"}});
  return absl::StrReplaceAll(kPage, {{"@DATA@", data}});
}

}  // namespace facetwise::prove
