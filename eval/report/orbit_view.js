// SPDX-License-Identifier: MIT
// Point clouds on a canvas, turned about their middle. Each view of the page is a .orbit element with its data inside.
"use strict";
(() => {
  const bytes = text => Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
  const rgb = hex => [1, 3, 5].map(at => parseInt(hex.slice(at, at + 2), 16));
  const packed = ([r, g, b]) => (255 << 24 | b << 16 | g << 8 | r) >>> 0;

  // Blue over green to red, in 255 steps.
  const stops = [[48, 70, 160], [40, 160, 220], [70, 210, 120], [240, 200, 50], [220, 50, 30]];
  const ramp = Uint32Array.from({ length: 255 }, (_, k) => {
    const at = k / 254 * (stops.length - 1), first = Math.min(Math.floor(at), stops.length - 2);
    return packed(stops[first].map((low, i) => Math.round(low + (at - first) * (stops[first + 1][i] - low))));
  });

  const unpacked = layer => {
    const cells = new Uint16Array(bytes(layer.points).buffer), points = new Float32Array(cells.length);
    for (let i = 0; i < cells.length; i++) points[i] = layer.low[i % 3] + cells[i] * layer.step[i % 3];
    const colours = new Uint32Array(cells.length / 3).fill(packed(rgb(layer.colour)));
    if (layer.shade) bytes(layer.shade).forEach((shade, i) => { if (shade < 255) colours[i] = ramp[shade]; });
    return { ...layer, points, colours };
  };

  const start = box => {
    const data = JSON.parse(box.querySelector("script").textContent);
    const layers = data.layers.map(unpacked);
    const canvas = box.querySelector("canvas"), pen = canvas.getContext("2d");
    const first = { turn: -0.6, tilt: 0.9, zoom: 1, x: 0, y: 0 };
    let look = { ...first }, waiting = false;

    const draw = () => {
      waiting = false;
      const sharp = Math.min(window.devicePixelRatio || 1, 2);
      const width = Math.max(1, Math.round(canvas.clientWidth * sharp));
      const height = Math.max(1, Math.round(canvas.clientHeight * sharp));
      if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
      const image = pen.createImageData(width, height), pixels = new Uint32Array(image.data.buffer);
      const depth = new Float32Array(width * height).fill(Infinity);
      const [mx, my, mz] = data.frame.middle, scale = 0.48 * Math.min(width, height) / data.frame.half * look.zoom;
      const ct = Math.cos(look.turn), st = Math.sin(look.turn), cu = Math.cos(look.tilt), su = Math.sin(look.tilt);
      for (const layer of layers) {
        if (!layer.shown) continue;
        const { points, colours } = layer, size = Math.max(1, Math.round(layer.size * sharp / 2));
        for (let i = 0, k = 0; i < points.length; i += 3, k++) {
          const x = points[i] - mx, y = points[i + 1] - my, z = points[i + 2] - mz;
          const ahead = st * x + ct * y;
          const u = Math.round(width / 2 + look.x * sharp + scale * (ct * x - st * y));
          const v = Math.round(height / 2 + look.y * sharp - scale * (su * ahead + cu * z));
          const far = cu * ahead - su * z;
          for (let row = v; row < v + size; row++) {
            if (row < 0 || row >= height) continue;
            for (let column = u; column < u + size; column++) {
              const at = row * width + column;
              if (column < 0 || column >= width || far >= depth[at]) continue;
              depth[at] = far;
              pixels[at] = colours[k];
            }
          }
        }
      }
      pen.putImageData(image, 0, 0);
    };
    const redraw = () => { if (!waiting) { waiting = true; requestAnimationFrame(draw); } };

    const switches = box.querySelector(".switches");
    for (const layer of layers) {
      const label = document.createElement("label"), tick = document.createElement("input"), dot = document.createElement("i");
      tick.type = "checkbox";
      tick.checked = layer.shown;
      tick.addEventListener("change", () => { layer.shown = tick.checked; redraw(); });
      dot.style.background = layer.shade ? "linear-gradient(90deg, #3046a0, #28a0dc, #46d278, #f0c832, #dc321e)" : layer.colour;
      label.append(tick, dot, document.createTextNode(layer.name));
      switches.append(label);
    }

    const held = new Map();
    const apart = () => { const [a, b] = [...held.values()]; return Math.hypot(a.x - b.x, a.y - b.y); };
    canvas.addEventListener("pointerdown", event => {
      canvas.setPointerCapture(event.pointerId);
      held.set(event.pointerId, { x: event.clientX, y: event.clientY });
    });
    const release = event => held.delete(event.pointerId);
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("pointermove", event => {
      const last = held.get(event.pointerId);
      if (!last) return;
      const dx = event.clientX - last.x, dy = event.clientY - last.y;
      const before = held.size === 2 ? apart() : 0;
      held.set(event.pointerId, { x: event.clientX, y: event.clientY });
      if (held.size === 2) {
        look.zoom *= apart() / Math.max(before, 1);
        look.x += dx / 2;
        look.y += dy / 2;
      } else if (event.shiftKey) {
        look.x += dx;
        look.y += dy;
      } else {
        look.turn += dx * 0.008;
        look.tilt = Math.max(0, Math.min(Math.PI / 2, look.tilt + dy * 0.008));
      }
      redraw();
    });
    canvas.addEventListener("wheel", event => {
      event.preventDefault();
      look.zoom *= Math.exp(-event.deltaY * 0.0012);
      redraw();
    }, { passive: false });
    canvas.addEventListener("dblclick", () => { look = { ...first }; redraw(); });
    canvas.addEventListener("keydown", event => {
      const steps = { ArrowLeft: ["turn", -0.1], ArrowRight: ["turn", 0.1], ArrowUp: ["tilt", 0.1], ArrowDown: ["tilt", -0.1] };
      if (event.key === "+" || event.key === "-") look.zoom *= event.key === "+" ? 1.2 : 1 / 1.2;
      else if (steps[event.key]) look[steps[event.key][0]] += steps[event.key][1];
      else return;
      look.tilt = Math.max(0, Math.min(Math.PI / 2, look.tilt));
      event.preventDefault();
      redraw();
    });
    new ResizeObserver(redraw).observe(canvas);
    redraw();
  };

  document.querySelectorAll(".orbit").forEach(start);
})();
