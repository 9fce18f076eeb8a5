#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs ports/facetwise.glsl in headless Chromium (WebGL2, on SwiftShader where there is no GPU) on hard lanes, and compares it
with the library. Usage: glsl_in_a_browser.py FACETWISE PORT"""
import base64
import os
import subprocess
import sys
import tempfile

import numpy as np

sys.path.append(os.path.join(os.path.dirname(__file__), "../support"))
from browser import SOFTWARE_GL, check, chromium, failures  # noqa: E402

facetwise, port = sys.argv[1:3]
SIDE = 512
COUNT = SIDE * SIDE
random = np.random.default_rng(21)


def hard_lanes():
    """Front, behind, grazing and straight up; alpha from 1e-3 to 10, half of them isotropic; u at 0 and below 1 too."""
    z = random.uniform(-1, 1, COUNT)
    some = random.integers(0, 6, COUNT)
    z = np.where(some == 1, 10 ** random.uniform(-6, 0, COUNT), z)
    z = np.where(some == 2, np.cos(10 ** random.uniform(-6, -1, COUNT)), z)
    phi = random.uniform(0, 2 * np.pi, COUNT)
    r = np.sqrt((1 - z) * (1 + z))
    alpha_x = 10 ** random.uniform(-3, 1, COUNT)
    alpha_y = np.where(random.integers(0, 2, COUNT) == 0, alpha_x, 10 ** random.uniform(-3, 1, COUNT))
    u = random.integers(0, 1 << 24, (3, COUNT)) * 2.0**-24
    u = np.where(random.integers(0, 50, (3, COUNT)) == 0, 0, u)
    u = np.where(random.integers(0, 50, (3, COUNT)) == 0, 1 - 2.0**-24, u)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z, alpha_x, alpha_y, *u], axis=1).astype(np.float32)


lanes = hard_lanes()
folder = tempfile.TemporaryDirectory()
path = lambda name: os.path.join(folder.name, name)


def library(verb, columns, names, *arguments):
    table = np.zeros(COUNT, dtype=[(name, "<f4") for name in names])
    for name, column in zip(names, columns.T):
        table[name] = column
    np.save(path("in.npy"), table)
    subprocess.run([facetwise, verb, "--input", path("in.npy"), "--output", path("out.npy"), *arguments], check=True,
                   capture_output=True)
    return np.load(path("out.npy"))


INPUTS = ["ix", "iy", "iz", "alpha_x", "alpha_y", "u1", "u2", "u3"]
page = """<!doctype html><title>port</title><script>
const gl = document.createElement('canvas').getContext('webgl2');
const side = SIDE;
const floats = text => new Float32Array(Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer);
const shader = (type, source) => {
  const made = gl.createShader(type);
  gl.shaderSource(made, source);
  gl.compileShader(made);
  if (!gl.getShaderParameter(made, gl.COMPILE_STATUS)) throw gl.getShaderInfoLog(made);
  return made;
};
const texture = data => {
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  const made = gl.getParameter(gl.TEXTURE_BINDING_2D);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, side, side);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  if (data) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, side, side, gl.RGBA, gl.FLOAT, data);
  return made;
};
// Runs `body`, which sets a and b from p and q of each lane; their floats as base64.
function run(port, body, p, q) {
  if (!gl || !gl.getExtension('EXT_color_buffer_float')) throw 'no WebGL2 with float targets';
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, `#version 300 es
    void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }`));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `#version 300 es
    precision highp float; precision highp int; precision highp sampler2D;
    uniform sampler2D inputs_p, inputs_q;
    layout(location = 0) out vec4 a; layout(location = 1) out vec4 b;
    ${port}
    void main() {
      vec4 p = texelFetch(inputs_p, ivec2(gl_FragCoord.xy), 0), q = texelFetch(inputs_q, ivec2(gl_FragCoord.xy), 0);
      vec3 i = p.xyz; vec2 alpha = vec2(p.w, q.x); vec3 u = q.yzw;
      ${body}
    }`));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw gl.getProgramInfoLog(program);
  gl.useProgram(program);
  gl.activeTexture(gl.TEXTURE0);
  const tp = texture(floats(p));
  const tq = texture(floats(q));
  const targets = [texture(null), texture(null)];
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  targets.forEach((target, k) =>
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + k, gl.TEXTURE_2D, target, 0));
  gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
  [tp, tq].forEach((t, k) => { gl.activeTexture(gl.TEXTURE0 + k); gl.bindTexture(gl.TEXTURE_2D, t); });
  gl.uniform1i(gl.getUniformLocation(program, 'inputs_p'), 0);
  gl.uniform1i(gl.getUniformLocation(program, 'inputs_q'), 1);
  gl.viewport(0, 0, side, side);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  return targets.map((_, k) => {
    const data = new Float32Array(side * side * 4);
    gl.readBuffer(gl.COLOR_ATTACHMENT0 + k);
    gl.readPixels(0, 0, side, side, gl.RGBA, gl.FLOAT, data);
    const bytes = new Uint8Array(data.buffer);
    let text = '';
    for (let at = 0; at < bytes.length; at += 32768) text += String.fromCharCode(...bytes.subarray(at, at + 32768));
    return btoa(text);
  });
}
</script>""".replace("SIDE", str(SIDE))
with open(path("page.html"), "w", encoding="utf-8") as file:
    file.write(page)

browser = chromium(*SOFTWARE_GL)
browser.set_script_timeout(300)
try:
    browser.get("file://" + path("page.html"))
    with open(port, encoding="utf-8") as file:
        source = file.read()

    def shaded(body, columns):
        p, q = (np.ascontiguousarray(columns[:, k:k + 4]) for k in (0, 4))
        answers = browser.execute_script("return run(...arguments)", source, body,
                                         *(base64.b64encode(part.tobytes()).decode() for part in (p, q)))
        return [np.frombuffer(base64.b64decode(answer), dtype=np.float32).reshape(COUNT, 4) for answer in answers]

    for sampler in ("cap", "bounded", "exact"):
        u = "u" if sampler == "exact" else "u.xy"
        a, b = shaded(f"FwSample s = fw_sample_{sampler}(i, alpha, {u}); a = vec4(s.o, s.pdf); b = vec4(s.weight);", lanes)
        truth = library("sample", lanes, INPUTS, "--sampler", sampler)
        o = np.stack([truth["ox"], truth["oy"], truth["oz"]], axis=1)
        accepted, taken = truth["status"] == 0, b[:, 0] > 0
        check(np.isfinite(a).all() and np.isfinite(b).all(), f"{sampler}: every number is finite")
        # Next to the horizon rounding decides. Sines and cosines of a shader are good to 1e-5 here, others to 2^-11.
        differ = np.mean(accepted != taken)
        check(differ < 1e-3, f"{sampler}: accepted alike but for {differ:.1e} of the lanes")
        front = lanes[:, 2] > 0
        if sampler == "exact":
            check(taken[front].all(), f"exact: none of {front.sum()} reflections is occluded")
        both = accepted & taken
        error = np.abs(a[both, :3] - o[both]).max(axis=1)
        check(np.median(error) < 2e-5 and np.quantile(error, 0.99) < 2e-3,
              f"{sampler}: o differs by {np.median(error):.1e} in the median, by {np.quantile(error, 0.99):.1e} in 1 %")
        for name, got, wanted in (("pdf", a[both, 3], truth["pdf"][both]), ("weight", b[both, 0], truth["weight"][both])):
            relative = np.abs(got / np.maximum(wanted, 1e-30) - 1)
            check(np.median(relative) < 1e-4 and np.quantile(relative, 0.99) < 1e-2,
                  f"{sampler}: {name} differs by {np.median(relative):.1e} in the median, {np.quantile(relative, 0.99):.1e} in 1 %")

        # The density of directions that are asked for, and the value: o where u was.
        asked = np.concatenate([lanes[:, :5], o], axis=1).astype(np.float32)
        a, b = shaded(f"a = vec4(fw_pdf_{sampler}(i, u, alpha)); b = vec4(fw_evaluate(i, u, alpha));", asked)
        truth = library("evaluate", asked, INPUTS[:5] + ["ox", "oy", "oz"], "--sampler", sampler)
        seen = accepted & (truth["pdf"] > 0)
        for name, got in (("pdf", a[seen, 0]), ("value", b[seen, 0])):
            relative = np.abs(got / np.maximum(truth[name][seen], 1e-30) - 1)
            check(np.median(relative) < 3e-6 and np.quantile(relative, 0.99) < 1e-3,
                  f"{sampler}: {name} asked for differs by {np.median(relative):.1e}, {np.quantile(relative, 0.99):.1e} in 1 %")
finally:
    browser.quit()
sys.exit(1 if failures else 0)
