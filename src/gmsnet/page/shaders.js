// What the graphics processor does. Nodes and triangles are read from textures, so no corner is kept twice.

const ACROSS = 2048; // values a row of a texture

const COMMON = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
uniform sampler2D beforeHigh, afterHigh, beforeLow, afterLow;
uniform float mixing, depth;
uniform vec3 centreHigh, centreLow;
uniform mat3 turn;
uniform vec2 scale;
uniform bool fine;
ivec2 at(int i) { return ivec2(i % ${ACROSS}, i / ${ACROSS}); }
vec3 placeOf(int node) {  // from the centre: differences first, lest digits be lost
  ivec2 p = at(node);
  vec3 before = texelFetch(beforeHigh, p, 0).xyz - centreHigh, after = texelFetch(afterHigh, p, 0).xyz - centreHigh;
  if (fine) { before += texelFetch(beforeLow, p, 0).xyz; after += texelFetch(afterLow, p, 0).xyz; }
  return mix(before, after, mixing) - centreLow;
}
`;

const CELL_VERTEX = `${COMMON}
uniform usampler2D triangles;
uniform sampler2D values;
uniform bool flatland, displaced;
uniform float greatest;
out vec3 edge, view, place;
out float moved;
flat out vec2 measure;
flat out uint cell;
void main() {
  uvec4 triangle = texelFetch(triangles, at(gl_VertexID / 3), 0);
  int corner = gl_VertexID % 3, node = int(triangle[corner]);
  cell = triangle.w & 0x1fffffffu;
  uint real = triangle.w >> 29;
  edge = vec3(0);
  edge[corner] = 1.0;
  for (int k = 0; k < 3; k++) if ((real >> k & 1u) == 0u) edge[k] = 1.0;  // nowhere near an edge that is not real
  measure = texelFetch(values, at(int(cell)), 0).xy;
  ivec2 p = at(node);
  moved = displaced ? length(texelFetch(afterHigh, p, 0).xyz - texelFetch(beforeHigh, p, 0).xyz) / greatest : 0.0;
  place = placeOf(node);
  view = turn * place;
  float z = flatland ? 0.5 * clamp(mix(measure.x, measure.y, mixing), -1.0, 1.0) : clamp(-view.z * depth, -1.0, 1.0);
  gl_Position = vec4(view.xy * scale, z, 1);  // in a plane the worst cells lie on top
}`;

const CELL_FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
in vec3 edge, view, place;
in float moved;
flat in vec2 measure;
flat in uint cell;
uniform float mixing, pixel;
uniform bool flatland, displaced, picking, edged, clipped;
uniform vec4 clip;
uniform vec3 good[5], displacement[3], inverted, other;
out vec4 colour;
vec3 ramp(float x) {
  x = clamp(x, 0.0, 1.0) * 4.0;
  int k = min(int(x), 3);
  return mix(good[k], good[k + 1], x - float(k));
}
vec3 colourOf() {
  if (displaced) {
    float x = clamp(moved, 0.0, 1.0) * 2.0;
    int k = min(int(x), 1);
    return mix(displacement[k], displacement[k + 1], x - float(k));
  }
  vec2 ends = measure;
  float value = min(ends.x, ends.y) < 0.0 ? (mixing < 0.5 ? ends.x : ends.y) : mix(ends.x, ends.y, mixing);
  return value < -1.5 ? other : value < 0.0 ? inverted : ramp(value);
}
void main() {
  if (clipped && dot(clip.xyz, place) > clip.w) discard;
  if (picking) {
    uint code = cell + 1u;
    colour = vec4(code & 255u, code >> 8 & 255u, code >> 16 & 255u, code >> 24 & 255u) / 255.0;
    return;
  }
  vec3 shade = colourOf();
  if (!flatland) {
    vec3 normal = normalize(cross(dFdx(view), dFdy(view)));
    shade *= 0.62 + 0.38 * abs(normal.z);
  }
  if (edged) {
    vec3 width = fwidth(edge);  // one over the height of the triangle in pixels
    vec3 near = smoothstep(vec3(0.3), vec3(1.0), edge / max(width, 1e-12) / pixel);
    float line = 1.0 - min(min(near.x, near.y), near.z);
    float most = max(max(width.x, width.y), width.z) * pixel;
    vec3 ink = dot(shade, vec3(0.3, 0.6, 0.1)) > 0.66 ? vec3(0.25) : vec3(1);
    shade = mix(shade, ink, line * 0.7 * (1.0 - smoothstep(0.1, 0.35, most)));  // slivers keep their colour
  }
  colour = vec4(shade, 1);
}`;

const MARK_VERTEX = `${COMMON}
uniform usampler2D list;
uniform float size, forward;
uniform bool clipped;
uniform vec4 clip;
void main() {
  vec3 place = placeOf(int(texelFetch(list, at(gl_VertexID), 0).x)), view = turn * place;
  gl_Position = vec4(view.xy * scale, clamp(-view.z * depth, -1.0, 1.0) - forward, 1);
  if (clipped && dot(clip.xyz, place) > clip.w) gl_Position = vec4(2, 2, 2, 1);  // nowhere
  gl_PointSize = size;
}`;

const MARK_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 paint, rim;
uniform bool round;
out vec4 colour;
void main() {
  float far = round ? length(gl_PointCoord - 0.5) : 0.0;
  if (far > 0.5) discard;
  colour = vec4(far > 0.34 ? rim : paint, 1);
}`;
