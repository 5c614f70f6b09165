// The frames of a film with the disks found over them: every disk can be asked, the disks coloured by what is known.
(() => {
  "use strict";
  const bytesOfDisk = 10;
  // Bytes of decoded pictures that are kept; pictures that are decoded at once before they are asked for, seen from the
  // one shown. While the page is idle, as many as are kept.
  const mostBytes = 96e6, ahead = [1, 2, 3, -1];
  const whenIdle = window.requestIdleCallback ? work => requestIdleCallback(work) : work => setTimeout(work, 50);
  class Film {
    constructor(figure) {
      this.figure = figure;
      const of = JSON.parse(figure.querySelector("script.film-data").textContent);
      this.of = of;
      this.data = shakebed.bytes(of.disks);
      this.first = [0];
      for (const count of of.counts) this.first.push(this.first[this.first.length - 1] + count);
      this.canvas = figure.querySelector("canvas");
      this.context = this.canvas.getContext("2d");
      this.slider = figure.querySelector("input[type=range]");
      this.choice = figure.querySelector("select");
      this.text = figure.querySelector("output");
      this.says = figure.querySelector(".says");
      this.legend = figure.querySelector(".legend");
      this.button = figure.querySelector("button");
      this.pictures = new Map();  // number of the frame to {bitmap, ready}, the last used last
      this.shown = 0;
      this.disk = -1;
      figure.classList.add("plays");
      if (of.profile) this.profile = new shakebed.Profile(figure.querySelector(".side"), of.profile);
      this.slider.max = of.frames.length - 1;
      this.slider.oninput = () => { this.play(false); this.go(Number(this.slider.value)); };
      this.choice.onchange = () => { this.explain(); this.draw(); };
      this.button.onclick = () => this.play(!this.playing);
      this.canvas.addEventListener("pointermove", event => this.point(event));
      this.canvas.addEventListener("pointerdown", event => this.point(event));
      this.canvas.addEventListener("pointerleave", () => { this.disk = -1; this.draw(); });
      this.canvas.addEventListener("keydown", event => this.press(event));
      // To read the width while drawing would lay the page out at every step.
      new ResizeObserver(entries => { this.width = entries[0].contentRect.width; requestAnimationFrame(() => this.draw()); }).observe(this.canvas);
      this.width = this.canvas.clientWidth;
      this.explain();
      this.go(0);
    }
    // --- a disk's numbers
    at(i) {
      const k = bytesOfDisk * (this.first[this.shown] + i), d = this.data, of = this.of;
      return {
        x: (d[k] + 256 * d[k + 1]) / 65535 * of.width, y: (d[k + 2] + 256 * d[k + 3]) / 65535 * of.height,
        radius: d[k + 4] / 255 * of.radius, quality: d[k + 5] / 254, order: d[k + 6] === 255 ? null : d[k + 6] / 254,
        probability: d[k + 7] === 255 ? null : d[k + 7] / 254,
        step: d[k + 8] === 255 ? null : [d[k + 8], d[k + 9]].map(v => (v / 127 - 1) * of.step),
      };
    }
    // A way in D from frame to frame, as a velocity: in mm/s where rate and diameter are known.
    speed(way) {
      const { rate, diameter } = this.of;
      return rate && diameter ? [way * rate * diameter * 1e3, "mm/s"] : [way, "D a frame"];
    }
    // Decoded beside this thread, into a bitmap: an image element would be decoded again whenever it is drawn at another size.
    picture(k) {
      const held = this.pictures.get(k);
      this.pictures.delete(k);
      const picture = held || this.decode(k);
      this.pictures.set(k, picture);
      if (this.pictures.size > this.mostKept()) {
        const [oldest, gone] = this.pictures.entries().next().value;
        this.pictures.delete(oldest);
        gone.ready.then(() => gone.bitmap && gone.bitmap.close());
      }
      return picture;
    }
    mostKept() { return Math.max(2 * ahead.length, Math.floor(mostBytes / (4 * Math.max(1, this.canvas.width * this.canvas.height)))); }
    // The nearest picture that is not there yet, one after the other.
    async decodeMore() {
      for (let away = 1; away < this.of.frames.length && this.pictures.size < this.mostKept(); ++away) {
        for (const k of [this.shown + away, this.shown - away]) {
          if (k < 0 || k >= this.of.frames.length || this.pictures.has(k)) continue;
          await this.picture(k).ready;
          return whenIdle(() => this.decodeMore());
        }
      }
      this.decoding = false;
    }
    decode(k) {
      const picture = { bitmap: null };
      const size = this.canvas.width > 0 && this.width ? { resizeWidth: this.canvas.width, resizeHeight: this.canvas.height, resizeQuality: "medium" } : {};
      picture.ready = createImageBitmap(new Blob([shakebed.bytes(this.of.pictures[k])], { type: `image/${this.of.kind}` }), size)
        .then(bitmap => { picture.bitmap = bitmap; }, () => { /* the disks are shown without their picture */ });
      return picture;
    }
    async go(k) {
      this.shown = k;
      this.disk = -1;
      this.slider.value = k;
      const picture = this.picture(k);
      if (!picture.bitmap) await picture.ready;
      if (this.shown !== k) return;
      this.draw();
      for (const way of ahead) if (k + way >= 0 && k + way < this.of.frames.length) this.picture(k + way);
      this.picture(k);  // the last that would be let go
      if (!this.decoding) { this.decoding = true; whenIdle(() => this.decodeMore()); }
    }
    play(on) {
      this.playing = on;
      this.button.textContent = on ? "Pause" : "Play";
      clearInterval(this.timer);
      if (on) this.timer = setInterval(() => this.go((this.shown + 1) % this.of.frames.length), 150);
    }
    shade(disk) {
      switch (this.choice.value) {
        case "quality": return shakebed.color(disk.quality);
        case "order": return disk.order === null ? null : shakebed.color(disk.order);
        case "speed": return disk.step === null ? null : shakebed.color(Math.hypot(...disk.step) / this.of.step);
        default: return null;
      }
    }
    draw() {
      const { of, context, canvas, width } = this, ratio = devicePixelRatio || 1;
      if (!width) return;
      const height = Math.round(width * of.height / of.width), scale = width / of.width;
      if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
        canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio); canvas.style.height = height + "px";
      }
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      context.clearRect(0, 0, width, height);
      const { bitmap } = this.picture(this.shown);
      if (bitmap) context.drawImage(bitmap, 0, 0, width, height);
      const marks = of.marks && of.marks[this.shown], wrong = new Set(marks ? marks.false : []), truth = this.choice.value === "truth";
      if (this.choice.value !== "none") {
        const color = truth ? "#2fc79a" : "#00c853", half = 0.5 * Math.max(1, 1.4 * Math.min(1.2, scale));
        for (let i = 0; i < of.counts[this.shown]; ++i) {
          const disk = this.at(i), x = (disk.x + 0.5) * scale, y = (disk.y + 0.5) * scale, r = Math.max(1, disk.radius * scale - 0.5);
          const fill = this.shade(disk);
          if (fill) {
            context.beginPath(); context.arc(x, y, r, 0, 2 * Math.PI);
            context.globalAlpha = 0.85; context.fillStyle = fill; context.fill(); context.globalAlpha = 1;
          }
          // A ring that is filled is drawn in a third of the time of a stroked circle.
          context.beginPath();
          context.arc(x, y, r + half, 0, 2 * Math.PI); context.arc(x, y, Math.max(0, r - half), 0, 2 * Math.PI, true);
          context.fillStyle = color; context.fill();
        }
      }
      if (truth && marks) {
        context.lineWidth = 2.5;
        context.strokeStyle = "#ff8a3d";
        for (const i of wrong) { const d = this.at(i); context.strokeRect((d.x + 0.5 - d.radius) * scale, (d.y + 0.5 - d.radius) * scale, 2 * d.radius * scale, 2 * d.radius * scale); }
        context.strokeStyle = "#ff3fa4";
        context.beginPath();
        const r = of.radius * 0.7 * scale;
        for (let i = 0; i < marks.missed.length; i += 2) {
          const x = (marks.missed[i] + 0.5) * scale, y = (marks.missed[i + 1] + 0.5) * scale;
          context.moveTo(x - r, y - r); context.lineTo(x + r, y + r); context.moveTo(x - r, y + r); context.lineTo(x + r, y - r);
        }
        context.stroke();
      }
      context.lineWidth = 1.5; context.strokeStyle = "#4aa3df"; context.setLineDash([6, 4]); context.beginPath();
      if (of.floor !== null) { context.moveTo(0, (of.floor + 0.5) * scale); context.lineTo(width, (of.floor + 0.5) * scale); }
      context.stroke(); context.setLineDash([]);
      this.tell(scale, width);
      this.figure.dataset.drawn = Number(this.figure.dataset.drawn || 0) + 1;
      this.figure.dataset.shown = this.shown;
    }
    // What the colours mean.
    explain() {
      const words = { quality: ["poor", "a bead like all the others"], order: ["disordered, |ψ6| = 0", "crystal, 1"], speed: ["0", this.speed(this.of.step).map((v, i) => (i ? v : String(Number(v.toPrecision(2))))).join(" ") + " or more"] }[this.choice.value];
      this.legend.replaceChildren();
      if (words) {
        const bar = document.createElement("i");
        bar.style.background = `linear-gradient(90deg, ${[0, 0.25, 0.5, 0.75, 1].map(shakebed.color).join(", ")})`;
        this.legend.append(words[0], bar, words[1]);
      } else if (this.choice.value === "truth") this.legend.append("✕ missed, □ false, ○ found");
    }
    tell(scale, width) {
      const { of } = this, marks = of.marks && of.marks[this.shown];
      this.text.textContent = `frame ${of.frames[this.shown]}, ${of.counts[this.shown]} disks${marks ? `, ${marks.missed.length / 2} missed, ${marks.false.length} false` : ""}`;
      if (this.profile) this.profile.show(this.shown);
      this.says.hidden = this.disk < 0;
      if (this.disk < 0) return;
      const disk = this.at(this.disk), x = (disk.x + 0.5) * scale, y = (disk.y + 0.5) * scale;
      this.context.strokeStyle = "#ff3fa4"; this.context.lineWidth = 2.5;
      this.context.beginPath(); this.context.arc(x, y, disk.radius * scale + 2, 0, 2 * Math.PI); this.context.stroke();
      const lines = [`disk ${this.disk}`, `radius ${disk.radius.toFixed(2)} px`, `quality ${disk.quality.toFixed(2)}`];
      if (disk.order !== null) lines.push(`|ψ6| ${disk.order.toFixed(2)}`);
      if (disk.probability !== null) lines.push(`probability ${disk.probability.toFixed(2)}`);
      if (disk.step !== null) {
        const [x, z] = disk.step.map(way => this.speed(way));
        lines.push(`velocity ${[x, z].map(v => shakebed.minus(Number(v[0].toPrecision(2)))).join(", ")} ${x[1]}`);
      }
      if (marks) lines.push(marks.false.includes(this.disk) ? "false: there is no bead" : "there is a bead");
      this.says.replaceChildren(...lines.flatMap((line, k) => (k ? [document.createElement("br"), line] : [line])));
      this.says.style.left = `${Math.max(0, Math.min(width - this.says.offsetWidth, x + (x > width / 2 ? -this.says.offsetWidth - 12 : 12)))}px`;
      this.says.style.top = `${Math.max(0, y - 20)}px`;
    }
    point(event) {
      const box = this.canvas.getBoundingClientRect(), scale = box.width / this.of.width;
      const x = (event.clientX - box.left) / scale - 0.5, y = (event.clientY - box.top) / scale - 0.5;
      let best = -1, nearest = (1.2 * this.of.radius) ** 2;
      for (let i = 0; i < this.of.counts[this.shown]; ++i) {
        const disk = this.at(i), d = (disk.x - x) ** 2 + (disk.y - y) ** 2;
        if (d < nearest) { nearest = d; best = i; }
      }
      if (best === this.disk) return;
      this.disk = best;
      this.draw();
    }
    press(event) {
      const n = this.of.counts[this.shown], step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
      if (event.key === "Escape") this.disk = -1;
      else if (step && n) this.disk = this.disk < 0 ? 0 : (this.disk + step + n) % n;
      else return;
      event.preventDefault();
      this.draw();
    }
  }
  for (const figure of document.querySelectorAll("figure.film")) new Film(figure);
})();
