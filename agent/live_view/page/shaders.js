// The programs that draw meshes and clouds of points.
const MESH_VERTEX = `#version 300 es
uniform mat4 u_project, u_model;
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
out vec3 v_normal, v_world;
void main() {
  vec4 world = u_model * vec4(a_position, 1.0);
  v_world = world.xyz;
  v_normal = mat3(u_model) * a_normal;
  gl_Position = u_project * world;
}`;
const MESH_FRAGMENT = `#version 300 es
precision mediump float;
uniform vec4 u_color;
uniform vec3 u_light;
uniform float u_lit, u_grid;
in vec3 v_normal, v_world;
out vec4 color;
void main() {
  vec3 normal = normalize(v_normal);
  float light = mix(1.0, 0.58 + 0.34 * max(dot(normal, u_light), 0.0) + 0.12 * normal.z, u_lit);
  vec2 lines = abs(fract(v_world.xy * 10.0 + 0.5) - 0.5) / fwidth(v_world.xy * 10.0);
  float line = u_grid * (1.0 - clamp(min(lines.x, lines.y), 0.0, 1.0)) * step(0.5, normal.z);
  color = vec4(u_color.rgb * light * (1.0 - 0.12 * line), u_color.a);
}`;
const POINT_VERTEX = `#version 300 es
uniform mat4 u_project, u_model;
uniform float u_size, u_own;
uniform vec3 u_color;
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_color;
out vec3 v_color;
void main() {
  gl_Position = u_project * u_model * vec4(a_position, 1.0);
  gl_PointSize = clamp(u_size / gl_Position.w, 1.5, 60.0);
  v_color = mix(u_color, a_color, u_own);
}`;
const POINT_FRAGMENT = `#version 300 es
precision mediump float;
uniform float u_alpha, u_lit;
in vec3 v_color;
out vec4 color;
void main() {
  vec2 place = 2.0 * gl_PointCoord - 1.0;
  float inside = dot(place, place);
  if (inside > 1.0) discard;
  vec3 normal = vec3(place.x, -place.y, sqrt(1.0 - inside));
  float light = mix(1.0, 0.66 + 0.4 * max(dot(normal, normalize(vec3(-0.3, 0.6, 0.7))), 0.0), u_lit);
  color = vec4(v_color * light, u_alpha);
}`;

export const MESHES = [MESH_VERTEX, MESH_FRAGMENT], POINTS = [POINT_VERTEX, POINT_FRAGMENT];

export function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(made) || "shader");
  const places = new Map();
  const at = (name) => {
    if (!places.has(name)) places.set(name, gl.getUniformLocation(made, name));
    return places.get(name);
  };
  return { program: made, at };
}
