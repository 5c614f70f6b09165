// Plays a simulated bed on a canvas. Positions are 16-bit fractions of the drawn width and height. Colours follow the
// page's; who asked for less motion gets a bed at rest and a button.
(() => {
  "use strict";
  const figure = document.getElementById("bed-in-motion");
  if (!figure) return;
  const scene = JSON.parse(figure.dataset.scene), bytes = shakebed.bytes(figure.dataset.positions);
  const at = new Uint16Array(bytes.buffer), n = scene.radius.length, frames = scene.floor.length;
  const canvas = figure.querySelector("canvas"), context = canvas.getContext("2d");
  const button = figure.querySelector("button"), slider = figure.querySelector("input"), text = figure.querySelector("output");
  const profile = scene.profile ? new shakebed.Profile(figure.querySelector(".side"), scene.profile) : null;
  figure.classList.add("plays");
  let shown = 0, playing = !matchMedia("(prefers-reduced-motion: reduce)").matches, since = 0, seen = true, asked = false;
  const draw = () => {
    const ratio = devicePixelRatio || 1, width = canvas.clientWidth, margin = 0.6;
    if (!width) return;
    const unit = width / (scene.width + 2 * margin), height = Math.round(unit * (scene.high - scene.low));
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio); canvas.style.height = height + "px";
    }
    const css = getComputedStyle(figure), colors = [css.getPropertyValue("--disk-a"), css.getPropertyValue("--disk-b")];
    const x = v => (v + margin) * unit, y = v => (scene.high - v) * unit;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    for (const tone of [0, 1]) {
      context.beginPath();
      for (let i = 0; i < n; ++i) {
        if (scene.tone[i] !== tone) continue;
        const k = 2 * (shown * n + i), r = Math.max(0.5, scene.radius[i] * unit - 0.4);
        const cx = x(at[k] / 65535 * scene.width), cy = y(scene.low + at[k + 1] / 65535 * (scene.high - scene.low));
        context.moveTo(cx + r, cy); context.arc(cx, cy, r, 0, 2 * Math.PI);
      }
      context.fillStyle = colors[tone]; context.fill();
    }
    context.strokeStyle = css.color; context.lineWidth = Math.max(1, 0.12 * unit); context.beginPath();
    const floor = y(scene.floor[shown]);
    if (scene.walls) { context.moveTo(x(0), 0); context.lineTo(x(0), floor); context.lineTo(x(scene.width), floor); context.lineTo(x(scene.width), 0); }
    else { context.moveTo(x(0), floor); context.lineTo(x(scene.width), floor); }
    context.stroke();
    slider.value = shown; text.textContent = `${scene.label[shown]}, floor at ${(Math.round(100 * scene.floor[shown]) / 100 || 0).toFixed(2)} D`.replace("at -", "at −");
    if (profile) profile.show(shown, scene.floor[shown]);
    figure.dataset.drawn = Number(figure.dataset.drawn || 0) + 1;
  };
  const step = now => {
    asked = false;
    if (now - since >= 50) { since = now; shown = (shown + 1) % frames; draw(); }
    goOn();
  };
  // Out of view it rests: its drawing would slow what is looked at.
  const goOn = () => { if (playing && seen && !asked) { asked = true; requestAnimationFrame(step); } };
  const set = on => { playing = on && frames > 1; button.textContent = playing ? "Pause" : "Play"; goOn(); };
  button.onclick = () => set(!playing);
  slider.max = frames - 1;
  slider.oninput = () => { set(false); shown = Number(slider.value); draw(); };
  new IntersectionObserver(entries => { seen = entries[entries.length - 1].isIntersecting; goOn(); }).observe(canvas);
  new ResizeObserver(() => requestAnimationFrame(draw)).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  draw(); set(playing);
})();
