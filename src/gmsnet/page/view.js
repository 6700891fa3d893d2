// Joins the picture to the controls of the page.

const find = (id) => document.getElementById(id);
const DIGITS = { shape: 3, angle: 1 };

class View {
  constructor(scene) {
    this.scene = scene;
    this.cells = new Cells(scene);
    this.canvas = find("canvas");
    this.picture = new Picture(this.canvas, this.cells);
    this.both = scene.states.length > 1;
    this.measureExtents();
    this.camera = new Camera(scene.dimension, this.box);
    this.look = { camera: this.camera, mixing: 1, edged: true, displaced: false, greatest: this.greatest, clip: null };
    this.chosen = -1;
    this.waiting = this.printing = false;
    this.picture.setLayer("shell", this.cells.triangles(scene.volumes ? scene.arrays.shell : null));
    this.offerColours();
    this.colour("shape");
    this.wireControls();
    this.wireLists();
    wirePointer(this);
    this.canvas.addEventListener("keydown", (event) => pressed(this, event));
    this.wirePage();
    this.resize();
    this.camera.whole();
  }

  /** The box of all nodes, and the greatest displacement of one. */
  measureExtents() {
    const { nodes, dimension, high } = this.cells;
    const low = [0, 0, 0];
    const top = [0, 0, 0];
    for (let d = 0; d < dimension; d++) {
      let [least, most] = [Infinity, -Infinity];
      for (const column of high)
        for (let k = d * nodes; k < (d + 1) * nodes; k++) {
          if (column[k] < least) least = column[k];
          if (column[k] > most) most = column[k];
        }
      [low[d], top[d]] = [least, most];
    }
    this.box = [low, top];
    let greatest = 0;
    for (let i = 0; this.both && i < nodes; i++) {
      let sum = 0;
      for (let d = 0; d < dimension; d++) sum += (high[1][d * nodes + i] - high[0][d * nodes + i]) ** 2;
      if (sum > greatest) greatest = sum;
    }
    this.greatest = Math.sqrt(greatest);
  }

  offerColours() {
    const { symbol, angle } = this.scene;
    const offered = [["shape", symbol], ["angle", `smallest ${angle.replace(/^min /, "")}`]];
    if (this.greatest > 0) offered.push(["moved", "displacement"]);
    for (const [value, label] of offered) find("colour").add(new Option(label, value));
  }

  colour(name) {
    const { scene } = this;
    this.look.displaced = name === "moved";
    const measure = this.look.displaced ? "shape" : name;
    const most = measure === "angle" ? scene.greatest_angle : 1;
    const values = new Float32Array(2 * this.cells.count);
    [scene.states[0], scene.states.at(-1)].forEach((state, k) => {
      const column = scene.arrays[`${measure}-${state}`];
      const steps = scene.steps[measure] * most;
      for (let i = 0; i < column.length; i++)
        values[2 * i + k] = column[i] === scene.unknown ? -2 : Math.max(0, column[i] / steps);
      for (const i of scene.arrays[`invalid-${state}`]) values[2 * i + k] = -1;
    });
    this.picture.setValues(values);
    const { good, inverted, other, moved } = scene.colours;
    const invalid = scene.states.some((state) => scene.arrays[`invalid-${state}`].length);
    const unknown = scene.arrays[`shape-${scene.states[0]}`].includes(scene.unknown);
    const others = [...(invalid ? [[inverted, "inverted"]] : []), ...(unknown ? [[other, "not measured"]] : [])];
    if (this.look.displaced) legend(find("legend"), moved, ["0", figure(this.greatest * scene.half)], "displacement", []);
    else if (name === "angle") legend(find("legend"), good, ["0°", `${figure(most)}°`], find("colour").selectedOptions[0].text, others);
    else legend(find("legend"), good, ["0", "1"], scene.symbol, others);
  }

  wireControls() {
    const change = (id, work) => find(id) && find(id).addEventListener("input", () => (work(find(id)), this.paint()));
    change("mix", (slider) => this.mixTo(slider.value / 100));
    change("colour", (select) => this.colour(select.value));
    change("edges", (box) => (this.look.edged = box.checked));
    for (const id of ["axis", "cut", "inner"]) change(id, () => this.cut());
    find("whole").addEventListener("click", () => this.showWhole());
    for (const button of document.querySelectorAll("[data-look]"))
      button.addEventListener("click", () => (this.camera.lookAlong(button.dataset.look), this.paint()));
    find("controls").hidden = false;
  }

  wireLists() {
    this.buttons = [...document.querySelectorAll("button.go")];
    for (const button of this.buttons) {
      button.disabled = false;
      button.addEventListener("click", () => this.goTo(button));
    }
    for (const box of document.querySelectorAll("input[data-reason]")) {
      box.disabled = false;
      box.addEventListener("input", () => this.dots(Number(box.dataset.reason), box.checked));
    }
  }

  dots(reason, shown) {
    const { held } = this.scene.arrays;
    const nodes = [];
    if (shown) held.forEach((code, node) => code === reason + 1 && nodes.push(node));
    this.picture.setDots(`held-${reason}`, shown ? Uint32Array.from(nodes) : null, reason);
    this.paint();
  }

  mixTo(share) {
    this.look.mixing = share;
    if (this.look.clip) this.cut();
  }

