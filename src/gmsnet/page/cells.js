// Cells as triangles, and where their nodes are.

const REAL = [1, 2, 4]; // the edge opposite to corner 0, 1, 2 of a triangle is one of the cell

class Cells {
  constructor(scene) {
    this.scene = scene;
    const { arrays, groups, states, nodes, dimension } = scene;
    this.dimension = dimension;
    this.nodes = nodes;
    let first = 0;
    let offset = 0;
    this.groups = groups.map((group) => {
      const made = { ...group, first, offset, fans: group.facets.map(fanOf) };
      first += group.count;
      offset += group.count * group.corners;
      return made;
    });
    this.count = first;
    this.corners = arrays.corners;
    this.numbers = arrays.numbers || null;
    this.high = [arrays[states[0]], arrays[states.at(-1)]];
    this.low = scene.fine ? [arrays[`${states[0]}Low`], arrays[`${states.at(-1)}Low`]] : null;
  }

  groupOf(cell) {
    return this.groups.find((group) => cell < group.first + group.count);
  }

  /** The nodes of a cell. */
  nodesOf(cell) {
    const { first, offset, count, corners } = this.groupOf(cell);
    return Array.from({ length: corners }, (_, k) => this.corners[offset + k * count + cell - first]);
  }

  numberOf(cell) {
    return this.numbers ? this.numbers[cell] : cell;
  }

  withNumber(number) {
    return this.numbers ? this.numbers.indexOf(number) : number;
  }

  /** Where a node is, from before (t = 0) to after (t = 1), in half extents around the middle. */
  place(node, t) {
    const at = [0, 0, 0];
    for (let d = 0; d < this.dimension; d++) {
      const k = d * this.nodes + node;
      const ends = [0, 1].map((state) => this.high[state][k] + (this.low ? this.low[state][k] : 0));
      at[d] = ends[0] * (1 - t) + ends[1] * t;
    }
    return at;
  }

  placesOf(cell, t) {
    return this.nodesOf(cell).map((node) => this.place(node, t));
  }

  /** Four numbers a triangle: its nodes, and its cell with the bits of the edges that are real. */
  triangles(facets) {
    const { facets: most } = this.scene;
    let total = 0;
    const count = (group, k) => (total += group.fans[k].length);
    const out = { array: null, at: 0 };
    const add = (group, k, cell) => {
      const base = group.offset + cell - group.first;
      for (const [a, b, c, real] of group.fans[k]) {
        out.array[out.at++] = this.corners[base + a * group.count];
        out.array[out.at++] = this.corners[base + b * group.count];
        out.array[out.at++] = this.corners[base + c * group.count];
        out.array[out.at++] = (cell | (real << 29)) >>> 0;
      }
    };
    const each = facets
      ? (work) => {
          for (const code of facets) work(this.groupOf(Math.floor(code / most)), code % most, Math.floor(code / most));
        }
      : (work) => {
          for (const group of this.groups)
            for (let cell = group.first; cell < group.first + group.count; cell++) work(group, 0, cell);
        };
    each(count);
    out.array = new Uint32Array(4 * total);
    each(add);
    return out.array;
  }

  /** The facets of all volumes that a plane cuts: those with corners on both of its sides. */
  cutBy(axis, offset, t) {
    const { facets: most } = this.scene;
    const side = new Uint8Array(this.nodes);
    const begin = axis * this.nodes;
    const [before, after] = this.high;
    for (let node = 0; node < this.nodes; node++) {
      const k = begin + node;
      side[node] = before[k] * (1 - t) + after[k] * t > offset ? 1 : 0;
    }
    const found = [];
    let cells = 0;
    for (const group of this.groups) {
      for (let i = 0; i < group.count; i++) {
        let beyond = 0;
        for (let k = 0; k < group.corners; k++) beyond += side[this.corners[group.offset + k * group.count + i]];
        if (!beyond || beyond === group.corners) continue;
        cells++;
        for (let k = 0; k < group.facets.length; k++) found.push((group.first + i) * most + k);
      }
    }
    return { cells, triangles: this.triangles(found) };
  }
}

/** A facet as triangles from its first corner, each with the bits of its real edges. */
const fanOf = (facet) => {
  const fan = [];
  for (let k = 1; k + 1 < facet.length; k++) {
    const last = k + 2 === facet.length;
    fan.push([facet[0], facet[k], facet[k + 1], REAL[0] | (last ? REAL[1] : 0) | (k === 1 ? REAL[2] : 0)]);
  }
  return fan;
};
