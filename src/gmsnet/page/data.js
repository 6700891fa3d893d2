// The arrays that the page carries (arrays.py): base64 of deflated bytes, those of equal weight side by side.

const TYPES = { u1: Uint8Array, u2: Uint16Array, u4: Uint32Array, i2: Int16Array, f4: Float32Array };

const bytesOf = (text) => {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return bytes;
};

const inflated = async (bytes) => {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
};

const summed = (steps) => {
  let value = 0;
  for (let i = 0; i < steps.length; i++) {
    const folded = steps[i];
    value = (value + ((folded >>> 1) ^ -(folded & 1))) | 0;
    steps[i] = value;
  }
};

const readArray = async (name, { type, count }) => {
  const element = document.getElementById(`array-${name}`);
  const planes = await inflated(bytesOf(element.textContent));
  element.remove(); // its text takes more memory than the array
  const width = TYPES[type].BYTES_PER_ELEMENT;
  if (planes.length !== width * count) throw new Error(`the array ${name} has ${planes.length} bytes`);
  const bytes = new Uint8Array(planes.length);
  for (let plane = 0; plane < width; plane++) {
    const offset = plane * count;
    for (let i = 0, at = plane; i < count; i++, at += width) bytes[at] = planes[offset + i];
  }
  const array = new TYPES[type](bytes.buffer);
  if (type === "u4") summed(array);
  return array;
};

/** The description of the scene with its arrays, each by its name. */
const readScene = async () => {
  const scene = JSON.parse(document.getElementById("scene").textContent);
  const names = Object.keys(scene.arrays);
  const arrays = await Promise.all(names.map((name) => readArray(name, scene.arrays[name])));
  scene.arrays = Object.fromEntries(names.map((name, k) => [name, arrays[k]]));
  if (scene.states.length > 1) {
    for (const part of scene.fine ? ["", "Low"] : [""]) {
      // Kept are the bits that differ from those before.
      const before = new Uint32Array(scene.arrays[`before${part}`].buffer);
      const after = new Uint32Array(scene.arrays[`after${part}`].buffer);
      for (let i = 0; i < after.length; i++) after[i] ^= before[i];
    }
  }
  return scene;
};