  /** The plane of the cut, where the slider is or at a place, and the cells on both of its sides. */
  cut(place = null) {
    const axis = ["x", "y", "z"].indexOf(find("axis").value);
    find("cut").disabled = find("inner").disabled = axis < 0;
    if (axis < 0) {
      this.look.clip = null;
      this.picture.setLayer("inner", null);
      this.say();
      return;
    }
    const [low, high] = [this.box[0][axis], this.box[1][axis]];
    if (place !== null) find("cut").value = (1000 * (place - low)) / (high - low || 1);
    const offset = place === null ? low + (find("cut").value / 1000) * (high - low) : place;
    this.look.clip = { axis, offset };
    const { cells, triangles } = this.cells.cutBy(axis, offset, this.look.mixing);
    this.picture.setLayer("inner", find("inner").checked ? triangles : null);
    const at = this.scene.middle[axis] + offset * this.scene.half;
    this.say(`${cells.toLocaleString("en")} cells are cut at ${find("axis").value} = ${figure(at)}`);
  }

  showWhole() {
    this.choose(-1);
    this.camera.whole();
    this.paint();
  }

  /** Shows the cell that a button names, as it was or as it is. */
  goTo(button) {
    const cell = this.cells.withNumber(Number(button.dataset.cell));
    if (this.both) {
      const share = button.dataset.state === "before" ? 0 : 1;
      find("mix").value = 100 * share;
      this.mixTo(share);
    }
    this.at = this.buttons.indexOf(button);
    const places = this.cells.placesOf(cell, this.look.mixing);
    if (this.scene.volumes) this.cutThrough(places);
    this.choose(cell);
    const box = [Math.min, Math.max].map((end) => [0, 1, 2].map((k) => end(...places.map((place) => place[k]))));
    const reach = Math.max(...[0, 1, 2].map((k) => box[1][k] - box[0][k]));
    const wide = box.map((corner, end) => corner.map((value, k) => 0.5 * (box[0][k] + box[1][k]) + (end ? 0.5 : -0.5) * reach));
    this.camera.show(wide, 0.22);
    this.paint();
  }

  /** A cell inside a volume is seen only where the volume is cut. */
  cutThrough(places) {
    if (!find("axis").value) find("axis").value = "z";
    const axis = ["x", "y", "z"].indexOf(find("axis").value);
    this.cut(places.reduce((sum, place) => sum + place[axis], 0) / places.length);
  }

  next(step) {
    const worst = this.buttons.filter((button) => button.closest("#view"));
    if (!worst.length) return;
    const at = worst.indexOf(this.buttons[this.at]);
    this.goTo(worst[(at < 0 ? (step > 0 ? 0 : worst.length - 1) : at + step + worst.length) % worst.length]);
  }

  choose(cell) {
    this.chosen = cell;
    for (const button of this.buttons)
      button.setAttribute("aria-pressed", cell >= 0 && Number(button.dataset.cell) === this.cells.numberOf(cell));
    this.say(cell < 0 ? undefined : this.words(cell));
  }

  words(cell) {
    const { scene, cells } = this;
    const both = (name, unit) => {
      const texts = scene.states.map((state) => {
        const value = scene.arrays[`${name}-${state}`][cell];
        return value === scene.unknown ? "not measured" : (value / scene.steps[name]).toFixed(DIGITS[name]) + unit;
      });
      return texts.join(" → ");
    };
    const places = cells.placesOf(cell, this.look.mixing);
    const centre = scene.axes.map((_, k) => {
      const mean = places.reduce((sum, place) => sum + place[k], 0) / places.length;
      return (scene.middle[k] + mean * scene.half).toPrecision(6).replace(/\.?0+(e|$)/, "$1");
    });
    const kind = cells.groupOf(cell).kind;
    return `${kind} ${cells.numberOf(cell)} at ${centre.join(" ")}: ${scene.symbol} ${both("shape", "")}, ${scene.angle} ${both("angle", "°")}`;
  }

  say(words) {
    const { cells, nodes } = this.scene;
    const count = (value) => value.toLocaleString("en");
    find("said").textContent = words || `${count(cells)} cells and ${count(nodes)} nodes are drawn.`;
  }

  pick(x, y) {
    this.choose(this.picture.cellAt(this.look, x, y));
    this.paint();
  }

  wirePage() {
    new ResizeObserver(() => (this.resize(), this.paint())).observe(this.canvas);
    const dark = matchMedia("(prefers-color-scheme: dark)");
    dark.addEventListener("change", () => this.paint());
    const printing = (now) => {
      this.printing = now;
      this.paintNow();
    };
    addEventListener("beforeprint", () => printing(true));
    addEventListener("afterprint", () => printing(false));
    this.canvas.addEventListener("webglcontextlost", () => fail(new Error("the graphics driver gave up; load the page anew")));
  }

  resize() {
    const { canvas, camera } = this;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth || 1, canvas.clientHeight || 1];
    const share = Math.min(width / camera.width, height / camera.height);
    if (camera.zoom) camera.zoom *= share;
    [camera.width, camera.height] = [width, height];
    [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  }

  paint() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.paintNow();
    });
  }

  paintNow() {
    const style = getComputedStyle(document.documentElement);
    const dark = matchMedia("(prefers-color-scheme: dark)").matches && !this.printing;
    this.look.paper = rgb(style.getPropertyValue(dark ? "--canvas-dark" : "--canvas-light").trim());
    this.look.ink = dark ? [0.9, 0.92, 0.95] : [0.1, 0.12, 0.16];
    this.picture.draw(this.look);
    outline(find("over"), this.cells, this.camera, this.chosen, this.look.mixing);
  }
}

const figure = (value) => Number(value.toPrecision(4)).toString();

const fail = (error) => {
  find("failure").textContent = `The mesh cannot be drawn: ${error.message}.`;
  find("failure").hidden = false;
  find("said").textContent = "";
  document.documentElement.dataset.picture = "failed";
};

const start = async () => {
  if (!window.DecompressionStream) throw new Error("this browser is too old: it needs one of 2023 or later");
  const view = new View(await readScene());
  view.paintNow();
  view.say();
  document.documentElement.dataset.picture = "ready";
};

start().catch(fail);
