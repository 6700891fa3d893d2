// Where one looks from. A picture in space is turned about its centre; parallel lines stay parallel.

class Camera {
  constructor(dimension, box) {
    this.dimension = dimension;
    this.box = box; // [least, greatest] of the places of all nodes
    this.width = this.height = 1; // of the picture, in pixels of the page
    this.turnTo(-0.9, 0.45);
  }

  turnTo(yaw, pitch) {
    this.yaw = yaw;
    this.pitch = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, pitch));
    const [cy, sy] = [Math.cos(this.yaw), Math.sin(this.yaw)];
    const [cp, sp] = [Math.cos(this.pitch), Math.sin(this.pitch)];
    this.rows = this.dimension === 2 ? [[1, 0, 0], [0, 1, 0], [0, 0, 1]] : [[-sy, cy, 0], [-sp * cy, -sp * sy, cp], [cp * cy, cp * sy, sp]];
  }

  lookAlong(axis) {
    if (axis === "x") this.turnTo(0, 0);
    if (axis === "y") this.turnTo(-Math.PI / 2, 0);
    if (axis === "z") this.turnTo(-Math.PI / 2, Math.PI / 2);
    this.whole();
  }

  /** The extents of a box as they are seen. */
  seen([low, high]) {
    return [0, 1].map((row) => this.rows[row].reduce((sum, value, k) => sum + Math.abs(value) * (high[k] - low[k]), 0));
  }

  show(box, share) {
    const [low, high] = box;
    this.centre = low.map((value, k) => 0.5 * (value + high[k]));
    const [across, up] = this.seen(box);
    const tiny = 1e-12;
    this.zoom = share * Math.min(this.width / Math.max(across, tiny), this.height / Math.max(up, tiny)); // pixels a unit
    this.limit();
  }

  whole() {
    this.show(this.box, 0.94);
  }

  limit() {
    const least = 0.1 * Math.min(this.width, this.height);
    this.zoom = Math.max(least, Math.min(this.zoom, 1e13));
  }

  /** By pixels of the page, to the right and down. */
  move(dx, dy) {
    for (let k = 0; k < 3; k++) this.centre[k] += (-dx * this.rows[0][k] + dy * this.rows[1][k]) / this.zoom;
  }

  turn(dx, dy) {
    this.turnTo(this.yaw - 0.008 * dx, this.pitch + 0.008 * dy);
  }

  /** What is at (x, y), in pixels from the middle of the picture, to the right and down, stays there. */
  zoomBy(factor, x, y) {
    const before = this.zoom;
    this.zoom *= factor;
    this.limit();
    const share = this.zoom / before;
    this.move(x * (1 - share), y * (1 - share));
  }

  /** Pixels of the page from its upper left corner. */
  project(place) {
    const at = place.map((value, k) => value - this.centre[k]);
    const [right, up] = [0, 1].map((row) => this.rows[row].reduce((sum, value, k) => sum + value * at[k], 0));
    return [0.5 * this.width + right * this.zoom, 0.5 * this.height - up * this.zoom];
  }
}
