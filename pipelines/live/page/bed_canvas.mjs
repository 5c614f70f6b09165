// The bed on its canvas: disks by speed or plain, floor, sides.
const speedSteps = 24;
const smallest = 40; // sides of a canvas that can show a bed (px)

export class BedCanvas {
  constructor(canvas) {
    this.canvas = canvas;
    this.frame = null;
    new ResizeObserver(() => this.draw()).observe(canvas);
  }
  // Heights shown: the box is as high as the highest disk has been lately, in steps, so that it does not jump.
  show(frame, settings) {
    const highest = frame.z.reduce((most, z) => Math.max(most, z), 0);
    const wanted = Math.max(8, 4 * Math.ceil((highest + 2) / 4));
    if (!this.height || this.settings !== settings) this.height = Math.max(wanted, 1.6 * frame.numbers.columnNumber + 8);
    this.height = Math.max(this.height, Math.min(wanted, 3 * frame.numbers.columnNumber + 24));
    this.frame = frame;
    this.settings = settings;
    this.draw();
  }
  colours() {
    const style = getComputedStyle(this.canvas);
    const value = (name) => style.getPropertyValue(name).trim();
    return { disk: value("--disk"), fast: value("--fast"), floor: value("--text"), wall: value("--line") };
  }
  draw() {
    const { canvas, frame, settings } = this;
    if (!frame) return;
    const density = window.devicePixelRatio || 1;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (width < smallest || height < smallest) return; // it is not laid out yet
    if (canvas.width !== Math.round(width * density) || canvas.height !== Math.round(height * density)) {
      canvas.width = Math.round(width * density);
      canvas.height = Math.round(height * density);
    }
    const box = settings.width / settings.diameter, below = frame.numbers.amplitude + 1;
    const scale = Math.min((width - 8) / box, (height - 4) / (this.height + below));
    const context = canvas.getContext("2d");
    const left = (width - scale * box) / 2, ground = height - scale * below;
    const at = (x, z) => [left + scale * x, ground - scale * z];
    context.setTransform(density, 0, 0, density, 0, 0);
    context.clearRect(0, 0, width, height);
    this.drawDisks(context, at, scale, box);
    this.drawWalls(context, at, box, height);
  }
  drawDisks(context, at, scale, box) {
    const { frame } = this, colours = this.colours();
    const usual = 2 * Math.sqrt(Math.max(frame.numbers.temperatureX + frame.numbers.temperatureZ, 0.5));
    // By speed: each colour is one path.
    const groups = Array.from({ length: speedSteps }, () => []);
    for (let i = 0; i < frame.x.length; ++i) {
      const share = Math.hypot(frame.vx[i], frame.vz[i]) / usual;
      groups[Math.min(speedSteps - 1, Math.floor(share * speedSteps))].push(i);
    }
    groups.forEach((disks, step) => {
      context.beginPath();
      for (const i of disks) {
        const wrapped = this.settings.periodic ? frame.x[i] - box * Math.floor(frame.x[i] / box) : frame.x[i];
        const [x, z] = at(wrapped, frame.z[i]);
        context.moveTo(x + 0.48 * scale, z);
        context.arc(x, z, 0.48 * scale, 0, 2 * Math.PI);
      }
      const part = Math.round((100 * step) / (speedSteps - 1));
      context.fillStyle = `color-mix(in srgb, ${colours.fast} ${part}%, ${colours.disk})`;
      context.fill();
    });
  }
  drawWalls(context, at, box, height) {
    const colours = this.colours(), floor = this.frame.numbers.floor;
    const [left, ground] = at(0, floor), [right] = at(box, floor);
    context.fillStyle = colours.floor;
    context.fillRect(left - 3, ground, right - left + 6, 3);
    context.strokeStyle = colours.wall;
    context.setLineDash(this.settings.periodic ? [4, 4] : []);
    context.lineWidth = 1.5;
    for (const x of [left - 1, right + 1]) {
      context.beginPath();
      context.moveTo(x, 0);
      context.lineTo(x, height);
      context.stroke();
    }
    context.setLineDash([]);
  }
}
